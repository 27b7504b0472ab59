"""The wheel: what is in it, and that it serves in an environment without the checkout."""

import importlib.metadata
import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = {
    "cspm",
    "cspm_msgs_py",
    "cspm_model",
    "cspm_sim",
    "cspm_control",
    "cspm_run",
    "cspm_ident",
    "cspm_ros",
}
VERSION = re.compile(r'^version = "(.+)"$', re.MULTILINE)
# A run, parts of one's own in it, and one's own files beside it; `tests/examples` runs them all.
EXAMPLES = ("first_run", "own_controller", "own_effect")

pytestmark = pytest.mark.slow


def version():
    return VERSION.search((ROOT / "pyproject.toml").read_text(encoding="utf-8"))[1]


def run(command, folder):
    """Run a program that knows nothing of this checkout; it must succeed. Return what it prints."""
    strange = {"PYTHONPATH", "VIRTUAL_ENV", "NUMBA_CACHE_DIR"}
    variables = {name: value for name, value in os.environ.items() if name not in strange}
    done = subprocess.run(
        [str(part) for part in command],
        cwd=folder,
        env=variables | {"MPLBACKEND": "agg", "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(source, tmp_path_factory):
    """The wheel that `python -m build` makes, by way of a source distribution."""
    pytest.importorskip("build", reason="build is not installed")
    setuptools = importlib.metadata.version("setuptools")
    if int(setuptools.split(".")[0]) < 70:
        pytest.skip(f"setuptools {setuptools} is older than 70, which needs no other package")
    out = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "build", "--no-isolation", "--outdir", out]
    run([*build, source / "src" / "cspm"], out)
    (path,) = out.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def environment(wheel, tmp_path_factory):
    """An environment with the wheel and what this Python has installed, but for this checkout.

    A line in a `.pth` file adds a folder, not the editable installations in it.
    """
    prefix = tmp_path_factory.mktemp("environment")
    run([sys.executable, "-m", "venv", prefix], prefix)
    run([prefix / "bin" / "pip", "install", "--no-deps", "--no-index", wheel], prefix)
    (packages,) = prefix.glob("lib/python*/site-packages")
    present = [path for path in sys.path if path.endswith(("site-packages", "dist-packages"))]
    (packages / "dependencies.pth").write_text("\n".join(present))
    return prefix


def test_the_wheel_has_the_packages_their_types_and_their_data(wheel):
    assert wheel.name == f"cspm-{version()}-py3-none-any.whl"
    names = zipfile.ZipFile(wheel).namelist()
    top = {name.split("/")[0] for name in names}
    assert top == PACKAGES | {f"cspm-{version()}.dist-info", f"cspm-{version()}.data"}
    assert {f"{package}/py.typed" for package in PACKAGES} <= set(names)
    modules = {
        path.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for path in (ROOT / package).rglob("*.py")
    }
    assert modules == {
        name for name in names if name.endswith(".py") and name.split("/")[0] in PACKAGES
    }
    assert "cspm_msgs_py/ros/fastdds.xml" in names
    share = f"cspm-{version()}.data/data/share/cspm/"
    for path in (ROOT / "scenarios").rglob("*.yaml"):
        assert f"{share}{path.relative_to(ROOT).as_posix()}" in names
    assert f"{share}launch/scenario.launch.py" in names


def test_the_wheel_has_neither_benchmark_nor_tests_nor_what_was_compiled(wheel):
    for name in zipfile.ZipFile(wheel).namelist():
        assert not {"bench", "tests", "docs", "__pycache__"} & set(name.split("/")), name
        assert ".data/scripts/" not in name


def test_only_the_command_lands_on_the_path(wheel, environment):
    archive = zipfile.ZipFile(wheel)
    points = archive.read(f"cspm-{version()}.dist-info/entry_points.txt").decode()
    assert points.split() == ["[console_scripts]", "cspm", "=", "cspm.cli.main:main"]
    usual = re.compile(r"(python|pip)[\d.]*|activate.*|Activate.ps1")
    programs = {path.name for path in (environment / "bin").iterdir()}
    assert {name for name in programs if not usual.fullmatch(name)} == {"cspm"}


def test_an_installation_runs_a_scenario_by_name_and_diagnoses_the_recording(environment, tmp_path):
    cspm = environment / "bin" / "cspm"
    script = "import cspm; print(cspm.__file__, cspm.load_testbed('thesis').file.source, sep='\\n')"
    printed = run([environment / "bin" / "python", "-c", script], tmp_path).splitlines()
    assert all(Path(path).is_relative_to(environment) for path in printed)
    run([cspm, "run", "one_winch", "--duration", "12", "--out", "one"], tmp_path)
    summary = json.loads((tmp_path / "one" / "summary.json").read_text(encoding="utf-8"))
    assert (summary["scenario"], summary["duration_s"]) == ("one_winch", 12.0)
    run([cspm, "diagnose", "one", "--out", "verdict"], tmp_path)
    verdict = json.loads((tmp_path / "verdict" / "diagnosis.json").read_text(encoding="utf-8"))
    assert (verdict["schema"], verdict["verdict"]) == ("cspm.diagnosis/1", "consistent")
    assert (tmp_path / "verdict" / "diagnosis.html").is_file()


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_installation_runs_the_example(environment, name, tmp_path):
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    run([environment / "bin" / "python", Path("examples") / f"{name}.py"], tmp_path)
