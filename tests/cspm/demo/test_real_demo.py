"""The demonstration on recordings of a real machine, which a made-up shaft stands in for."""

import json
import shutil

import numpy as np
import pytest

from cspm.commands.recordings.demo_real_command import RealDemoRequest, demo_real_command
from cspm.open_data.source import MACHINES, source_of
from cspm_msgs_py.errors import InputError

NAME, VISCOUS = "kuka_kr300", "winch_viscous_friction"
INERTIA, DRAG, DRY = 0.443, 2.563, 0.576  # of axis 6, as its file has them


def table(path, seed):
    """A shaft that swings with the inertia and friction of axis 6."""
    random = np.random.default_rng(seed)
    t = np.arange(2500) / 250.0
    waves = [(1.1, 1.3, 0.0), (0.5, 2.9, seed), (0.2, 5.1, 1.0)]
    q = sum(a * np.sin(w * t + p) for a, w, p in waves)
    v = sum(a * w * np.cos(w * t + p) for a, w, p in waves)
    a = -sum(a * w**2 * np.sin(w * t + p) for a, w, p in waves)
    torque = INERTIA * a + DRAG * v + DRY * np.sign(v) + random.normal(0.0, 0.05, len(t))
    rows = np.stack([t, np.degrees(q), np.degrees(v), torque, q], axis=1)
    np.savetxt(path, rows, "%.7f", ",", header="t,pos_deg,vel_deg_s,torque_nm,r", comments="")


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with what `cspm data get` leaves."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "open_data" / source_of(NAME).folder
    shutil.copytree(MACHINES / NAME, folder)
    for seed, each in enumerate(source_of(NAME).tables):
        table(folder / each.name, seed)
    return tmp_path


def seed_of_axis_6():
    """A seed that draws axis 6 at its joint side, the fifth of six machines."""
    return next(s for s in range(99) if int(np.random.default_rng(s).integers(6)) == 4)


@pytest.mark.slow
def test_a_known_term_leaves_the_file_and_is_named(here, capsys):
    request = RealDemoRequest(NAME, seed_of_axis_6(), VISCOUS, here / "out", ask=False)
    demo_real_command(request, here / "demo.json")
    said = capsys.readouterr().out
    assert "A_6.csv; the file lacks one known term" in said
    assert f"coefficient {DRAG:.3g} N·m·s/rad: named by the diagnosis" in said
    assert "MIT, J. Weigand" in said
    data = json.loads((here / "demo.json").read_text())
    assert (data["effect"], data["named"]) == (VISCOUS, True)
    assert (here / "out" / "verdict" / "diagnosis.html").is_file()


@pytest.mark.parametrize(
    ("name", "effect", "text"),
    [
        ("nothing", None, "nothing: no such recordings, allowed: "),
        (
            NAME,
            "pose_delay",
            "--effect pose_delay: no machine of kuka_kr300 has it, allowed: winch_c",
        ),
    ],
)
def test_what_there_is_not_is_one_line(here, name, effect, text):
    with pytest.raises(InputError) as caught:
        demo_real_command(RealDemoRequest(name, 1, effect, here / "out", ask=False), None)
    assert text in str(caught.value)
    assert not (here / "out").exists()
