"""Tutorials are followed literally: every step, in order, in an empty folder."""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[2]
# The one on robots is followed where `cspm new` is tested.
TUTORIALS = [
    ROOT / "docs" / "tutorials" / f"{name}.md"
    for name in ("first-run", "first-diagnosis", "your-controller")
]
MARKED = re.compile(
    r"<!-- (step|file|not tested)(?:: ([^>]+?))? -->\n```(\w*)\n(.*?)```", re.DOTALL
)
# A whole line of `cspm resim`.
QUOTED = re.compile(r"`(identical: [^`]+)`")
BLOCK = re.compile(r"^```\w*\n(?:.*\n)*?```$", re.MULTILINE)


class Step(NamedTuple):
    """A block of a tutorial: `kind` is step, file or not tested."""

    kind: str
    note: str
    language: str
    text: str


def steps_of(page: Path) -> list[Step]:
    return [Step(*found) for found in MARKED.findall(page.read_text(encoding="utf-8"))]


def follow(step: Step, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a step as a reader would, with the `cspm` and `python` of this environment."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    known = os.pathsep.join([str(folder), str(ROOT), os.environ.get("PYTHONPATH", "")])
    words = [sys.executable, "-c"] if step.language == "python" else ["bash", "-ec"]
    return subprocess.run(
        [*words, step.text],
        cwd=folder,
        env={**os.environ, "PATH": path, "PYTHONPATH": known},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_every_block_of_a_tutorial_says_what_it_is(page: Path) -> None:
    steps = steps_of(page)
    assert len(BLOCK.findall(page.read_text(encoding="utf-8"))) == len(steps)
    assert sum(step.kind == "step" for step in steps) >= 3


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_a_tutorial_can_be_followed_literally(page: Path, tmp_path: Path) -> None:
    printed = ""
    for step in steps_of(page):
        if step.kind == "file":
            (tmp_path / step.note).write_text(step.text, encoding="utf-8")
        elif step.kind == "step":
            wanted = int(step.note.removeprefix("exit ") or 0) if step.note else 0
            found = follow(step, tmp_path)
            assert found.returncode == wanted, f"{step.text}\n{found.stdout}\n{found.stderr}"
            assert "Traceback" not in found.stderr
            printed += found.stdout
    for line in QUOTED.findall(page.read_text(encoding="utf-8")):
        assert line in printed
