import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cspm_control.waves.wave_trajectory import WaveTrajectory
from cspm_model.kernels.rotation import euler_from_quaternion
from cspm_model.motion import Motion


@pytest.fixture
def swell():
    """Six sines, as knots with exact derivatives."""
    time = np.arange(200) * 0.02
    rate = 2 * np.pi / 4.0 * np.arange(1, 7)
    amplitude = np.array([0.1, 0.2, 0.3, 0.4, 0.3, 0.2])
    angle = time[:, None] * rate
    value, slope = amplitude * np.sin(angle), amplitude * rate * np.cos(angle)
    return Motion(np.hstack([value, slope, -value * rate**2]), 0.02, periodic=True)


def test_rows_follow_the_motion_at_any_stamp(swell):
    trajectory = WaveTrajectory(swell)
    for stamp in (0, 1, 1_234_567, 3_999_999_999, 123_456_789_012):
        row = trajectory.step(stamp)
        values = swell.at(stamp * 1e-9)
        np.testing.assert_array_equal(trajectory.values, values)
        np.testing.assert_array_equal(row[:3], values[:3])
        np.testing.assert_allclose(euler_from_quaternion(row[3:7]), values[3:6], atol=1e-14)


def test_rows_are_consistent_with_each_other(swell):
    trajectory, step = WaveTrajectory(swell), 100_000
    for stamp in (500_000_000, 2_345_600_000, 40_000_300_000):
        before, now, after = (trajectory.step(stamp + k * step) for k in (-1, 0, 1))
        seconds = 2e-9 * step
        np.testing.assert_allclose(now[7:10], (after - before)[:3] / seconds, atol=1e-5)
        np.testing.assert_allclose(now[13:], (after - before)[7:13] / seconds, atol=1e-3)
        turn = Rotation.from_quat(after[3:7]) * Rotation.from_quat(before[3:7]).inv()
        np.testing.assert_allclose(now[10:13], turn.as_rotvec() / seconds, atol=1e-5)


def test_a_row_is_the_callers_own(swell):
    trajectory = WaveTrajectory(swell)
    first = trajectory.step(10**9)
    kept = first.copy()
    trajectory.step(2 * 10**9)
    np.testing.assert_array_equal(first, kept)


def test_a_still_body_has_no_rates():
    pose = np.array([1.0, 2.0, 3.0, 0.1, 0.2, 0.3])
    row = WaveTrajectory(Motion.still(pose)).step(5 * 10**9)
    np.testing.assert_array_equal(row[:3], pose[:3])
    np.testing.assert_array_equal(row[7:], np.zeros(12))
