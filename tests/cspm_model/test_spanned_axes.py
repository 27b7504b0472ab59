"""Which forces and moments cables give: known machines, and the share by a second road."""

from pathlib import Path

import numpy as np
import pytest
from machines import build, point_content
from scipy.optimize import minimize

from cspm_model.kinematics import geometry
from cspm_model.parameters import nominal_parameters
from cspm_model.spanned_axes import (
    LEAST_SHARE,
    gyration_radius,
    share_of,
    spanned_axes,
    structures_at,
)
from cspm_msgs_py.testbed import load_testbed

TESTBEDS = Path(__file__).resolve().parents[2] / "scenarios" / "testbeds"


def structures(testbed, *poses):
    places = np.array(poses, dtype=float)
    return structures_at(nominal_parameters(testbed), places, np.zeros_like(places))


def shipped(name):
    return load_testbed(TESTBEDS / f"{name}.yaml").testbed


@pytest.mark.parametrize(
    ("testbed", "pose", "axes"),
    [
        (shipped("thesis"), (0, 0, 2, 0, 0, 0), (0, 1, 2, 4, 5)),
        (shipped("thesis"), (0.1, 0.1, 2, 0, 0.2, 0.1), (0, 1, 2, 4, 5)),
        (shipped("thesis_six_dof"), (0, 0, 2, 0, 0, 0), (0, 1, 2, 3, 4, 5)),
        (build(point_content()), (0, 0, 1, 0, 0, 0), (0, 1, 2)),
    ],
)
def test_known_machines(testbed, pose, axes):
    assert spanned_axes(structures(testbed, pose)) == axes


def test_an_axis_counts_where_every_pose_gives_it():
    one = np.zeros((2, 6, 3))
    one[:, 0, 0] = one[:, 1, 1] = 1.0
    one[0, 2, 2] = 1.0
    assert spanned_axes(one[:1]) == (0, 1, 2)
    assert spanned_axes(one) == (0, 1)


def test_what_is_taken_first_displaces_what_depends_on_it():
    rows = np.zeros((1, 6, 2))
    rows[0, 0] = rows[0, 4] = (1.0, 0.0)
    rows[0, 2] = (0.0, 1.0)
    assert spanned_axes(rows) == (0, 2)
    assert spanned_axes(rows, (4,)) == (2, 4)


def test_both_sides_of_the_least_share():
    rows = np.zeros((1, 6, 3))
    rows[0, 0], rows[0, 1] = (1.0, 0.0, 0.0), (1.0, 1.01 * LEAST_SHARE, 0.0)
    assert spanned_axes(rows) == (0, 1)
    rows[0, 1, 1] = 0.99 * LEAST_SHARE
    assert spanned_axes(rows) == (0,)


def test_the_share_is_the_reciprocal_of_the_least_tensions_that_give_the_axis_alone():
    structure = structures(shipped("thesis_six_dof"), (0.05, 0.1, 2, 0, 0.1, 0.05))[0]
    others = [0, 1, 2, 5]
    found = minimize(
        lambda t: t @ t,
        np.ones(structure.shape[1]),
        jac=lambda t: 2 * t,
        constraints=[
            {"type": "eq", "fun": lambda t: structure[others] @ t},
            {"type": "eq", "fun": lambda t: structure[4] @ t - 1.0},
        ],
    )
    share = share_of(structure[None], 4, others) * np.sqrt(structure.shape[1] / 3.0)
    assert share == pytest.approx(1.0 / np.linalg.norm(found.x), rel=1e-6)


def test_moments_are_over_the_radius_of_gyration():
    testbed = shipped("thesis")
    parameters, pose = nominal_parameters(testbed), (0.1, 0, 2, 0, 0.1, 0)
    found = structures(testbed, pose)[0]
    jacobian = geometry(parameters.cables, pose, np.zeros(6)).bar
    inertia = testbed.bar.inertia
    radius = np.sqrt((inertia.ixx + inertia.iyy + inertia.izz) / (2 * testbed.bar.mass))
    assert gyration_radius(parameters) == pytest.approx(radius)
    np.testing.assert_allclose(found[:3], -jacobian.T[:3])
    np.testing.assert_allclose(found[3:], -jacobian.T[3:] / radius)
