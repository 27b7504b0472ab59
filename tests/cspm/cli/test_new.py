"""`cspm new`: files that run as they are, of every kind; and the tutorial as it is printed."""

import re
import shlex
from pathlib import Path

import pytest

import cspm
from cspm.commands.new_command import new_command
from cspm.new.layout import KINDS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import load_testbed

PAGE = Path(__file__).resolve().parents[3] / "docs" / "tutorials" / "your-robot.md"
SIX = ["surge", "sway", "heave", "roll", "pitch", "yaw"]
CONTROLLED = {
    "planar": ["surge", "heave", "pitch"],
    "point": SIX[:3],
    "suspended": SIX[:3],
    "crossed": SIX,
    "held": SIX,
}


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("size", "mass"), [((2.0, 2.0, 2.0), 5.0), ((6.0, 4.0, 3.0), 40.0)])
def test_what_is_written_runs_as_it_is(here, kind, size, mass):
    new_command("mine", kind, size, mass, run=False)
    run = cspm.simulate(here / "mine.yaml", duration=2.5)
    assert run.failure is None
    # A plate in a frame of another shape is turned by its cables as well.
    assert set(run.summary["controlled"]) >= set(CONTROLLED[kind])
    assert run.summary["slack_share"] == 0.0
    for dof in CONTROLLED[kind]:
        assert run.errors[dof]["rms"] < 0.01, dof
    assert (here / "mine.svg").read_text().startswith("<svg")
    testbed = (here / "mine_testbed.yaml").read_text()
    # Every number of the first winch says its unit.
    winch = testbed.split("- &winch")[1].split("- <<")[0]
    assert all("#" in line for line in winch.splitlines() if re.search(r": [\d\[]", line))


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (("my robot", "point", (2.0, 2.0, 2.0), 5.0), "new my robot: allowed: letters, digits"),
        (("mine", "delta", (2.0, 2.0, 2.0), 5.0), "--kind delta: allowed: planar, point, susp"),
        (("mine", "point", (2.0, -2.0, 2.0), 5.0), "allowed: more than 0"),
        (("mine", "point", (2.0, 2.0, 2.0), 0.0), "--mass 0: allowed: more than 0"),
    ],
)
def test_each_fault_is_one_line_and_writes_nothing(here, given, text):
    with pytest.raises(InputError) as caught:
        new_command(*given, run=False)
    assert text in str(caught.value)
    assert not list(here.iterdir())


def test_accuracies_are_in_the_file_where_they_are_given(here, cspm):
    given = ["--survey-accuracy", "0.0005", "--mass-accuracy", "0.01"]
    assert cspm("new", "known", *given, "--no-run")[0] == 0
    assert cspm("new", "usual", "--no-run")[0] == 0
    known, usual = (load_testbed(here / f"{name}_testbed.yaml") for name in ("known", "usual"))
    assert known.testbed.cables == usual.testbed.cables
    places = [f"cables[{i}].{end}" for i in range(4) for end in ("exit", "attachment")]
    expected = dict.fromkeys(places, 0.0005) | {"bar.mass": 0.01}
    assert {path: about.accuracy for path, about in known.provenance.items()} == expected
    assert usual.provenance == {}
    code, _, err = cspm("new", "wrong", "--survey-accuracy", "-1")
    assert (code, err) == (2, "cspm new: --survey-accuracy -1: allowed: 0 or more\n")


def test_a_planar_robot_has_a_size_of_two_numbers(here, cspm):
    for name, size in (("two", "3,2"), ("three", "3,3,2")):
        code, _, err = cspm("new", name, "--kind", "planar", "--size", size, "--no-run")
        assert (code, err) == (0, "")
    texts = [(here / f"{name}_testbed.yaml").read_text() for name in ("two", "three")]
    assert texts[0].replace("two", "three") == texts[1]
    assert "exit: [1.5, 0, 2]" in texts[0]


@pytest.mark.parametrize(
    ("kind", "size", "allowed"),
    [
        ("planar", "3", "two or three numbers in m"),
        ("planar", "3,x", "two or three numbers in m"),
        ("point", "3,2", "three numbers in m"),
    ],
)
def test_a_size_of_other_numbers_is_refused(refused, kind, size, allowed):
    line = refused("new", "mine", "--kind", kind, "--size", size)
    assert line == f"--size {size}: allowed: {allowed}, such as 2,2,2"


def test_what_exists_is_kept(here):
    (here / "mine.yaml").write_text("kept")
    with pytest.raises(InputError, match=r"mine\.yaml: already exists, allowed: a new file"):
        new_command("mine", "point", (2.0, 2.0, 2.0), 5.0, run=False)
    assert (here / "mine.yaml").read_text() == "kept"


@pytest.mark.slow
@pytest.mark.compiled
def test_the_tutorial_can_be_followed_literally(here, cspm):
    blocks = re.findall(r"```sh\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    commands = [line for block in blocks for line in block.splitlines() if line.strip()]
    assert len(commands) >= 5
    printed = {}
    for line in commands:
        program, *arguments = shlex.split(line)
        assert program == "cspm"
        code, out, err = cspm(*arguments)
        assert code == 0, (line, err)
        printed[line] = out
    verdict = next(out for line, out in printed.items() if line.startswith("cspm diagnose"))
    assert "dry friction" in verdict.lower() or "coulomb" in verdict.lower()
