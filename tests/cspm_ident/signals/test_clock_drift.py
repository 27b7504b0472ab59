"""Clocks of motion capture that run away from those of drives and load cells."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from machines import THESIS
from run_samples import bundle_of

from cspm_ident.comparison.compare import compare
from cspm_ident.signals.clock_drift import ClockDrift, find_drifts, on_one_clock, without_drifts
from cspm_ident.signals.measurement import Measurement, read_measurement
from cspm_ident.signals.samples import Samples
from cspm_ident.signals.timeline import Timeline
from cspm_msgs_py.testbed import load_testbed
from cspm_run.recorded_run import run

BAR, FRAME = "/bar/pose", "/winch_frame/pose"


def drifting(measurement, bar, frame, late=0.0):
    def stamped(samples, rate):
        return Samples(samples.times * (1.0 + rate) + late, samples.values)

    return replace(
        measurement,
        bar_pose=stamped(measurement.bar_pose, bar),
        frame_pose=stamped(measurement.frame_pose, frame),
    )


@pytest.fixture(scope="module")
def sea(tmp_path_factory):
    """A recording of the other plant, which shares no line with what looks for the drift."""
    place = tmp_path_factory.mktemp("drift") / "calm_broadband"
    bundle = replace(bundle_of("calm_broadband", "duration=24"), plant="mujoco")
    assert not run(bundle, place).failure
    return read_measurement(place)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("bar", "frame", "late"),
    [(0.0, 0.0, 0.0), (4e-4, 0.0, 0.0), (0.0, -4e-4, 0.008), (3e-4, 1e-3, 0.0), (0.0, 0.0, 0.01)],
)
def test_drifts_are_found_beside_each_other_and_beside_delays(sea, bar, frame, late):
    moved = drifting(sea, bar, frame, late)
    found = {drift.topic: drift for drift in find_drifts(Timeline(moved), moved.machine)}
    for topic, rate in ((BAR, bar), (FRAME, frame)):
        assert found[topic].rate == pytest.approx(rate, abs=4e-5)
        assert found[topic].interval[0] <= rate <= found[topic].interval[1]
        assert found[topic].matters == (rate != 0.0)


@pytest.mark.slow
def test_a_comparison_says_that_a_clock_drifts_and_is_not_misled_by_it(sea):
    healthy = compare(sea)
    assert healthy.drifts == []
    found = compare(drifting(sea, 4e-4, 0.0))
    (drift,) = found.drifts
    assert drift.topic == BAR
    assert found.clocks[0].startswith("/bar/pose: clock drifts by ")
    assert found.clocks[0].endswith("; taken out")
    assert found.data()["clock_drifts"] == [drift.data()]
    # Half of 24 s of it would be 4.8 ms.
    assert {delay.topic: delay.matters for delay in found.delays} == {BAR: False, FRAME: False}
    misled = compare(drifting(sea, 4e-4, 0.0), delays={BAR: 0.0048})
    rms = [
        np.mean([c.rms for c in each.channels if c.block == "cable"])
        for each in (healthy, found, misled)
    ]
    assert rms[1] < 1.05 * rms[0] < rms[2]


@pytest.mark.slow
def test_where_winches_stand_still_no_drift_is_reported(tmp_path):
    bundle = bundle_of("verification_mid", "duration=14")
    assert not run(bundle, tmp_path / "locked").failure
    locked = read_measurement(tmp_path / "locked")
    assert find_drifts(Timeline(locked), locked.machine) == []


def test_a_drift_matters_where_it_is_sure_and_more_than_smoothing_makes_up():
    sure = ClockDrift(BAR, 2e-4, (1.5e-4, 2.5e-4), 20.0)
    assert sure.matters
    assert sure.text == "clock drifts by 200.0 ppm (95 %: 150.0 to 250.0 ppm)"
    assert sure.data() == {"topic": BAR, "rate": 2e-4, "ci95": [1.5e-4, 2.5e-4]}
    assert replace(sure, rate=-2e-4, interval=(-2.5e-4, -1.5e-4)).matters
    assert not replace(sure, interval=(-1e-5, 4.1e-4)).matters
    assert not replace(sure, apart=10.0).matters


def test_stamps_without_a_drift_are_those_that_were(sea_samples):
    rate = 5e-4
    moved = drifting(sea_samples, rate, 0.0)
    back = without_drifts(moved, [ClockDrift(BAR, rate, (4e-4, 6e-4), 20.0)])
    np.testing.assert_allclose(back.bar_pose.times, sea_samples.bar_pose.times, atol=1e-12)
    assert back.frame_pose is moved.frame_pose


@pytest.fixture
def sea_samples():
    samples = Samples(0.01 * np.arange(500), np.zeros((500, 6)))
    file = load_testbed(THESIS)
    return Measurement(Path("nowhere"), "ab", file, frame_pose=samples, bar_pose=samples)


def test_a_recording_without_load_cells_shows_no_drift(sea_samples):
    line = Timeline(sea_samples)
    same, drifts = on_one_clock(line, sea_samples.machine)
    assert same is line
    assert drifts == []
