"""The bar's equations of motion against rotation matrices differentiated by numbers."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cspm_control.controllers.bar_dynamics import (
    acceleration_from,
    bar_parameters,
    wanted_motion,
    wrench_for,
)
from cspm_model.kernels.rows import reference_row
from cspm_msgs_py.testbed import Bar

GRAVITY = 9.81
BAR = Bar.model_validate(
    {
        "mass": 4.0,
        "inertia": {"ixx": 0.15, "iyy": 0.3, "izz": 0.4, "ixy": 0.01, "ixz": -0.02, "iyz": 0.015},
        "com": (0.03, -0.02, 0.05),
        "dimensions": (1.0, 0.1, 0.1),
    }
)
PARAMETERS = bar_parameters(BAR, GRAVITY)


def motions(count, seed):
    """Rows x y z φ θ ψ, rates and accelerations, (count, 3, 6)."""
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.0, 1.0, (count, 3, 6)) * [[0.5], [1.0], [3.0]]


def at(motion, time):
    return motion[0] + motion[1] * time + 0.5 * motion[2] * time**2


def momentum(motion, time):
    """Linear momentum, and angular momentum about the world's origin, by central differences."""
    step = 1e-4

    def place(t):
        pose = at(motion, t)
        turn = Rotation.from_euler("ZYX", pose[:2:-1])
        return pose[:3] + turn.apply(BAR.com), turn

    (before, turn_before), (after, turn_after) = place(time - step), place(time + step)
    here, turn = place(time)
    velocity = (after - before) / (2 * step)
    spin = (turn_after * turn_before.inv()).as_rotvec() / (2 * step)
    about_centre = turn.apply(BAR.inertia.matrix @ turn.inv().apply(spin))
    return BAR.mass * velocity, about_centre + np.cross(here, BAR.mass * velocity), here


@pytest.mark.parametrize("motion", motions(8, 1))
def test_the_wrench_is_the_rate_of_momentum_less_gravity(motion):
    found = np.empty(6)
    wrench_for(*motion, PARAMETERS, found)
    step = 1e-3
    (p0, l0, _), (p1, l1, _) = momentum(motion, -step), momentum(motion, step)
    weight = np.array([0.0, 0.0, BAR.mass * GRAVITY])
    force = (p1 - p0) / (2 * step) - weight
    centre = momentum(motion, 0.0)[2]
    about_world = (l1 - l0) / (2 * step) - np.cross(centre, weight)
    moment = about_world - np.cross(motion[0, :3], force)
    np.testing.assert_allclose(found[:3], force, atol=2e-4)
    np.testing.assert_allclose(found[3:], moment, atol=2e-4)


@pytest.mark.parametrize("motion", motions(8, 2))
def test_acceleration_and_wrench_are_inverse(motion):
    wrench, found = np.empty(6), np.empty(6)
    wrench_for(*motion, PARAMETERS, wrench)
    acceleration_from(motion[0], motion[1], wrench, PARAMETERS, found)
    np.testing.assert_allclose(found, motion[2], atol=1e-10)


@pytest.mark.parametrize("motion", motions(8, 3))
def test_the_wanted_motion_of_a_reference_row_is_the_motion_it_was_made_of(motion):
    row, found = np.empty(19), np.empty((3, 6))
    reference_row(motion.ravel(), row)
    wanted_motion(row, found)
    np.testing.assert_allclose(found, motion, atol=1e-12)


def test_at_rest_the_wrench_holds_the_weight_under_its_centre():
    found = np.empty(6)
    wrench_for(np.zeros(6), np.zeros(6), np.zeros(6), PARAMETERS, found)
    weight = BAR.mass * GRAVITY
    np.testing.assert_allclose(
        found, [0.0, 0.0, -weight, -BAR.com[1] * -weight * -1.0, BAR.com[0] * weight, 0.0]
    )
