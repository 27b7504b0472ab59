"""The two plants share none of their equations, held by reading the source."""

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def imported(text):
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield (node.module or "").split(".")[0] if node.level == 0 else "."


ALLOWED = {"__future__", "collections", "math", "typing", "xml"} | {
    "cspm_msgs_py",
    "cspm_mujoco",
    "mujoco",
    "numba",
    "numpy",
    "scipy",
}


def test_it_shares_no_code_with_the_plant():
    sources = sorted((ROOT / "cspm_mujoco").rglob("*.py"))
    assert len(sources) >= 5
    for path in sources:
        text = path.read_text(encoding="utf-8")
        assert set(imported(text)) <= ALLOWED, path.name
        # Nor by a name at run time, or as a file.
        assert "cspm_sim" not in text.replace("`cspm_sim", ""), path.name
    for path in (ROOT / "cspm_sim").rglob("*.py"):
        assert "cspm_mujoco" not in set(imported(path.read_text(encoding="utf-8"))), path.name


def test_the_check_sees_a_shared_import():
    for text in (
        "import cspm_sim.kernels",
        "def f():\n    from cspm_sim.stiffness import law_table",
        "from . import x",
        "import importlib",
    ):
        assert not set(imported(text)) <= ALLOWED
