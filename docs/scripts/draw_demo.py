"""The recorded terminal session of `cspm demo` in the README.

Run `python docs/scripts/draw_demo.py`: it runs the demonstration and draws what it
printed, without the lines of progress that a terminal shows as a bar.
"""

from __future__ import annotations

import io
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from rich.console import Console
from rich.text import Text

PICTURE = Path(__file__).resolve().parents[2] / "docs" / "assets" / "demo.svg"
COMMAND = ("cspm", "demo", "--seed", "3", "--effect", "winch_coulomb_friction", "--no-guess")
WIDTH = 96
# Rich names a font in the network, which no picture loads.
_FONT = re.compile(r"@font-face \{.*?\}\s*", re.S)
_PROGRESS = re.compile(r", \d+ s( left| so far)?$")
_STEP = re.compile(r"^\d  ")


def session() -> str:
    """Return what the demonstration prints."""
    program = Path(sys.executable).with_name(COMMAND[0])
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [program, *COMMAND[1:], "--out", "demo"],
            cwd=folder,
            capture_output=True,
            text=True,
            check=True,
        )
    return done.stdout


def drawn(text: str) -> str:
    """Return a terminal with the command and what it printed, as SVG."""
    console = Console(record=True, width=WIDTH, file=io.StringIO())
    console.print(Text(f"$ {' '.join(COMMAND)}", style="bold"))
    for line in text.splitlines():
        if _PROGRESS.search(line):
            continue
        console.print(Text(line, style="bold cyan" if _STEP.match(line) else ""))
    picture = console.export_svg(title="cspm demo", unique_id="demo")
    return _FONT.sub("", picture).replace("Fira Code", "Menlo, Consolas, DejaVu Sans Mono")


if __name__ == "__main__":
    PICTURE.write_text(drawn(session()), encoding="utf-8")
