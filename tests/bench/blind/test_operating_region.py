"""Where findings say that something acts, right and wrong."""

import pytest

from bench.blind.scoring.operating_region import region_right

LATE = {"onset_s": 12.1, "onset_ci95_s": [11.8, 12.4]}


def reported(driver, low, high, **more):
    region = {"driver": driver, "low": low, "high": high, "share": 0.4, "held": 0.9}
    return {"onset_s": None, "onset_ci95_s": None, "region": region} | more


def curve(driver, *at):
    return {"onset_s": None, "region": {"driver": driver, "at": list(at)}}


def test_what_tells_nothing_is_neither_right_nor_wrong():
    nothing = {"onset_s": None, "onset_ci95_s": None, "region": {}}
    assert region_right("bristles", 0.0, nothing) is None
    assert region_right("bristles", 12.0, nothing) is None
    assert region_right("bristles", 0.0, {}) is None


@pytest.mark.parametrize(
    ("phenomenon", "driver", "right"),
    [
        ("internal friction", "tension [N]", True),
        ("internal friction", "angle [rad]", False),
        ("cogging", "angle [rad]", True),
        ("cogging", "tension [N]", False),
        ("drive zero", "tension [N]", False),
        ("encoder counts", "time [s]", False),
        ("warming cell", "time, in pitch [s]", True),
        ("air", "sway [m]", False),
    ],
)
def test_the_signal_has_to_be_one_by_which_it_changes(phenomenon, driver, right):
    assert region_right(phenomenon, 0.0, reported(driver, 3.0, 9.0)) is right


@pytest.mark.parametrize(
    ("phenomenon", "driver"),
    [
        ("grease", "speed [rad/s]"),
        ("air", "sway speed [m/s]"),
        ("damper", "rate of elongation [m/s]"),
    ],
)
def test_what_goes_by_a_motion_acts_in_both_directions(phenomenon, driver):
    assert region_right(phenomenon, 0.0, reported(driver, -3.0, 9.0)) is True
    assert region_right(phenomenon, 0.0, reported(driver, 3.0, 9.0)) is False
    assert region_right(phenomenon, 0.0, reported(driver, -9.0, -3.0)) is False


def test_a_beginning_is_a_region_of_time():
    late = {"region": {}} | LATE
    assert region_right("cell zero", 12.0, late) is True
    assert region_right("cell zero", 13.0, late) is False
    assert region_right("cell zero", 0.0, late) is False
    assert region_right("cell zero", 12.0, reported("time [s]", 12.0, 20.0)) is True
    assert region_right("cell zero", 12.0, reported("time [s]", 9.0, 20.0)) is False


def test_all_that_is_reported_has_to_be_right():
    assert region_right("bristles", 12.0, reported("speed [rad/s]", -1.0, 2.0, **LATE)) is True
    assert region_right("bristles", 12.0, reported("angle [rad]", -1.0, 2.0, **LATE)) is False
    assert region_right("bristles", 0.0, reported("speed [rad/s]", -1.0, 2.0, **LATE)) is False


def test_a_frequency_has_to_be_as_near_as_a_recording_resolves_it():
    assert region_right("vibration", 0.0, curve("frequency [Hz]", 2.698)) is True
    assert region_right("vibration", 0.0, curve("frequency [Hz]", 2.74)) is False
    assert region_right("vibration", 0.0, curve("time, in sway [s]", 0.0, 15.0, 30.0)) is False


def test_a_function_over_all_that_was_recorded_tells_its_signal_alone():
    assert region_right("loosening anchor", 0.0, curve("time [s]", 0.0, 15.0, 30.0)) is True
    assert region_right("loosening anchor", 0.0, reported("time [s]", 12.5, 30.0)) is True
    assert region_right("loosening anchor", 0.0, reported("time [s]", 3.0, 30.0)) is False
    assert region_right("eddy currents", 0.0, curve("speed [rad/s]", 1.0, 5.0, 9.0)) is True
    assert region_right("eddy currents", 0.0, {"region": {"driver": "speed [rad/s]"}}) is True
