"""What commands load: none waits for a large library that it does not need."""

import json
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

import cspm
import cspm.commands

CHILD = Path(__file__).with_name("loaded_child.py")
FITS = ("scipy.optimize", "scipy.stats", "scipy.signal")
# For pages, pictures and control theory alone, or of an extra.
APART = (
    *("plotly", "matplotlib", "control"),
    *("mujoco", "dask", "distributed", "pyarrow", "pandas", "rclpy"),
    *("fmpy", "pythonfmu"),
)
COMMANDS = {
    each.name.removeprefix("cspm.commands.")
    for each in pkgutil.walk_packages(cspm.commands.__path__, "cspm.commands.")
    if each.name.endswith("_command")
}
# Their work begins with fits, or with statistics and filters, which load `scipy.optimize` too.
FITTING = {
    *("analysis.analyze_sag_command", "analysis.plan_command", "import_command"),
    *("compare_command", "demo_command", "diagnose_command"),
    *("recordings.check_command", "recordings.demo_real_command"),
    *("identify_damping_command", "identify_geometry_command"),
    *("identify_stiffness_command", "identify_system_command", "identify_winch_command"),
}


def newly_loaded(steps, folder):
    """Return which of the watched modules each step loads, in a process that has loaded nothing."""
    done = subprocess.run(
        [sys.executable, CHILD, *FITS, *APART],
        input=json.dumps(steps),
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def loaded_by(modules):
    """Return the names of all modules that a process has which imports some."""
    code = f"import json, sys, {modules}; print(json.dumps([*sys.modules]))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(json.loads(done.stdout))


def test_package_and_command_line_load_next_to_nothing():
    loaded = loaded_by("cspm, cspm.cli.main")
    assert not loaded & {*FITS, *APART, "numpy", "numba", "scipy", "pydantic", "mcap", "rosbags"}


def test_a_node_begins_without_what_only_replays_and_recordings_need():
    loaded = loaded_by("cspm.cli.node_program")
    assert not loaded & {*FITS, *APART, "numba", "scipy", "cspm_ros.replay.player"}


def test_commands_that_fit_nothing_begin_without_fits_pages_and_extras(tmp_path):
    names = [f"cspm.commands.{each}" for each in sorted(COMMANDS - FITTING)]
    found = zip(names, newly_loaded(names, tmp_path), strict=True)
    assert {name: loaded for name, loaded in found if loaded} == {}


def test_commands_that_fit_begin_without_pages_and_extras(tmp_path):
    assert FITTING < COMMANDS
    names = [f"cspm.commands.{each}" for each in sorted(FITTING)]
    found = [set(loaded) for loaded in newly_loaded(names, tmp_path)]
    assert set().union(*found) == set(FITS)


@pytest.mark.compiled
def test_whole_commands_load_no_more_than_they_use(tmp_path):
    """A run begins at rest, which it solves for; its picture comes with the recording."""
    cspm.simulate("rest", duration=0.01).save(tmp_path / "bag")
    expected = {
        "doctor": [],
        "schema scenario": [],
        "urdf thesis": [],
        "diagnose --explain bar_mass": [],
        "info bag": [],
        "view bag --html bag.html": [],
        "run rest --duration 0.01 --no-record": ["scipy.optimize"],
        "run rest --duration 0.01 --out again": ["matplotlib"],
        "resim again": [],
    }
    found = newly_loaded([each.split() for each in expected], tmp_path)
    assert dict(zip(expected, found, strict=True)) == expected


def test_what_is_not_there_is_refused_before_anything_large_is_loaded(tmp_path):
    words = (
        *("diagnose", "compare", "identify winch", "identify system", "identify stiffness"),
        *("identify lengths", "export --out a.csv", "resim", "analyze workspace", "campaign"),
    )
    found = newly_loaded([{"refused": [*each.split(), "nowhere"]} for each in words], tmp_path)
    assert dict(zip(words, found, strict=True)) == {each: [] for each in words}
