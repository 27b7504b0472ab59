"""Bundles of the library's scenarios, and short runs of them."""

from functools import cache
from pathlib import Path

import numpy as np

from cspm_msgs_py.message import carries_row
from cspm_msgs_py.recording import Recording
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import load_testbed
from cspm_run.assembly import resolve
from cspm_run.bundle import make_bundle
from cspm_run.library import find_scenario
from cspm_run.recorded_run import run

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"
# The frame moves in surge alone: a bar that swings in one plane.
PLUCKED_IN_SURGE = (
    "winch_frame.motion.moves=["
    "{at: 2.0, duration: 2.0, by: [0.06, 0, 0, 0, 0, 0]},"
    " {at: 8.0, duration: 2.0, by: [-0.12, 0, 0, 0, 0, 0]},"
    " {at: 14.0, duration: 1.0, by: [0.06, 0, 0, 0, 0, 0]},"
    " {at: 20.0, duration: 1.0, by: [0.04, 0, 0, 0, 0, 0]},"
    " {at: 26.0, duration: 0.5, by: [-0.02, 0, 0, 0, 0, 0]},"
    " {at: 32.0, duration: 0.5, by: [-0.02, 0, 0, 0, 0, 0]}]"
)
THESIS_CABLES = ("hoist_1", "hoist_2", "surge_1", "surge_2", "sway_1", "sway_2", "sway_3", "sway_4")


def bundle_of(path, *overrides):
    """Return what `cspm run` runs for a scenario's name or file and `--set` overrides."""
    return _bundle(path, overrides) if isinstance(path, Path) else _of_the_library(path, overrides)


@cache
def _of_the_library(name, overrides):
    return _bundle(find_scenario(name), overrides)


def _bundle(path, overrides):
    scenario = load_scenario(path, overrides)
    testbed = load_testbed(path.parent / scenario.testbed)
    return make_bundle(resolve(scenario, testbed.testbed), testbed, path.parent)


def recorded(folder):
    """Return the rows of every topic of a recording that carries rows, and nothing else."""
    with Recording(folder) as recording:
        names = [name for name, info in recording.topics.items() if carries_row(info.ros_type)]
        return recording.rows_of(names)


def run_to(folder, path, *overrides, **arguments):
    """Run and record; return the result and all rows."""
    result = run(bundle_of(path, *overrides), folder, **arguments)
    return result, recorded(folder)


def stamps(rate, duration):
    """Return the stamps of a rate [Hz] over a duration [s], in ns."""
    count = round(rate * duration)
    return np.arange(count) * (1_000_000_000 // rate)
