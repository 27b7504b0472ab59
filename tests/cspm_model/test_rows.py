from math import cos, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cspm_model.kernels.rotation import euler_from_quaternion
from cspm_model.kernels.rows import (
    bar_twist_row,
    corrupt,
    motion_twist_row,
    pose_row,
    reference_row,
)

turn = st.floats(-3.1, 3.1)
tilt = st.floats(-1.4, 1.4)
length = st.floats(-10.0, 10.0)
poses = st.tuples(length, length, length, turn, tilt, turn).map(np.array)
rates = st.tuples(*[st.floats(-2.0, 2.0)] * 6).map(np.array)
STEP = 1e-4


def rotation_of(pose):
    return Rotation.from_euler("ZYX", [pose[5], pose[4], pose[3]])


def written(kernel, width, values):
    out = np.full(width, np.nan)
    kernel(values, out)
    return out


def parabola(pose, rate, acceleration, time):
    return pose + rate * time + 0.5 * acceleration * time**2


@settings(deadline=None)  # the first call compiles
@given(pose=poses)
def test_pose_row_is_position_and_the_quaternion_of_scipy(pose):
    row = written(pose_row, 7, pose)
    np.testing.assert_array_equal(row[:3], pose[:3])
    expected = rotation_of(pose).as_quat()
    # q and −q are the same rotation.
    assert abs(row[3:] @ expected) == pytest.approx(1.0, abs=1e-14)
    assert np.linalg.norm(row[3:]) == pytest.approx(1.0, abs=1e-15)


@settings(deadline=None)  # the first call compiles
@given(pose=poses)
def test_the_angles_come_back_from_the_quaternion(pose):
    row = written(pose_row, 7, pose)
    np.testing.assert_allclose(euler_from_quaternion(row[3:]), pose[3:], atol=1e-13)
    np.testing.assert_allclose(euler_from_quaternion(-2.0 * row[3:]), pose[3:], atol=1e-13)


@settings(deadline=None)  # the first call compiles
@given(pose=poses, rate=rates)
def test_motion_twist_is_the_rate_of_the_rotation_in_world_axes(pose, rate):
    row = written(motion_twist_row, 6, np.concatenate([pose, rate, np.zeros(6)]))
    np.testing.assert_array_equal(row[:3], rate[:3])
    ahead, behind = (rotation_of(pose + sign * STEP * rate) for sign in (1, -1))
    # R(t+h)·R(t−h)ᵀ turns about world axes.
    np.testing.assert_allclose(row[3:], (ahead * behind.inv()).as_rotvec() / (2 * STEP), atol=1e-6)


@settings(deadline=None)  # the first call compiles
@given(pose=poses, rate=rates)
def test_bar_twist_is_velocity_and_the_body_rate_turned_to_world_axes(pose, rate):
    row = written(bar_twist_row, 6, np.concatenate([pose, rate]))
    np.testing.assert_array_equal(row[:3], rate[:3])
    np.testing.assert_allclose(row[3:], rotation_of(pose).apply(rate[3:]), atol=1e-13)


@settings(deadline=None)  # the first call compiles
@given(pose=poses, rate=rates, acceleration=rates)
def test_reference_row_holds_the_derivatives_of_its_pose(pose, rate, acceleration):
    row = written(reference_row, 19, np.concatenate([pose, rate, acceleration]))
    np.testing.assert_array_equal(row[:7], written(pose_row, 7, pose))

    def twist(time):
        at = parabola(pose, rate, acceleration, time)
        values = np.concatenate([at, rate + acceleration * time, acceleration])
        return written(motion_twist_row, 6, values)

    np.testing.assert_array_equal(row[7:13], twist(0.0))
    change = (twist(STEP) - twist(-STEP)) / (2 * STEP)
    np.testing.assert_allclose(row[13:], change, atol=1e-5)


def test_angular_acceleration_without_angular_acceleration_of_the_angles():
    """Pitch and yaw turning evenly: the pitch axis turns with yaw, so ω does not stay."""
    motion = np.zeros(18)
    motion[10], motion[11] = 0.3, 0.5
    row = written(reference_row, 19, motion)
    np.testing.assert_allclose(row[16:], [-0.15, 0.0, 0.0], atol=1e-15)


def test_twist_of_pure_roll_at_yaw_points_along_the_bow():
    motion = np.zeros(18)
    motion[5], motion[9] = 0.7, 2.0
    row = written(motion_twist_row, 6, motion)
    np.testing.assert_allclose(row[3:], [2.0 * cos(0.7), 2.0 * sin(0.7), 0.0], atol=1e-15)


def test_corrupt_adds_noise_then_rounds_where_there_is_a_resolution():
    values, noise = np.array([1.0, 1.0, -1.0, 0.24]), np.array([1.0, -1.0, 1.0, 0.0])
    deviation, resolution = np.array([0.5, 0.5, 0.26, 0.0]), np.array([0.0, 0.2, 0.5, 0.5])
    out = np.empty(4)
    corrupt(values, noise, deviation, resolution, out)
    np.testing.assert_allclose(out, [1.5, 0.6, -0.5, 0.0], atol=1e-15)


@settings(deadline=None)  # the first call compiles
@given(value=st.floats(-1e3, 1e3), resolution=st.sampled_from([7.7e-4, 0.005, 0.25]))
def test_rounding_takes_the_nearest_step(value, resolution):
    out = np.empty(1)
    corrupt(np.array([value]), np.zeros(1), np.zeros(1), np.array([resolution]), out)
    assert abs(out[0] - value) <= 0.5 * resolution * (1 + 1e-9)
    assert out[0] / resolution == pytest.approx(round(out[0] / resolution), abs=1e-6)
