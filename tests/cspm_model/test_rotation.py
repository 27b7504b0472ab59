from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cspm_model.kernels.rotation import (
    body_rate_to_euler_rate,
    cross,
    euler_from_quaternion,
    euler_rate_to_world_rate,
    quaternion_from_euler,
    rotate,
    rotate_back,
    rotation_from_euler,
)

turn = st.floats(-pi, pi)
tilt = st.floats(-1.5, 1.5)
number = st.floats(-10.0, 10.0)
vectors = st.tuples(number, number, number)
angles = st.tuples(turn, tilt, turn)


def matrix(roll, pitch, yaw):
    return np.array(rotation_from_euler(roll, pitch, yaw)).reshape(3, 3)


@given(angles=angles)
def test_the_matrix_is_yaw_times_pitch_times_roll(angles):
    roll, pitch, yaw = angles
    expected = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix()
    assert matrix(*angles) == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize(
    ("angles", "body", "world"),
    [
        ((pi / 2, 0, 0), (0, 1, 0), (0, 0, 1)),  # roll lowers the bar's right side (z is down)
        ((0, pi / 2, 0), (0, 0, 1), (1, 0, 0)),  # pitch raises the bow
        ((0, 0, pi / 2), (1, 0, 0), (0, 1, 0)),  # yaw turns the bow to starboard
    ],
)
def test_signs_of_the_three_angles(angles, body, world):
    rotated = rotate(rotation_from_euler(*angles), *map(float, body))
    assert rotated == pytest.approx(world, abs=1e-15)


@given(angles=angles, vector=vectors)
def test_rotating_back_undoes_rotating(angles, vector):
    rotation = rotation_from_euler(*angles)
    assert rotate(rotation, *vector) == pytest.approx(matrix(*angles) @ vector, abs=1e-13)
    assert rotate_back(rotation, *rotate(rotation, *vector)) == pytest.approx(vector, abs=1e-13)


@given(a=vectors, b=vectors)
def test_cross_product(a, b):
    assert cross(*a, *b) == pytest.approx(np.cross(a, b), abs=1e-12)


@given(angles=angles, rates=vectors)
def test_the_world_rate_is_the_matrix_in_motion(angles, rates):
    step = 1e-6
    ahead, behind = (matrix(*(np.array(angles) + s * step * np.array(rates))) for s in (1, -1))
    spin = (ahead - behind) / (2 * step) @ matrix(*angles).T
    found = euler_rate_to_world_rate(angles[1], angles[2], *rates)
    scale = 1.0 + np.abs(rates).max() ** 3
    assert found == pytest.approx([spin[2, 1], spin[0, 2], spin[1, 0]], abs=1e-8 * scale)
    assert spin == pytest.approx(-spin.T, abs=1e-8 * scale)


@given(angles=angles, rates=vectors)
def test_euler_rates_of_the_body_rate_are_the_inverse_map(angles, rates):
    world = euler_rate_to_world_rate(angles[1], angles[2], *rates)
    body = rotate_back(rotation_from_euler(*angles), *world)
    assert body_rate_to_euler_rate(angles[0], angles[1], *body) == pytest.approx(rates, abs=1e-11)


@given(angles=angles)
def test_the_quaternion_is_that_rotation(angles):
    quaternion = np.empty(4)
    quaternion_from_euler(*angles, quaternion)
    assert Rotation.from_quat(quaternion).as_matrix() == pytest.approx(matrix(*angles), abs=1e-14)
    assert np.linalg.norm(quaternion) == pytest.approx(1.0, abs=1e-15)


@given(angles=angles, length=st.floats(0.01, 100.0), sign=st.sampled_from([-1.0, 1.0]))
def test_euler_angles_come_back_from_a_quaternion_of_any_length_and_sign(angles, length, sign):
    quaternion = np.empty(4)
    quaternion_from_euler(*angles, quaternion)
    found = euler_from_quaternion(quaternion * length * sign)
    assert matrix(*found) == pytest.approx(matrix(*angles), abs=1e-13)
    assert abs(found[1] - angles[1]) < 1e-12


@pytest.mark.parametrize("pitch", [pi / 2, -pi / 2])
def test_a_quaternion_at_the_singularity_still_gives_its_pitch(pitch):
    quaternion = np.empty(4)
    quaternion_from_euler(0.3, pitch, -0.2, quaternion)
    assert euler_from_quaternion(quaternion)[1] == pytest.approx(pitch, abs=1e-7)
    quaternion *= 1.0 + 1e-12
    assert abs(euler_from_quaternion(quaternion)[1]) <= pi / 2
