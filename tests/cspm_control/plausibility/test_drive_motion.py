"""Angles and speeds of drives that jump, and those that a motor can have."""

import numpy as np
import pytest

from cspm_control.plausibility.drive_motion import DriveMotion

MS = 1_000_000
FASTEST = 1000.0  # rad/s²


def drives(noise=(0.0, 0.0), count=2):
    names = [f"winch_{i + 1}" for i in range(count)]
    return DriveMotion(names, np.full(count, FASTEST), noise, MS)


def row(angles, speeds):
    return np.concatenate([angles, speeds, np.zeros(len(angles))])


def accelerated(share, periods=50, start=7.0):
    """Return rows of a motor that is accelerated evenly, one a millisecond, beside one at rest."""
    times = 1e-3 * np.arange(periods)
    speed = start + share * FASTEST * times
    angle = start * times + 0.5 * share * FASTEST * times**2
    return [row([0.0, angle[k]], [0.0, speed[k]]) for k in range(periods)]


def says(judge, rows, period=1.0):
    return [judge.fault(round(k * period * MS), each) for k, each in enumerate(rows)]


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("share", "plausible"), [(0.99, True), (1.01, False)])
def test_the_fastest_motor_is_plausible(share, sign, plausible):
    found = says(drives(), accelerated(sign * share, start=sign * 7.0))
    assert any(found) != plausible


def test_a_motor_that_turns_evenly_may_be_read_seldom():
    judge = drives()
    assert judge.fault(0, row([0.0, 0.0], [0.0, 50.0])) is None
    assert judge.fault(200 * MS, row([0.0, 10.0], [0.0, 50.0])) is None


def test_an_angle_that_jumps_is_named_until_the_motor_could_be_there():
    judge = drives()
    assert judge.fault(0, row([0.0, 0.0], [0.0, 0.0])) is None
    assert judge.fault(MS, row([0.0, 0.2], [0.0, 0.0])) == (
        "/winches/state: angle of winch_2 jumped by 0.2 rad in 1 ms, allowed: 0.0005 rad (the"
        " motor's rotor_inertia and torque_limit)"
    )
    assert judge.fault(19 * MS, row([0.0, 0.2], [0.0, 0.0])) is not None
    assert judge.fault(21 * MS, row([0.0, 0.2], [0.0, 0.0])) is None


def test_a_speed_that_jumps_is_named():
    judge = drives()
    assert judge.fault(0, row([0.0, 0.0], [0.0, 0.0])) is None
    assert judge.fault(MS, row([0.0, 0.0], [3.0, 0.0])) == (
        "/winches/state: speed of winch_1 jumped by 3 rad/s in 1 ms, allowed: 1 rad/s (the motor's"
        " rotor_inertia and torque_limit)"
    )


def test_a_speed_without_motion_is_found_by_the_angle():
    judge = drives()
    still = row([0.0, 0.0], [0.0, 0.0])
    assert judge.fault(0, still) is None
    creeping = row([0.0, 0.0], [0.9, 0.0])
    assert judge.fault(MS, creeping) is None
    assert "angle of winch_1 jumped by 0.0009 rad" in judge.fault(2 * MS, creeping)


@pytest.mark.parametrize(("share", "plausible"), [(1.0, True), (20.0, False)])
def test_stated_noise_is_plausible_and_more_is_not(share, plausible):
    rng = np.random.default_rng(2)
    noise = np.repeat([1e-3, 0.2], 2)
    rows = [
        np.concatenate([share * noise * rng.standard_normal(4), np.zeros(2)]) for _ in range(5000)
    ]
    assert any(says(drives(noise=(1e-3, 0.2)), rows)) != plausible


def test_stamps_that_tremble_and_clocks_that_restart_are_no_jumps():
    judge = drives()
    assert judge.fault(1000 * MS, row([0.0, 0.0], [0.0, 0.0])) is None
    assert judge.fault(1000 * MS + 10, row([0.0, 0.0004], [0.0, 0.9])) is None
    assert judge.fault(5 * MS, row([9.0, 9.0], [9.0, 9.0])) is None
