"""Commands of the pages are run as they are printed, in an empty folder with what a page assumes.

What takes minutes, waits for a person, or needs a machine is in `NOT_RUN`, with the reason.
"""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
BLOCK = re.compile(r"(?:<!-- ([a-z ]+?)(?:: ([^>]+?))? -->\n)?^```(\w*)\n(.*?)^```", re.M | re.S)
COMMAND = re.compile(
    r"^(?:\$ )?((?:cspm|python|make|pip|ros2|colcon|export|\.venv/bin/cspm) .*)$", re.M
)
COMMENT = re.compile(r"\s+#.*$")
# Tutorials are followed elsewhere, examples are files that are run, the command line is a list, and
# the example of a mapping is of a log of the reader (tests/cspm_ident/importing).
ELSEWHERE = {"tutorials", "examples", "command-line", "import-mapping"}

ROS, ROS_TESTS = "needs a ROS 2 graph", "tests/cspm_ros"
NOT_RUN: dict[str, str] = {
    # The front door builds an environment.
    "make run": "builds an environment and simulates 200 s twice; run at each release",
    "make test": "these tests themselves",
    ".venv/bin/cspm demo": "of the environment that `make run` builds; see how-to/demo",
    # A minute and more.
    "cspm run verification_mid": "a minute, for what is compared; tests/cspm_run/test_scenarios.py",
    "cspm compare today": "half a minute each; tests/cspm_ident/comparison",
    "cspm demo": "a minute; asks a person; tests/cspm/demo",
    "cspm run rig_": "18 specimens, minutes; tests/cspm_ident/rig",
    "cspm identify stiffness": "of those minutes; tests/cspm_ident/rig",
    "cspm identify damping": "of those minutes; tests/cspm_ident/rig",
    "cspm identify system": "minutes; tests/cspm_ident/system",
    "cspm run worst_case --duration 60 --out wide": "a minute; tests/cspm_ident/geometry",
    "cspm identify geometry": "needs that recording; tests/cspm_ident/geometry",
    "cspm diagnose today --held-out": "a minute; tests/cspm/cli/test_diagnose.py",
    "cspm diagnose monday tuesday": "a minute; tests/cspm/cli/test_diagnose.py",
    "cspm migrate my_rig": "a file of the reader; tests/cspm_run/test_versions.py",
    "cspm merge my_rig.yaml": "of a verdict of the reader; tests/cspm_ident/test_merged_testbed.py",
    "cspm bundle": "of a verdict of the reader; tests/cspm/cli/test_bundle.py",
    "cspm run worst_case --testbed verdict": "needs that verdict; tests/project/test_tutorials.py",
    "cspm campaign": "minutes, or several computers; tests/cspm/campaign",
    "cspm analyze workspace": "a minute; tests/cspm_control/analysis",
    "python -m bench": "minutes to hours; tests/bench runs a small case of each",
    # A server, a graph, or drives.
    "cspm run calm --view": "serves until it is ended; tests/cspm/view",
    "cspm view recordings/": "serves until it is ended; tests/cspm/view",
    "cspm view today --diagnosis": "serves until it is ended; tests/cspm/view",
    "cspm view measured simulated": "serves until it is ended; tests/cspm/view",
    "cspm replay": f"{ROS}; {ROS_TESTS}/replay",
    "cspm run calm --mode graph": f"{ROS}; {ROS_TESTS}/scene, {ROS_TESTS}/runtime",
    "cspm node": f"{ROS}; {ROS_TESTS}/runtime",
    "cspm inject": f"{ROS}; {ROS_TESTS}/inject",
    "cspm check-drivers": f"{ROS}; {ROS_TESTS}/check_drivers",
    "cspm run examples/clamped_bar.yaml": f"{ROS}; {ROS_TESTS}/runtime/test_external_plant.py",
    "python examples/driver.py": f"{ROS}; {ROS_TESTS}/runtime/test_external_plant.py",
    "python examples/own_stage.py": f"{ROS}; {ROS_TESTS}/external/test_own_nodes.py",
    "python examples/ros_reference.py": f"{ROS}; {ROS_TESTS}/external/test_own_nodes.py",
    "cspm run rest --mode processes": f"{ROS}; {ROS_TESTS}/external/test_own_nodes.py",
    "ros2 ": f"{ROS}; {ROS_TESTS}/runtime/test_ros_install.py",
    "colcon build": "tests/project/test_colcon.py",
    # A network, or files of the reader.
    "export ROS_": f"of several computers; {ROS_TESTS}/runtime/test_network_namespaces.py",
    "pip install": "needs a network; tests/project/test_wheel.py",
    "pip wheel": "needs a network; tests/project/test_wheel.py",
    "cspm data get": "needs a network; tests/cspm/open_data",
    "cspm info recordings/my_bag": "a bag of the reader; tests/cspm_ident/importing",
    "cspm import log.": "logs of the reader; tests/cspm_ident/importing/test_actuator_logs.py",
    "cspm identify winch swing": "a log of the reader; tests/cspm_ident/winch",
    "cspm diagnose swing": "a log of the reader; tests/cspm/cli/test_diagnose.py",
    "cspm fmu": "needs an extra; tests/cspm_sim/fmu",
    "cspm run calm --plant crane.fmu": "needs an extra; tests/cspm_sim/fmu",
    "cspm run emps --plant names.yaml": "a unit of the reader; tests/cspm_sim/fmu",
    "cspm mjcf fitted": "a fit of the reader; tests/cspm_model/scene/test_mujoco_joints.py",
    "cspm import my_bag": "a bag of the reader; tests/cspm_ident/importing",
}


class Recipe(NamedTuple):
    """What a page assumes: a script that makes it, and what ends otherwise than with 0."""

    before: str = ""
    ends: dict[str, int] = {}


OILY = f"""
mkdir my_effects
cp {ROOT}/examples/effects/winch_churning.py my_effects/
cp {ROOT}/scenarios/testbeds/one_winch.yaml one_winch.yaml
cp one_winch.yaml oily.yaml
cat >> oily.yaml <<'END'
effects:
  - effect: winch_churning
    elements: [surge]
    parameters: {{coefficient: 0.01}}
END
"""
RECIPES = {
    "docs/how-to/add-an-effect.md": Recipe(OILY),
    "docs/how-to/export.md": Recipe("cspm run rest --duration 0.1 --out today"),
    "docs/how-to/view.md": Recipe("cspm run calm --duration 3 --out today"),
    "docs/how-to/write-a-testbed-file.md": Recipe(
        ends={"cspm run hang.yaml --set testbed.cables.left.drum_radius=-1 --out wrong": 2}
    ),
}


class Step(NamedTuple):
    """A file that a page has its reader write, or a command."""

    file: str
    text: str


def steps_of(text: str) -> list[Step]:
    """What a page asks its reader to do, in order."""
    found = []
    for kind, note, language, body in BLOCK.findall(text):
        if kind == "file":
            found.append(Step(note, body))
        elif not language:
            joined = body.replace("\\\n", " ")
            found += [Step("", COMMENT.sub("", each)) for each in COMMAND.findall(joined)]
    return found


def reason(command: str) -> str | None:
    """Why a command is not run; None if it is."""
    return next((why for start, why in NOT_RUN.items() if command.startswith(start)), None)


def pages() -> list[Path]:
    every = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
    return [p for p in every if not {p.stem, p.parent.name} & ELSEWHERE]


def run_of(text: str) -> list[Step]:
    return [step for step in steps_of(text) if step.file or reason(step.text) is None]


RUN = [
    page
    for page in pages()
    if any(not step.file for step in run_of(page.read_text(encoding="utf-8")))
]


def environment() -> dict[str, str]:
    """Where `cspm` is that of this environment, and the packages are these."""
    known = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return {**os.environ, "PATH": path, "PYTHONPATH": known}


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("page", RUN, ids=lambda page: page.stem)
def test_commands_of_a_page_run_as_printed(page: Path, tmp_path: Path) -> None:
    recipe = RECIPES.get(page.relative_to(ROOT).as_posix(), Recipe())
    known = environment()
    steps = [Step("", recipe.before), *run_of(page.read_text(encoding="utf-8"))]
    for step in steps:
        if step.file:
            (tmp_path / step.file).write_text(step.text, encoding="utf-8")
            continue
        if step.text.startswith("export "):
            name, _, value = step.text.removeprefix("export ").partition("=")
            known[name] = value
            continue
        found = subprocess.run(
            ["bash", "-ec", step.text],
            cwd=tmp_path,
            env=known,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )
        output = f"{step.text}\n{found.stdout}\n{found.stderr}"
        assert found.returncode == recipe.ends.get(step.text, 0), output
        assert "Traceback" not in found.stderr, output


def test_every_exception_is_of_a_command_that_a_page_prints() -> None:
    printed = [step.text for page in pages() for step in steps_of(page.read_text(encoding="utf-8"))]
    unused = [each for each in NOT_RUN if not any(text.startswith(each) for text in printed)]
    assert unused == []


def test_the_readme_has_the_two_commands_of_the_makefile_with_their_durations() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    section = text.split("## Two commands\n")[1].split("\n## ")[0]
    first, *later = BLOCK.findall(section)
    found = [line.partition("#") for line in first[3].splitlines()]
    assert [command.strip() for command, _, _ in found] == ["make run", "make test"]
    assert all(re.match(r" \d+ minutes", said) for _, _, said in found)
    assert [body.strip() for *_, body in later] == [".venv/bin/cspm demo"]


def test_tests_that_stand_for_a_command_exist() -> None:
    named = [path for why in NOT_RUN.values() for path in re.findall(r"tests/[\w/.]+", why)]
    assert len(named) >= 20
    assert [path for path in named if not (ROOT / path.rstrip(".")).exists()] == []


def test_most_pages_of_how_to_are_run() -> None:
    """What is left out of the others is in `NOT_RUN`."""
    run = {page.stem for page in RUN if page.parent.name == "how-to"}
    assert {"add-an-effect", "diagnose", "identify-a-winch", "import-a-table", "view"} <= run


def test_the_check_reads_commands_as_a_shell_does() -> None:
    text = """<!-- file: a.csv -->
```
1
```

```
export A=b
$ cspm run calm --out a   # recorded
cspm demo --seed \\
  1
what it prints
```

```python
cspm run
```
"""
    assert steps_of(text) == [
        Step("a.csv", "1\n"),
        Step("", "export A=b"),
        Step("", "cspm run calm --out a"),
        Step("", "cspm demo --seed    1"),
    ]
    assert reason("cspm demo --seed 1") is not None
    assert reason("cspm analyze linear") is None
