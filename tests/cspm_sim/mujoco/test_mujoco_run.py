"""Runs on the MuJoCo plant: what a recording says of it, and how close it comes in closed loop."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest
from error_lines import said
from run_samples import bundle_of

from cspm.cli import main as cli
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.edited import file_of
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording import Recording
from cspm_msgs_py.recording.run_record import RECORD_NAME
from cspm_msgs_py.testbed import load_testbed
from cspm_run.agreement import CASES, Agreement, AgreementCase, agreement_page, compare
from cspm_run.assembly import assemble
from cspm_run.plants import PLANTS
from cspm_run.resim import resimulate

pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")

PAGE = Path(__file__).resolve().parents[3] / "results" / "agreement.md"
NUMBER = re.compile(r"\d\.\de[-+]\d\d")


def command(monkeypatch, *words):
    monkeypatch.setattr(sys, "argv", ["cspm", *map(str, words)])
    with pytest.raises(SystemExit) as caught:
        cli.main()
    return caught.value.code or 0


def record(monkeypatch, folder, plant):
    words = ["run", "worst_case", "--duration", "0.3", "--out", folder, "--plant", plant]
    assert command(monkeypatch, *words) == 0
    return folder


@pytest.fixture
def recording(monkeypatch, tmp_path):
    return record(monkeypatch, tmp_path / "bag", "mujoco")


@pytest.mark.parametrize("plant", PLANTS)
def test_a_recording_says_which_plant_made_it(monkeypatch, tmp_path, capsys, plant):
    folder = record(monkeypatch, tmp_path / "bag", plant)
    with Recording(folder) as found:
        assert found.metadata[RECORD_NAME]["plant"] == plant
    assert command(monkeypatch, "info", folder) == 0
    assert f"plant {plant}" in capsys.readouterr().out


def test_resim_repeats_it_bit_for_bit(recording):
    found = resimulate(recording, lambda now, total: None)
    assert found.difference is None
    assert found.messages > 3000


def test_resim_repeats_it_on_the_plant_that_made_it(monkeypatch, recording):
    monkeypatch.setattr("cspm_run.resim.replace", lambda bundle, plant: bundle)  # forgets the plant
    assert resimulate(recording, lambda now, total: None).difference is not None


def test_an_unknown_plant_is_refused(monkeypatch, capsys):
    assert command(monkeypatch, "run", "rest", "--plant", "real", "--no-record") == 2
    assert said(capsys.readouterr().err) == (
        "--plant real: allowed: sim, mujoco, external, or a file: a unit of FMI 2, or the list of"
        " names in one\n"
    )
    bundle = bundle_of("rest")
    with pytest.raises(InputError, match=r"^plant real: allowed: sim, mujoco$"):
        assemble(bundle.scenario, bundle.testbed.testbed, Path(), "real")


def test_it_says_what_to_install(monkeypatch):
    bundle = bundle_of("rest")
    monkeypatch.delitem(sys.modules, "cspm_sim.mujoco.plant", raising=False)
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(
        InputError,
        match=r"^plant mujoco: mujoco is not .*, allowed: after `pip install 'cspm\[mujoco\]'`$",
    ):
        assemble(bundle.scenario, bundle.testbed.testbed, Path(), "mujoco")


def test_an_old_mujoco_is_one_line(monkeypatch):
    monkeypatch.setattr("cspm_run.plants.metadata_version", lambda _: "3.17.0")
    bundle = bundle_of("rest")
    with pytest.raises(
        InputError, match=r"^plant mujoco: MuJoCo 3.17.0 is installed, allowed: 4.0 or"
    ):
        assemble(bundle.scenario, bundle.testbed.testbed, Path(), "mujoco")


@pytest.mark.slow
@pytest.mark.compiled
def test_both_plants_agree_in_closed_loop():
    case = AgreementCase(
        "worst_case_steep", "", ("duration=6", "sensors=ideal", "target.motion.ramp=2")
    )
    found = compare(case)
    assert (found.motion[:3] > 5e-3).all()
    assert (found.pose < 1e-7).all()
    assert found.tension < 1e-5


@pytest.mark.slow
@pytest.mark.compiled
def test_rounding_sensors_set_them_apart_within_the_sensors_resolution():
    found = compare(AgreementCase("worst_case_steep", "", ("duration=3",)))
    assert (found.pose < 1e-4).all()
    assert 1e-6 < found.tension < 0.01


@pytest.mark.slow
@pytest.mark.compiled
def test_noise_without_rounding_does_not_set_them_apart(monkeypatch):
    def unrounded(path):
        found = load_testbed(path)
        sensors = {
            name: sensor.model_copy(update={"resolution": (0.0,) * len(sensor.resolution)})
            for name, sensor in found.testbed.sensors.items()
        }
        return file_of(found.testbed.model_copy(update={"sensors": sensors}))

    monkeypatch.setattr("cspm_run.agreement.load_testbed", unrounded)
    found = compare(AgreementCase("worst_case_steep", "", ("duration=3",)))
    assert (found.pose < 1e-9).all()
    assert found.tension < 1e-7


def rows():
    """The page's numbers by row name, of the table of differences."""
    lines = [line.split(" | ") for line in PAGE.read_text(encoding="utf-8").splitlines()]
    return [
        (cells[0].strip("| "), [float(x) for x in NUMBER.findall(" ".join(cells[1:]))])
        for cells in lines
        if len(cells) > 6 and NUMBER.search(cells[1])
    ]


def test_the_page_has_every_case():
    names = [name for name, _ in rows() if name != "motion"]
    assert names == [f"`{c.scenario}`" + f", {c.note}" * bool(c.note) for c in CASES]
    same = Agreement(np.zeros(6), np.ones(6), 0.0, 0.0, (30.0, 5.0))
    assert agreement_page([(case, same) for case in CASES]).count("| `") == len(CASES) + 5


def test_the_page_says_that_they_agree():
    for name, numbers in rows():
        pose, tension = numbers[: len(DOFS)], numbers[len(DOFS) :]
        if "ideal" in name or "verification" in name:
            assert max(pose) < 1e-7, name
            assert max(tension) < 1e-5, name
        elif name != "motion":
            assert max(pose) < 1e-4, name


@pytest.mark.slow
@pytest.mark.compiled
def test_the_pages_numbers_are_those_that_the_code_gives():
    found = compare(AgreementCase("verification_short"))
    numbers = dict(rows())["`verification_short`"]
    # The last bits of a processor decide between zero and 10⁻¹⁵.
    for value, printed in zip([*found.pose, found.tension], numbers, strict=False):
        assert value == pytest.approx(printed, rel=1.0, abs=1e-12)
