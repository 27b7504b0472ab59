"""The wheel: what is in it, and that it serves in an environment without the checkout."""

import importlib.metadata
import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from email import message_from_bytes
from importlib.metadata import distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = {
    "cspm",
    "cspm_msgs_py",
    "cspm_model",
    "cspm_checks",
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
    done = finished(command, folder)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def finished(command, folder):
    strange = {"PYTHONPATH", "VIRTUAL_ENV", "NUMBA_CACHE_DIR"}
    variables = {name: value for name, value in os.environ.items() if name not in strange}
    return subprocess.run(
        [str(part) for part in command],
        cwd=folder,
        env=variables | {"MPLBACKEND": "agg", "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )


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
    """An environment with the wheel and what a base installation brings, and nothing else."""
    prefix = tmp_path_factory.mktemp("environment")
    run([sys.executable, "-m", "venv", prefix], prefix)
    run([prefix / "bin" / "pip", "install", "--no-deps", "--no-index", wheel], prefix)
    (packages,) = prefix.glob("lib/python*/site-packages")
    for each in needed_by(wheel):
        # Not what lies outside, such as programs.
        for top in {file.parts[0] for file in each.files} - {"..", "__pycache__"}:
            if not (packages / top).exists():
                (packages / top).symlink_to(Path(each.locate_file(top)).resolve())
    return prefix


def needed_by(wheel):
    """The distributions that pip would install with a wheel, as this Python has them."""
    archive = zipfile.ZipFile(wheel)
    metadata = message_from_bytes(archive.read(f"cspm-{version()}.dist-info/METADATA"))
    waiting, found = [Requirement(each) for each in metadata.get_all("Requires-Dist")], {}
    while waiting:
        each = waiting.pop()
        if each.marker is None or each.marker.evaluate({"extra": ""}):
            found[each.name] = known = distribution(each.name)
            new = map(Requirement, known.requires or ())
            waiting += [one for one in new if one.name not in found]
    return found.values()


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


def test_a_base_installation_runs_a_scenario_by_name_and_diagnoses_it(environment, tmp_path):
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


def test_a_base_installation_imports_a_table_and_shows_what_it_made(environment, tmp_path):
    cspm = environment / "bin" / "cspm"
    (tmp_path / "lab.csv").write_text(
        "t;q;v;m\n" + "".join(f"{k};{2 * k};2000;0.4\n" for k in range(4))
    )
    (tmp_path / "lab.yaml").write_text(
        "name: lab\ncsv: {delimiter: ';'}\nclocks: {drive: {column: t, unit: ms}}\n"
        "channels: {/winches/state: {position/surge: {column: q, unit: deg},"
        " velocity/surge: {column: v, unit: deg/s}, effort/surge: {column: m, unit: N·m}}}\n"
    )
    words = ["import", "lab.csv", "--mapping", "lab.yaml", "--testbed", "one_winch", "--out", "lab"]
    assert "recording lab: 4 messages" in run([cspm, *words], tmp_path)
    run([cspm, "view", "lab", "--html", "lab.html"], tmp_path)
    assert (tmp_path / "lab.html").stat().st_size > 10_000
    assert run([cspm, "view", "--help"], tmp_path).startswith("Usage: cspm view")


def test_a_base_installation_knows_what_it_lacks(environment, tmp_path):
    run([environment / "bin" / "cspm", "doctor", "--json", "found.json"], tmp_path)
    found = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))["parts"]
    parts = {each["name"]: each for each in found}
    assert parts["python"]["found"].endswith(f" in {environment}")
    assert parts["cspm"]["there"]
    for extra in ("files", "tables", "campaign", "mujoco", "fmu"):
        assert parts[f"extra {extra}"]["remedy"] == f"`pip install 'cspm[{extra}]'`"
    assert parts["extra view"]["there"]
    assert parts["ros"]["remedy"].startswith("`pip install 'cspm[ros]'`")
    assert "middleware" not in parts


@pytest.mark.parametrize(
    ("words", "extra"),
    [
        ("campaign sweep.yaml", "campaign"),
        ("run calm --mode graph", "ros"),
        ("run calm --plant mujoco --no-record", "mujoco"),
        ("fmu calm", "fmu"),
        ("import lab.xlsx --mapping emps --testbed emps --dry-run", "files"),
    ],
)
def test_without_an_extra_a_command_ends_with_the_line_that_installs_it(
    environment, tmp_path, words, extra
):
    (tmp_path / "sweep.yaml").write_text("scenario: rest\n", encoding="utf-8")
    (tmp_path / "lab.xlsx").write_bytes(b"PK\x03\x04" + bytes(600))
    done = finished([environment / "bin" / "cspm", *words.split()], tmp_path)
    assert done.returncode == 2, done.stderr
    *_, line = done.stderr.splitlines()
    assert "Traceback" not in done.stderr
    assert re.match(r"cspm \w+: .* is not installed, allowed: ", line)
    assert f"`pip install 'cspm[{extra}]'" in line


def test_without_an_environment_pip_puts_it_into_a_folder_of_its_own(wheel, environment, tmp_path):
    """As `pip install --target` does for a program that carries what it needs."""
    options = ["--no-deps", "--no-index", "--target", tmp_path / "carried"]
    run([environment / "bin" / "pip", "install", *options, wheel], tmp_path)
    script = "import sys; sys.path.insert(0, 'carried'); from cspm_run.library import *;" + (
        "print(find_scenario('calm'), find_testbed('thesis'), find_mapping('emps'), sep='\\n')"
    )
    found = run([environment / "bin" / "python", "-c", script], tmp_path).splitlines()
    assert len(found) == 3
    assert all(Path(path).is_relative_to(tmp_path / "carried") for path in found)


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_installation_runs_the_example(environment, name, tmp_path):
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    run([environment / "bin" / "python", Path("examples") / f"{name}.py"], tmp_path)
