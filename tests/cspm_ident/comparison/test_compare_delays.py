"""Delays of motion capture put into recordings and found again."""

from dataclasses import replace

import numpy as np
import pytest
from run_samples import bundle_of

from cspm_ident.signals.delays import Delay, find_delays
from cspm_ident.signals.measurement import read_measurement
from cspm_ident.signals.timeline import Timeline
from cspm_run.recorded_run import run


def recorded(folder, scenario, *overrides, plant="mujoco"):
    bundle = replace(bundle_of(scenario, *overrides), plant=plant)
    assert not run(bundle, folder).failure
    return read_measurement(folder)


def delayed(measurement, bar, frame):
    return replace(
        measurement,
        bar_pose=measurement.bar_pose.shifted(bar),
        frame_pose=measurement.frame_pose.shifted(frame),
    )


@pytest.fixture(scope="module")
def seas(tmp_path_factory):
    """Recordings of the other plant, which shares no line with what looks for the delays."""
    place = tmp_path_factory.mktemp("delays")
    return {
        name: recorded(place / name, name, "duration=16")
        for name in ("calm_broadband", "worst_case_steep")
    }


@pytest.mark.slow
@pytest.mark.parametrize("sea", ["calm_broadband", "worst_case_steep"])
@pytest.mark.parametrize(
    ("bar", "frame"), [(0.0, 0.0), (0.002, 0.0), (0.0, 0.005), (0.010, 0.020), (0.020, 0.010)]
)
def test_delays_are_found_from_any_start(seas, sea, bar, frame):
    moved = delayed(seas[sea], bar, frame)
    found = {d.topic: d for d in find_delays(Timeline(moved), moved.machine)}
    for topic, late in (("/bar/pose", bar), ("/winch_frame/pose", frame)):
        assert found[topic].known
        assert found[topic].seconds == pytest.approx(late, abs=1e-3)
        assert found[topic].interval[0] <= late <= found[topic].interval[1]
        assert found[topic].matters == (late > 0.0)


@pytest.mark.slow
def test_cables_that_are_nearly_slack_show_no_delay(tmp_path):
    """At 0.2 N a load cell's noise is half a millimetre, which passed for 6 ms of the frame."""
    loose = recorded(tmp_path / "loose", "factor_six_mid", "duration=24")
    assert loose.tension.values.min() < 0.3
    for found in find_delays(Timeline(loose), loose.machine):
        assert found.known
        assert found.interval[0] <= 0.0 <= found.interval[1]


@pytest.mark.slow
def test_a_machine_at_rest_says_that_it_is_too_slow(tmp_path):
    still = recorded(tmp_path / "rest", "rest", "duration=6", plant="sim")
    for found in find_delays(Timeline(still), still.machine):
        assert not found.known
        assert not found.matters
        assert found.text.startswith("delay not found: this recording moves too slowly for it")
        assert found.data()["delay_s"] is None


def test_an_interval_as_wide_as_the_delay_is_none():
    reported = Delay("/bar/pose", 0.004, (0.001, 0.007), (0.0, 60.0))
    assert reported.matters
    assert reported.text == "4.00 ms late (95 %: 1.00 to 7.00 ms; from 0 to 60 s)"
    wide = replace(reported, interval=(-0.004, 0.012))
    assert not wide.known
    assert wide.data() == {
        "topic": "/bar/pose",
        "delay_s": None,
        "ci95_s": [-0.004, 0.012],
        "window_s": [0.0, 60.0],
    }
    endless = replace(reported, interval=(-np.inf, np.inf))
    assert endless.data()["ci95_s"] is None
