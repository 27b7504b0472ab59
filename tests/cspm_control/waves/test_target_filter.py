"""Velocity and acceleration of a target from its poses."""

import numpy as np
import pytest

from cspm_control.waves.target_filter import TargetFilter
from cspm_model.kernels.rows import pose_row

PERIOD = 1e-3


def row(pose):
    found = np.empty(7)
    pose_row(np.asarray(pose, dtype=float), found)
    return found


def followed(path, bandwidth=40.0, steps=4000, steps_per_pose=1):
    """Return what a filter makes of poses path(t) that come every so many steps, (steps, 3, 6)."""
    found = TargetFilter(bandwidth, period=PERIOD, steps_per_pose=steps_per_pose)
    held = [row(path(k // steps_per_pose * steps_per_pose * PERIOD)) for k in range(steps)]
    return np.array([found.step(pose) for pose in held])


def still(_):
    return np.array([0.1, -0.2, 2.0, 0.02, -0.1, 0.3])


def heaving(amplitude, frequency):
    return lambda t: still(t) + amplitude * np.sin(frequency * t) * np.eye(6)[2]


def test_the_first_pose_is_believed():
    first = followed(still, steps=1)[0]
    np.testing.assert_allclose(first[0], still(0.0), atol=1e-12)
    assert not first[1:].any()


@pytest.mark.parametrize("steps_per_pose", [1, 10])
def test_constant_acceleration_is_followed_without_error(steps_per_pose):
    def path(t):
        return still(t) + np.array([0.3, 0.0, -0.2, 0.0, 0.1, 0.0]) * 0.5 * t**2

    found = followed(path, steps_per_pose=steps_per_pose)[-1]
    np.testing.assert_allclose(found[0], path(3999 * PERIOD), atol=1e-9)
    np.testing.assert_allclose(found[2], [0.3, 0.0, -0.2, 0.0, 0.1, 0.0], atol=1e-6)


@pytest.mark.parametrize("bandwidth", [20.0, 40.0])
def test_a_sine_is_wrong_by_the_third_power_of_frequency_over_bandwidth(bandwidth):
    frequency, path = 2.0, heaving(0.1, 2.0)
    found = followed(path, bandwidth)[:, 0, 2]
    wanted = np.array([path(k * PERIOD)[2] for k in range(4000)])
    share = np.abs(found - wanted)[2000:].max() / 0.1
    assert share == pytest.approx((frequency / bandwidth) ** 3, rel=0.1)


def test_a_body_that_turns_on_is_followed_past_half_a_turn():
    found = followed(lambda t: [0, 0, 0, 0, 0, 2.0 * t])[:, :, 5]
    assert found[-1, 0] == pytest.approx(2.0 * 3.999, abs=1e-6)
    assert found[-1, 1] == pytest.approx(2.0, abs=1e-6)


def test_noise_is_less_the_lower_the_bandwidth():
    noise = np.random.default_rng(3).normal(scale=1e-4, size=4001)
    spread = [
        followed(lambda t: noise[round(t / PERIOD)] * np.eye(6)[0], bandwidth)[2000:, 0, 0].std()
        for bandwidth in (10.0, 40.0, 160.0)
    ]
    assert 0.0 < spread[0] < spread[1] < spread[2] < 1e-4


def test_poses_that_stay_the_same_are_poses_all_the_same():
    """Resolution may hide a motion; what does not change must stop."""
    poses = [row([0.1 * min(k, 100) * PERIOD, 0, 0, 0, 0, 0]) for k in range(2000)]
    found = TargetFilter(40.0, period=PERIOD, steps_per_pose=1)
    last = [found.step(pose) for pose in poses][-1]
    np.testing.assert_allclose(last[0, 0], 0.01, atol=1e-9)
    assert abs(last[1, 0]) < 1e-7
