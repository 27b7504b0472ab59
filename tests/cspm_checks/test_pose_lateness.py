"""Poses that are late against the winches that move the bar."""

import numpy as np
import pytest
from import_samples import imported, table
from run_samples import SCENARIOS

import cspm

TESTBED = SCENARIOS / "testbeds" / "suspended_four.yaml"
UNITS = {"surge": "x", "sway": "y", "heave": "z", "roll": "roll", "pitch": "pitch", "yaw": "yaw"}


@pytest.fixture(scope="module")
def run():
    return cspm.simulate("suspended_four", duration=20.0)


def told(run, folder, late=0.0, stretch=0.0, *, offset=0.0, still=False):
    """Import a table of winches and poses at 100 Hz, the camera's time in a column of its own."""
    every = slice(None, None, round(len(run.bar_pose.time) / 2000))
    time = run.bar_pose.time[every]
    columns = {"t": time, "camera": time * (1.0 + stretch) + late + 1.0}
    lines = [
        *("name: late", "clocks:", "  pc: {column: t, offset: 1.0}"),
        *(f"  camera: {{column: camera, offset: {offset}}}", "channels:", "  /winches/state:"),
    ]
    for name in run.winch_angle.columns:
        columns[name] = np.interp(time, run.winch_angle.time, run.winch_angle[name])
        lines.append(f"    position/{name}: {{column: {name}, unit: rad}}")
    lines.append("  /bar/pose:")
    for name, field in UNITS.items():
        values = run.bar_pose[name][every]
        columns[name] = np.repeat(values[:1], len(values)) if still else values
        unit = "m" if field in "xyz" else "rad"
        lines.append(f"    {field}: {{column: {name}, unit: {unit}, clock: camera}}")
    found = imported(table(folder / "lab.csv", columns), "\n".join(lines), TESTBED)
    late = [one for one in found.report.suspicions if one.kind == "late"]
    return late, found.report.notes


@pytest.mark.parametrize("late", [0.03, -0.03])
def test_late_and_early_poses_are_found_with_their_interval_and_repaired(run, tmp_path, late):
    (found,), _ = told(run, tmp_path, late)
    assert found.where == "/bar/pose"
    assert found.numbers["seconds"] == pytest.approx(late, abs=found.numbers["error"] + 1e-3)
    assert found.numbers["error"] < 2e-3
    assert ("late" if late > 0.0 else "early") + " against the winches" in found.text
    repaired, _ = told(run, tmp_path, late, offset=-found.numbers["seconds"])
    assert repaired == []


def test_a_drift_of_the_camera_is_found(run, tmp_path):
    (found,), _ = told(run, tmp_path, -0.03, stretch=3e-3)
    assert found.numbers["drift"] == pytest.approx(3e-3, abs=5e-4)


def test_poses_in_time_are_not_suspected(run, tmp_path):
    found, notes = told(run, tmp_path)
    assert found == []
    assert not any("cannot be said" in note for note in notes)


def test_where_nothing_moves_it_says_that_it_cannot_be_said(run, tmp_path):
    found, notes = told(run, tmp_path, 0.03, still=True)
    assert found == []
    assert (
        "whether poses are late against the winches cannot be said: too short, too little motion,"
        " or lengths that the test-bed's geometry does not explain" in notes
    )
