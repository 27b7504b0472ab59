"""The page of examples, made of their files.

Run `python docs/scripts/examples_page.py` after a change in `examples/`.
"""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES, PAGE = ROOT / "examples", ROOT / "docs" / "reference" / "examples.md"
# In the order in which a newcomer needs them; `driver.py`, `own_stage.py` and `ros_reference.py`
# are of other pages, docs/how-to/bring-hardware.md and run-on-ros.md.
ORDER = (
    *("first_run", "find_friction", "own_controller", "own_reference", "own_effect"),
    *("compare_recordings", "identify_winch", "sweep_gain", "read_into_pandas"),
    *("linear_analysis", "workspace_of_another_robot", "state_space_controller", "own_node"),
)
_HEAD = """\
# Examples

Thirteen scripts to copy. Each is a file of [`examples/`](../../examples), runs as it stands, and
writes
into the folder in which it is started. `import cspm` is all that they need; what a function takes
and returns is in its docstring, `help(cspm.simulate)`. All numbers are in SI units and radians, z
points down.

This page is generated: `python docs/scripts/examples_page.py`.
"""


def page() -> str:
    """Return the page in Markdown."""
    parts = [_HEAD, *map(_section, ORDER)]
    parts.append(_file("The effect of `own_effect.py`", "effects/winch_churning.py", "python"))
    parts.append(_file("The robot of `workspace_of_another_robot.py`", "robots/tower.yaml", "yaml"))
    return "\n".join(parts)


def _section(name: str) -> str:
    text = (EXAMPLES / f"{name}.py").read_text(encoding="utf-8")
    title = (ast.get_docstring(ast.parse(text)) or name).rstrip(".")
    return _file(title, f"{name}.py", "python")


def _file(title: str, name: str, language: str) -> str:
    text = (EXAMPLES / name).read_text(encoding="utf-8")
    return f"## {title}\n\n[`examples/{name}`](../../examples/{name})\n\n```{language}\n{text}```\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
