"""The two plants share none of their equations, held by reading the source."""

from pathlib import Path

from imported_modules import imported

ROOT = Path(__file__).resolve().parents[3]


ALLOWED = {"__future__", "collections", "math", "typing", "xml"} | {
    "cspm_msgs_py",
    "cspm_sim.mujoco",
    "mujoco",
    "numba",
    "numpy",
    "scipy",
}


def test_it_shares_no_code_with_the_plant():
    sources = sorted((ROOT / "cspm_sim" / "mujoco").rglob("*.py"))
    assert len(sources) >= 5
    for path in sources:
        text = path.read_text(encoding="utf-8")
        assert set(imported(text)) <= ALLOWED, path.name
        # Nor by a name at run time, or as a file.
        own = (
            text.replace("cspm_sim.mujoco", "").replace("`cspm_sim", "").replace("`cspm_model", "")
        )
        assert not any(name in own for name in ("cspm_sim", "cspm_model")), path.name
    others = [path for path in (ROOT / "cspm_sim").rglob("*.py") if path not in sources]
    for path in (*others, *(ROOT / "cspm_model").rglob("*.py")):
        assert "cspm_sim.mujoco" not in set(imported(path.read_text(encoding="utf-8"))), path.name


def test_the_check_sees_a_shared_import():
    for text in (
        "import cspm_sim.kernels",
        "def f():\n    from cspm_model.stiffness import law_table",
        "from . import x",
        "import importlib",
    ):
        assert not set(imported(text)) <= ALLOWED
