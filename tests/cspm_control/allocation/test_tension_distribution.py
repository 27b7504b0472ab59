import numpy as np
import pytest
from machines import build, general_content, point_content, random_poses
from structure_samples import HOLD, HOME, row, structure

from cspm_control.allocation.tension_distribution import TensionDistribution
from cspm_msgs_py.control_spec.distribution import TensionDistribution as HowDistributed
from cspm_msgs_py.dofs import CONTROLLED_AXES
from cspm_msgs_py.errors import SingularityError
from cspm_sim.parameters import plant_parameters

AXES = list(CONTROLLED_AXES)
WIDE = (-1e9, 1e9)
LEAST_SQUARES = HowDistributed(method="pseudo_inverse")


def distribution(testbed, limits=None):
    given = [cable.tension_limits for cable in testbed.cables]
    chosen = np.array(given if limits is None else [limits] * len(given), dtype=float)
    return TensionDistribution(plant_parameters(testbed).cables, chosen, LEAST_SQUARES)


@pytest.mark.parametrize("machine", ["thesis", "general"])
def test_it_is_the_pseudo_inverse_of_the_five_rows(machine, request):
    testbed = request.getfixturevalue(machine)
    solver, rng = distribution(testbed, WIDE), np.random.default_rng(5)
    frames = random_poses(20, 6, centre=(0.0, 0.0, 0.0), reach=0.05, angle=0.1)
    for pose, frame in zip(random_poses(20, 5), frames, strict=True):
        wrench = HOLD + rng.normal(size=6)
        found = solver.step(wrench, row(pose), row(frame))
        rows = structure(testbed, pose, frame)[AXES]
        np.testing.assert_allclose(found.tensions, np.linalg.pinv(rows) @ wrench[AXES], atol=1e-8)
        np.testing.assert_allclose(rows @ found.tensions, wrench[AXES], atol=1e-8)
        assert found.residual <= 1e-9
        assert found.saturated == 0
        assert found.feasible


def test_the_weight_is_met_within_the_thesis_limits(thesis):
    found = distribution(thesis).step(HOLD, row(HOME), row(np.zeros(6)))
    assert found.feasible
    assert found.saturated == 0
    assert found.residual <= 1e-9
    assert (found.tensions >= 2.0).all()
    force = structure(thesis, HOME, np.zeros(6)) @ found.tensions
    np.testing.assert_allclose(force, HOLD, atol=1e-8)


def test_cables_pull_the_bar_up():
    """Inverted, the weight would ask every cable to push."""
    testbed = build(general_content())
    lifted = distribution(testbed, WIDE).step(HOLD, row(HOME), row(np.zeros(6)))
    pressed = distribution(testbed, WIDE).step(-HOLD, row(HOME), row(np.zeros(6)))
    assert lifted.tensions.sum() > 0.0
    np.testing.assert_allclose(pressed.tensions, -lifted.tensions, rtol=1e-12)


def test_the_moment_in_roll_is_dropped(thesis):
    solver = distribution(thesis)
    with_roll = HOLD + np.array([0.0, 0.0, 0.0, 3.0, 0.0, 0.0])
    plain, rolled = (solver.step(w, row(HOME), row(np.zeros(6))) for w in (HOLD, with_roll))
    np.testing.assert_array_equal(plain.tensions, rolled.tensions)
    assert rolled.feasible


def test_too_little_is_raised_to_the_lower_limit_and_said(thesis):
    """Without weight to hold, the least tensions are below 2 N."""
    wrench = HOLD * 0.05
    found = distribution(thesis).step(wrench, row(HOME), row(np.zeros(6)))
    free = distribution(thesis, WIDE).step(wrench, row(HOME), row(np.zeros(6)))
    assert (free.tensions < 2.0).all()
    np.testing.assert_array_equal(found.tensions, np.full(8, 2.0))
    assert found.saturated == 8
    assert not found.feasible
    rows = structure(thesis, HOME, np.zeros(6))[AXES]
    missing = np.linalg.norm(rows @ found.tensions - wrench[AXES])
    assert found.residual == pytest.approx(missing / np.linalg.norm(wrench), rel=1e-9)
    assert found.residual > 0.1


def test_too_much_is_cut_at_the_upper_limit_and_said(thesis):
    wrench = HOLD + np.array([0.0, 25.0, 0.0, 0.0, 0.0, 0.0])
    found = distribution(thesis).step(wrench, row(HOME), row(np.zeros(6)))
    free = distribution(thesis, WIDE).step(wrench, row(HOME), row(np.zeros(6))).tensions
    limits = np.array([cable.tension_limits for cable in thesis.cables])
    np.testing.assert_allclose(found.tensions, np.clip(free, *limits.T), atol=1e-12)
    beyond = (free < limits[:, 0]) | (free > limits[:, 1])
    assert (free > limits[:, 1]).any()
    assert found.saturated == beyond.sum()
    assert not found.feasible
    rows = structure(thesis, HOME, np.zeros(6))[AXES]
    missing = np.linalg.norm(rows @ found.tensions - wrench[AXES])
    assert found.residual == pytest.approx(missing / np.linalg.norm(wrench), rel=1e-9)


def test_a_tension_exactly_at_its_limit_is_not_saturated(thesis):
    rest = HOLD, row(HOME), row(np.zeros(6))
    free = distribution(thesis, WIDE).step(*rest).tensions
    cables = plant_parameters(thesis).cables
    limits = np.column_stack([free, free + 1.0])
    exact = TensionDistribution(cables, limits, LEAST_SQUARES).step(*rest)
    assert exact.feasible
    assert exact.saturated == 0
    above = TensionDistribution(cables, limits + 1e-3, LEAST_SQUARES).step(*rest)
    assert not above.feasible
    assert above.saturated == 8


def test_no_wrench_at_all_is_met_by_no_tension(thesis):
    found = distribution(thesis, (0.0, 10.0)).step(np.zeros(6), row(HOME), row(np.zeros(6)))
    np.testing.assert_array_equal(found.tensions, np.zeros(8))
    assert found.feasible


def test_a_geometry_that_cannot_give_a_moment_is_one_line():
    solver = distribution(build(point_content()))
    with pytest.raises(SingularityError) as caught:
        solver.step(HOLD, row(HOME), row(np.zeros(6)))
    assert str(caught.value) == (
        "tension distribution: with the bar measured at [0, 0, 2, 0, 0, 0, 1] (m, quaternion) the"
        " cables cannot give every force and moment along surge, sway, heave, pitch, yaw"
    )


def test_the_callers_arrays_stay(thesis):
    solver = distribution(thesis)
    wrench, bar_row, frame_row = HOLD.copy(), row(HOME), row(np.zeros(6))
    first = solver.step(wrench, bar_row, frame_row).tensions
    kept = first.copy()
    solver.step(wrench * 2, row(HOME + 0.1), frame_row)
    np.testing.assert_array_equal(first, kept)
    np.testing.assert_array_equal(wrench, HOLD)
    np.testing.assert_array_equal(bar_row, row(HOME))
