"""Every tension distribution against what does not know it: LP, least squares, optimality."""

from typing import get_args

import numpy as np
import pytest
from machines import build, point_content, random_poses
from run_samples import SCENARIOS
from scipy.linalg import null_space
from scipy.optimize import linprog, lsq_linear
from structure_samples import HOLD, HOME, row, structure

from cspm_control.allocation.analytic_centre import analytic_centre
from cspm_control.allocation.tension_distribution import TensionDistribution
from cspm_control.stages.make import wanted_tension_limits
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.control_spec.distribution import DistributionMethod
from cspm_msgs_py.control_spec.distribution import TensionDistribution as HowDistributed
from cspm_msgs_py.dofs import CONTROLLED_AXES
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import ClosedLoop
from cspm_msgs_py.testbed import load_testbed

AXES = list(CONTROLLED_AXES)
METHODS = [method for method in get_args(DistributionMethod) if method != "prescribed"]
COMPLETE = ("qp", "analytic_centre")
STILL = np.zeros(6)
WEIGHTS = np.array([1.0, 1.0, 1.0, 6.0, 6.0, 6.0])


def limits_of(testbed):
    return np.array([cable.tension_limits for cable in testbed.cables], dtype=float)


def solver_of(testbed, method, axes=AXES, **settings):
    how = HowDistributed(method=method, **settings)
    return TensionDistribution(
        nominal_parameters(testbed).cables, limits_of(testbed), how, tuple(axes)
    )


@pytest.fixture(scope="module")
def six_dof():
    return load_testbed(SCENARIOS / "testbeds" / "thesis_six_dof.yaml").testbed


@pytest.fixture(scope="module")
def cases(thesis):
    """Wrenches about the weight at random poses: structure, wrench, pose, largest margin [N]."""
    rng = np.random.default_rng(3)
    found = []
    for pose in random_poses(60, 4, reach=0.12, angle=0.12):
        rows = structure(thesis, pose, STILL)[AXES]
        wrench = HOLD + rng.normal(size=6) * [2.0, 2.0, 6.0, 0.0, 0.4, 0.4]
        found.append((rows, wrench, pose, margin(rows, wrench[AXES], limits_of(thesis))))
    return found


def margin(rows, wrench, limits):
    """The largest s with all tensions at least s within the limits; below 0 there are none."""
    m, n = rows.shape
    found = linprog(
        np.append(np.zeros(n), -1.0),
        A_eq=np.column_stack([rows, np.zeros(m)]),
        b_eq=wrench,
        A_ub=np.block([[-np.eye(n), np.ones((n, 1))], [np.eye(n), np.ones((n, 1))]]),
        b_ub=np.concatenate([-limits[:, 0], limits[:, 1]]),
        bounds=[(None, None)] * (n + 1),
    )
    assert found.status == 0
    return -found.fun


def test_the_cases_are_of_both_kinds(cases):
    margins = np.array([each[3] for each in cases])
    assert (margins > 0.01).sum() > 15
    assert (margins < -0.01).sum() > 15


@pytest.mark.parametrize("method", METHODS)
def test_no_tension_is_beyond_its_limits_and_what_it_says_is_so(method, cases, thesis):
    solver, limits = solver_of(thesis, method), limits_of(thesis)
    for rows, wrench, pose, room in cases:
        found = solver.step(wrench, row(pose), row(STILL))
        assert (found.tensions >= limits[:, 0]).all()
        assert (found.tensions <= limits[:, 1]).all()
        missing = np.linalg.norm(rows @ found.tensions - wrench[AXES])
        share = missing / np.linalg.norm(wrench[AXES])
        assert found.residual == pytest.approx(share, rel=1e-6, abs=1e-11)
        assert found.feasible == (found.residual <= 1e-6)
        if room < -1e-3:
            assert not found.feasible
        if method in COMPLETE and room > 1e-3:
            assert found.feasible


def test_the_simple_ones_miss_wrenches_that_can_be_met(cases, thesis):
    """Else there would be no need for the others; each in its place."""
    solvable = [each for each in cases if each[3] > 1e-3]
    met = {}
    for method in METHODS:
        solver = solver_of(thesis, method)
        found = [solver.step(wrench, row(pose), row(STILL)) for _, wrench, pose, _ in solvable]
        met[method] = sum(each.feasible for each in found)
    assert met["pseudo_inverse"] < met["removal"]
    assert met["closed_form"] < met["improved_closed_form"] <= len(solvable)
    assert met["qp"] == met["analytic_centre"] == len(solvable)


def test_the_analytic_centre_is_where_the_barriers_gradient_vanishes(cases, thesis):
    solver, limits = solver_of(thesis, "analytic_centre"), limits_of(thesis)
    for rows, wrench, pose, room in cases:
        if room > 0.05:
            t = solver.step(wrench, row(pose), row(STILL)).tensions
            gradient = 1.0 / (t - limits[:, 0]) - 1.0 / (limits[:, 1] - t)
            along = null_space(rows).T @ gradient
            assert np.abs(along).max() < 1e-4 * np.abs(gradient).max()


def test_the_quadratic_programme_is_least_squares_within_the_limits(cases, thesis):
    """Against a bounded least-squares solver that holds the wrench by a heavy weight."""
    solver, limits = solver_of(thesis, "qp", preferred_tension=6.0), limits_of(thesis)
    for rows, wrench, pose, room in cases:
        if room > 0.05:
            found = solver.step(wrench, row(pose), row(STILL)).tensions
            heavy = 1e5
            matrix = np.vstack([heavy * rows, np.eye(8)])
            wanted = np.concatenate([heavy * wrench[AXES], np.full(8, 6.0)])
            least = lsq_linear(matrix, wanted, limits.T, tol=1e-14)
            np.testing.assert_allclose(found, least.x, atol=2e-3)


@pytest.mark.parametrize("method", COMPLETE)
def test_where_none_is_there_it_is_the_nearest_wrench(method, cases, thesis):
    solver, limits = solver_of(thesis, method), limits_of(thesis)
    weights = WEIGHTS[AXES]
    for rows, wrench, pose, room in cases:
        if room < -0.05:
            found = solver.step(wrench, row(pose), row(STILL))
            least = lsq_linear(weights[:, None] * rows, weights * wrench[AXES], limits.T, tol=1e-14)
            missing = np.linalg.norm(weights * (rows @ found.tensions - wrench[AXES]))
            assert missing == pytest.approx(np.sqrt(2.0 * least.cost), rel=1e-4, abs=1e-5)
            assert found.saturated > 0


@pytest.mark.parametrize("method", COMPLETE)
def test_what_counts_more_is_missed_less(method, thesis):
    wrench = HOLD * [1.0, 1.0, 0.3, 1.0, 1.0, 1.0] + [6.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    rows = structure(thesis, HOME, STILL)
    missing = []
    for weight in (0.1, 10.0):
        solver = solver_of(thesis, method, wrench_weights=(1.0, 1.0, weight, 6.0, 6.0, 6.0))
        found = solver.step(wrench, row(HOME), row(STILL))
        assert not found.feasible
        missing.append(np.abs(rows @ found.tensions - wrench)[[0, 2]])
    (light_surge, light_heave), (heavy_surge, heavy_heave) = missing
    assert heavy_heave < 0.5 * light_heave
    assert heavy_surge > light_surge


@pytest.mark.parametrize("method", COMPLETE)
def test_tensions_do_not_jump_where_wrenches_cease_to_be_met(method, thesis):
    solver = solver_of(thesis, method)
    kinds, tensions = [], []
    for lift in np.linspace(1.0, 0.2, 801):
        found = solver.step(HOLD * lift + [1.0, 0.5, 0.0, 0.0, 0.2, 0.1], row(HOME), row(STILL))
        kinds.append(found.feasible)
        tensions.append(found.tensions)
    assert kinds[0]
    assert not kinds[-1]
    # 0.04 N of weight from one to the next.
    assert np.abs(np.diff(tensions, axis=0)).max() < 0.1


def test_removed_cables_stay_at_their_lower_limit(thesis):
    pose = np.array([0.12, 0.0, 2.0, 0.0, 0.0, 0.0])
    rows = structure(thesis, pose, STILL)[AXES]
    plain = np.linalg.pinv(rows) @ HOLD[AXES]
    assert (plain < 2.0).any()
    found = solver_of(thesis, "removal").step(HOLD, row(pose), row(STILL))
    assert found.feasible
    removed = np.isclose(found.tensions, 2.0, atol=1e-9)
    assert 1 <= removed.sum() <= 3
    left = ~removed
    rest = np.linalg.pinv(rows[:, left]) @ (HOLD[AXES] - 2.0 * rows[:, removed].sum(axis=1))
    np.testing.assert_allclose(found.tensions[left], rest, atol=1e-9)


@pytest.mark.parametrize("method", COMPLETE)
def test_with_roll_all_six_are_met(method, six_dof):
    solver = solver_of(six_dof, method, axes=range(6))
    wrench = HOLD + np.array([0.5, 0.5, 0.0, 0.05, 0.1, 0.1])
    found = solver.step(wrench, row(HOME), row(STILL))
    assert found.feasible
    np.testing.assert_allclose(structure(six_dof, HOME, STILL) @ found.tensions, wrench, atol=1e-4)


def test_the_changed_attachments_span_all_wrenches_and_the_thesis_ones_do_not(thesis, six_dof):
    all_six = structure(six_dof, HOME, STILL)
    assert np.linalg.cond(all_six) == pytest.approx(28.4, abs=0.1)
    assert np.linalg.matrix_rank(structure(thesis, HOME, STILL), rtol=1e-9) == 5


@pytest.mark.parametrize("method", COMPLETE)
def test_a_geometry_that_cannot_give_a_moment_gives_the_nearest_wrench(method):
    """Three cables that meet in a point: the moment is missed, the force is not."""
    testbed = build(point_content())
    solver = solver_of(testbed, method)
    found = solver.step(HOLD + np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0]), row(HOME), row(STILL))
    assert not found.feasible
    force = structure(testbed, HOME, STILL)[:3] @ found.tensions
    np.testing.assert_allclose(force, HOLD[:3], atol=1e-3)


def test_the_scenarios_lower_limit_takes_the_place_of_the_files(thesis):
    control = ClosedLoop(tension_distribution=HowDistributed(lower_limit=0.5))
    limits = wanted_tension_limits(control, thesis)
    np.testing.assert_array_equal(limits[:, 0], 0.5)
    np.testing.assert_array_equal(limits[:, 1], limits_of(thesis)[:, 1])
    with pytest.raises(InputError) as caught:
        wanted_tension_limits(
            ClosedLoop(tension_distribution=HowDistributed(lower_limit=20.0)), thesis
        )
    assert str(caught.value) == (
        "control.tension_distribution.lower_limit: 20 N, allowed: below the upper limit of sway_1"
    )


def test_the_analytic_centre_from_the_last_solution_is_the_one_from_amid_the_limits(thesis):
    """Whatever came before, to 1e-5 N: along a path, after a jump, and beyond what can be met."""
    kept, limits = solver_of(thesis, "analytic_centre"), limits_of(thesis)
    none, alone = np.zeros(0), np.empty(len(limits))
    random = np.random.default_rng(3)
    sizes = np.repeat([0.01, 0.3, 30.0, 300.0], 40)
    changes = [random.normal(0.0, size, 6) for size in sizes]
    for change in changes:
        wanted = HOLD + change * [1.0, 1.0, 1.0, 0.0, 0.1, 0.1]
        found = kept.step(wanted, row(HOME), row(STILL)).tensions
        analytic_centre(kept.structure, kept.wanted, limits, kept.weights, none, alone)
        np.testing.assert_allclose(found, alone, rtol=0.0, atol=1e-5)
