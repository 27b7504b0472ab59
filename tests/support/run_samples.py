"""Bundles of the library's scenarios, and short runs of them."""

from functools import cache
from pathlib import Path

import numpy as np

from cspm_msgs_py.recording import Recording
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import load_testbed
from cspm_run.assembly import resolve
from cspm_run.bundle import make_bundle
from cspm_run.recorded_run import run

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"
THESIS_CABLES = ("hoist_1", "hoist_2", "surge_1", "surge_2", "sway_1", "sway_2", "sway_3", "sway_4")


def bundle_of(path, *overrides):
    """Return what `cspm run` runs for a scenario's name or file and `--set` overrides."""
    return _bundle(path, overrides) if isinstance(path, Path) else _of_the_library(path, overrides)


@cache
def _of_the_library(name, overrides):
    return _bundle(SCENARIOS / f"{name}.yaml", overrides)


def _bundle(path, overrides):
    scenario = load_scenario(path, overrides)
    testbed = load_testbed(path.parent / scenario.testbed)
    return make_bundle(resolve(scenario, testbed.testbed), testbed, path.parent)


def recorded(folder):
    """Return the rows of every topic of a recording that carries rows, and nothing else."""
    with Recording(folder) as recording:
        names = [name for name in recording.topics if name != "/diagnostics"]
        return recording.rows_of(names)


def run_to(folder, path, *overrides, **arguments):
    """Run and record; return the result and all rows."""
    result = run(bundle_of(path, *overrides), folder, **arguments)
    return result, recorded(folder)


def stamps(rate, duration):
    """Return the stamps of a rate [Hz] over a duration [s], in ns."""
    count = round(rate * duration)
    return np.arange(count) * (1_000_000_000 // rate)
