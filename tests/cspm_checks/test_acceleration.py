"""Accelerations that a machine cannot have, from wrong units of length, angle or time."""

import numpy as np
import pytest
from run_samples import SCENARIOS

from cspm_checks.acceleration import (
    acceleration_suspicions,
    lasting_acceleration,
)
from cspm_checks.channel import Channel
from cspm_checks.series import SensorSeries
from cspm_msgs_py.testbed import load_testbed

MACHINE = load_testbed(SCENARIOS / "testbeds" / "thesis.yaml").testbed
TIME = 0.001 * np.arange(10_000)
ANGLE = 8.0 * np.sin(2.0 * np.pi * 0.5 * TIME)
LARGEST = 8.0 * np.pi**2


def suspected(values, time=TIME, topic="/winches/state", field="position/surge_1"):
    series = SensorSeries(time, values)
    return acceleration_suspicions(Channel(MACHINE.topics[topic], field), series, MACHINE)


def test_a_sine_accelerates_as_its_second_derivative():
    found, rounding = lasting_acceleration(SensorSeries(TIME, ANGLE))
    # The thirteenth of twenty peaks is a little lower.
    assert 0.97 * LARGEST < found < LARGEST
    assert rounding == 0.0


def test_what_a_sensor_rounds_is_no_acceleration():
    step = 2.0 * np.pi / 1024
    slow = 1.3 * step * np.sin(2.0 * np.pi * 0.3 * TIME) + 0.5 * step
    found, rounding = lasting_acceleration(SensorSeries(TIME, np.round(slow / step) * step))
    assert 0.0 < found <= rounding * (1.0 + 1e-9)


def test_four_wrong_samples_are_not_many():
    values = ANGLE.copy()
    values[[150, 4000, 4050, 7050]] += 1e4
    assert suspected(values) == []
    values[8000] += 1e4
    assert len(suspected(values)) == 1


@pytest.mark.parametrize("how", [{"values": ANGLE * 360.0}, {"values": ANGLE, "time": TIME * 0.02}])
def test_a_wrong_unit_of_angle_or_time_is_suspected(how):
    (found,) = suspected(**how)
    assert found.kind == "implausible"
    assert "unit of the position, or of time?" in found.text
    assert found.numbers["largest"] > 2.0 * found.numbers["limit"]


def test_what_the_drives_can_do_is_not_suspected():
    assert suspected(ANGLE) == []


def test_the_bar_accelerates_by_no_more_than_cables_and_weight_allow():
    falling = 0.5 * 9.81 * np.minimum(TIME, 1.0) ** 2
    assert suspected(falling, topic="/bar/pose", field="z") == []
    shaken = 0.2 * np.sin(2.0 * np.pi * 9.0 * TIME)
    (found,) = suspected(shaken, topic="/bar/pose", field="z")
    assert found.where == "/bar/pose z"


def test_a_pause_is_no_acceleration():
    """After a gap of half a second the position is elsewhere."""
    time = np.where(TIME < 5.0, TIME, TIME + 0.5)
    assert suspected(np.where(TIME < 5.0, 0.0, 30.0) + ANGLE * 0.01, time=time) == []


def test_few_samples_are_not_judged():
    assert lasting_acceleration(SensorSeries(TIME[:250], ANGLE[:250])) is None
    assert lasting_acceleration(SensorSeries(TIME[:251], ANGLE[:251])) is not None
