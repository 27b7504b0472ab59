"""The plan of a governor, judged by linear programmes and by a bar that can only fall."""

import numpy as np
import pytest
from run_samples import bundle_of
from scipy.optimize import linprog, lsq_linear
from structure_samples import structure

from bench.results.feasibility import REFERENCES, least_errors
from bench.results.tracking import Case, follow, motions_of_bundle
from cspm_control.controllers.bar_dynamics import bar_parameters, wrench_for
from cspm_control.controllers.governor import SMOOTH, SPACING, Governed, plan_deviation
from cspm_control.stages.make import planned_tension_limits
from cspm_control.waves.moves import move_knots
from cspm_model.motion import Motion
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.dofs import CONTROLLED_AXES
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.motion_spec import Move
from cspm_msgs_py.scenario import Governor

HOME = np.array([0.0, 0.0, 2.0, 0.0, 0.0, 0.0])
FRAME = Motion.still(np.zeros(6))
LOWER, DURATION = 0.5, 4.0
AXES = list(CONTROLLED_AXES)


def moved(by, *, within, at=2.0):
    """Return a motion from HOME and the time of its middle."""
    knots, spacing = move_knots((Move(at=at, duration=within, by=by),))
    knots[:, :6] += HOME
    return Motion(knots, spacing)


@pytest.fixture(scope="module")
def machine(thesis):
    return Governed(
        nominal_parameters(thesis).cables,
        bar_parameters(thesis.bar, thesis.gravity),
        np.array([(LOWER, cable.tension_limits[1]) for cable in thesis.cables]),
        CONTROLLED_AXES,
        np.array([0.002] * 3 + [0.004] * 3),
        np.zeros(6),
    )


@pytest.fixture(scope="module")
def dropped():
    """Half a metre down in 0.4 s takes 18 m/s² at first, more than gravity gives."""
    return moved([0.0, 0.0, 0.5, 0.0, 0.0, 0.0], within=0.4)


@pytest.fixture(scope="module")
def aside():
    return moved([0.05, 0.06, 0.1, 0.0, 0.05, 0.02], within=0.24)


def room(thesis, machine, row, frame=HOME * 0.0):
    """Return the highest least tension [N] that gives a motion row (18,) its acceleration."""
    pose, rate, acceleration = row.reshape(3, 6)
    wrench, n = np.empty(6), len(machine.cables)
    wrench_for(pose, rate, acceleration, machine.bar, wrench)
    found = linprog(
        np.append(np.zeros(n), -1.0),
        A_eq=np.column_stack([structure(thesis, pose, frame)[AXES], np.zeros(5)]),
        b_eq=wrench[AXES],
        A_ub=np.column_stack([-np.eye(n), np.ones(n)]),
        b_ub=np.zeros(n),
        bounds=[(None, limit) for limit in machine.limits[:, 1]] + [(None, None)],
    )
    return -found.fun if found.status == 0 else -np.inf


def test_what_can_be_followed_is_left_alone(machine):
    gentle = moved([0.02, 0.02, 0.1, 0.0, 0.02, 0.02], within=1.0)
    plan = plan_deviation(machine, gentle, FRAME, DURATION, 1.0)
    assert not plan.knots.any()


@pytest.mark.parametrize("name", ["dropped", "aside"])
def test_the_plan_can_be_followed_and_the_reference_cannot(thesis, machine, name, request):
    wanted = request.getfixturevalue(name)
    plan = plan_deviation(machine, wanted, FRAME, DURATION, 1.0)
    times = np.arange(1.0, 3.4, 3 * SPACING)
    asked = [room(thesis, machine, wanted.at(t)) for t in times]
    given = [room(thesis, machine, wanted.at(t) + plan.at(t)) for t in times]
    assert min(asked) < 0.0
    assert min(given) > LOWER - 0.002
    assert np.abs(plan.knots[:, 3::6]).max() == 0.0


def test_between_knots_waves_bend_too_little_to_matter(machine):
    bundle = bundle_of("worst_case_steep_past_thesis", "duration=17.0")
    bar, frame = (motions_of_bundle(bundle)[name] for name in REFERENCES)
    plan = plan_deviation(machine, bar, frame, 17.0, 0.5)
    away = SPACING * np.flatnonzero(plan.knots.any(axis=1))
    times = np.arange(away[0], away[-1], 2 * SPACING) + 0.5 * SPACING
    testbed = bundle.testbed.testbed
    given = [room(testbed, machine, bar.at(t) + plan.at(t), frame.at(t)[:6]) for t in times]
    assert LOWER - 0.03 < min(given) < LOWER + 0.1


def test_a_bar_that_can_only_fall_is_led_as_bounded_least_squares_would(machine, dropped):
    """Amid symmetric cables a drop is a double integrator whose acceleration has an upper bound."""
    plan = plan_deviation(machine, dropped, FRAME, DURATION, 1.0)
    times = SPACING * np.arange(len(plan.knots))
    wanted = np.array([dropped.at(t) for t in times])
    actual = wanted + plan.knots
    away = np.flatnonzero(plan.knots[:, 2])
    window = slice(away[0] - 1, away[-1] + 2)
    # What least tensions leave of gravity at the heights that were planned.
    fall = np.array([9.81 - LOWER * upward(machine, row[:6]) / 4.06 for row in actual[window]])
    led = bounded(fall - wanted[window, 14])
    np.testing.assert_allclose(plan.knots[window, 2], led, atol=2e-4 * np.abs(led).max() + 2e-5)
    others = np.abs(plan.knots[:, [0, 1, 4, 5]]).max()
    assert others < 1e-5 < 1e-2 < np.abs(led).max()


def upward(machine, pose):
    """Return the sum over the cables of how far up each points."""
    from cspm_model.kinematics import geometry

    return float(geometry(machine.cables, pose, np.zeros(6)).bar[:, 2].sum())


def bounded(limit):
    """Return the places of least squares of places and acceleration changes, below a `limit`."""
    n, h, tolerance = len(limit), SPACING, 0.002
    place, rate = np.zeros((n, n)), np.zeros((n, n))
    for k in range(n - 1):
        rate[k + 1], place[k + 1] = rate[k], place[k] + h * rate[k]
        rate[k + 1, k : k + 2] += 0.5 * h
        place[k + 1, k] += h**2 / 3.0
        place[k + 1, k + 1] += h**2 / 6.0
    ends = 1e4 * np.vstack([place[-1:], h * rate[-1:]])
    changes = np.sqrt(SMOOTH) * h**2 * np.diff(np.eye(n), axis=0)
    high = np.where(np.arange(n) % (n - 1) == 0, 1e-9, limit)
    low = np.where(np.arange(n) % (n - 1) == 0, -1e-9, -np.inf)
    rows = np.vstack([place, changes, ends]) / tolerance
    return place @ lsq_linear(rows, np.zeros(len(rows)), (low, high), method="bvls").x


def test_it_falls_before_its_reference_does_and_that_takes_a_third_of_the_error(machine, dropped):
    long, short = (
        plan_deviation(machine, dropped, FRAME, DURATION, preview) for preview in (1.0, 0.1)
    )
    # The reference falls from here on; z is down.
    assert long.at(2.0)[8] > 0.1
    assert np.abs(long.knots[:, 2]).max() < 0.7 * np.abs(short.knots[:, 2]).max()


def test_a_known_force_upward_is_gravity_that_is_missing(thesis, machine, dropped):
    lift = 0.2 * thesis.bar.mass * thesis.gravity
    lighter = machine._replace(bar=bar_parameters(thesis.bar, 0.8 * thesis.gravity))
    lifted, plain = (
        machine._replace(known_wrench=np.array([0.0, 0.0, force, 0.0, 0.0, 0.0]))
        for force in (-lift, 0.0)
    )
    as_lifted, as_lighter, as_plain = (
        plan_deviation(each, dropped, FRAME, DURATION, 1.0).knots
        for each in (lifted, lighter, plain)
    )
    np.testing.assert_allclose(as_lifted[:, :6], as_lighter[:, :6], atol=1e-6)
    assert np.abs(as_lifted[:, 2]).max() > 1.2 * np.abs(as_plain[:, 2]).max()


def test_no_further_ahead_than_is_known(machine, dropped):
    plan = plan_deviation(machine, dropped, FRAME, DURATION, 0.5)
    away = SPACING * np.flatnonzero(plan.knots.any(axis=1))
    assert 1.5 <= away[0] < 2.0
    assert 2.2 < away[-1] <= 2.9


def test_a_run_may_be_shorter_than_the_preview_and_end_amid_a_drop(machine, dropped):
    plan = plan_deviation(machine, dropped, FRAME, 2.1, 3.0)
    assert np.abs(plan.knots[0, [2, 8]]).max() < 1e-9
    assert abs(plan.at(2.1)[2]) > 1e-3


def test_more_reserve_takes_more_deviation(thesis, machine, aside):
    sizes = []
    for lower in (0.0, LOWER, 1.0):
        limits = machine.limits.copy()
        limits[:, 0] = lower
        plan = plan_deviation(machine._replace(limits=limits), aside, FRAME, DURATION, 1.0)
        sizes.append(np.linalg.norm(plan.knots[:, :3]))
    assert 0.0 < sizes[0] < sizes[1] < sizes[2]


def test_a_weight_on_what_exceeds_the_tolerance_gathers_it_in_fewer_knots(machine, aside):
    squares, gathered = (
        plan_deviation(machine, aside, FRAME, DURATION, 1.0, weight).knots[:, :6]
        for weight in (0.0, 30.0)
    )
    beyond = [(np.abs(each) > machine.tolerances).any(axis=1) for each in (squares, gathered)]
    assert beyond[1].sum() < 0.8 * beyond[0].sum()
    assert np.linalg.norm(gathered / machine.tolerances) < 1.3 * np.linalg.norm(
        squares / machine.tolerances
    )


def test_a_plan_that_exceeds_no_tolerance_is_as_without_the_weight(machine, aside):
    tolerant = machine._replace(tolerances=10.0 * machine.tolerances)
    plain, weighted = (
        plan_deviation(tolerant, aside, FRAME, DURATION, 1.0, weight).knots[:, :6]
        for weight in (0.0, 30.0)
    )
    assert np.abs(plain).max() > 1e-3
    np.testing.assert_allclose(weighted, plain, atol=1e-5)


def test_excess_is_free_where_not_even_tensions_from_zero_would_do(thesis, machine, dropped):
    """A drop faster than gravity: no bar could follow while it lasts."""
    plain, weighted = (
        plan_deviation(machine, dropped, FRAME, DURATION, 1.0, weight).knots[:, 2]
        for weight in (0.0, 30.0)
    )
    times = SPACING * np.arange(len(plain))
    possible = np.array([room(thesis, machine, dropped.at(t)) >= 0.0 for t in times])
    before, after = (np.abs(each) > machine.tolerances[2] for each in (plain, weighted))
    assert after[possible].sum() < 0.7 * before[possible].sum()
    assert np.abs(weighted[~possible]).max() > 2.0 * machine.tolerances[2]


def test_reserve_is_added_to_the_lower_limit_of_the_scenario():
    bundle = bundle_of("worst_case_steep_past_thesis")
    control, testbed = bundle.scenario.control, bundle.testbed.testbed
    limits = planned_tension_limits(control, Governor(reserve=0.25), testbed)
    assert limits[:, 0] == pytest.approx(control.tension_distribution.lower_limit + 0.25)
    with pytest.raises(InputError) as caught:
        planned_tension_limits(control, Governor(reserve=100.0), testbed)
    assert str(caught.value) == (
        "control.motion.governor.reserve: 100 N, allowed: less than what is between the tension"
        " limits of hoist_1"
    )


@pytest.mark.slow
def test_a_drop_faster_than_gravity_is_met_better_by_a_third_on_either_plant():
    drop = (
        "duration=3.0",
        "winch_frame.motion={type: still}",
        "target.motion={type: moves, moves: [{at: 1.0, duration: 0.4, by: [0,0,0.5,0,0,0]}]}",
    )
    for plant in ("sim", "mujoco"):
        largest = []
        for governor in ("null", "{preview: 1.0}"):
            case = Case(
                "worst_case_steep_past_thesis",
                (*drop, f"control.motion.governor={governor}"),
                plant=plant,
            )
            errors, tensions, _, failure = follow(case.bundle())
            assert failure == ""
            largest.append(np.abs(errors[:, 2]).max())
        assert largest[1] < 0.7 * largest[0]
        assert tensions.min() > 0.0


@pytest.mark.slow
def test_at_four_metres_no_cable_goes_slack_and_not_much_more_is_lost_than_must_be():
    steep = [f"{body}.motion.peak_period=2.31" for body in ("winch_frame", "target")]
    bundle = Case("worst_case_4m_past_thesis", ("duration=17.0", *steep)).bundle()
    errors, tensions, _, failure = follow(bundle)
    assert failure == ""
    assert tensions.min() > 0.0
    lost, least = np.sqrt((errors**2).mean(axis=0)), least_errors(bundle)
    assert 1e-3 < least[0] < lost[0] < 2.0 * least[0]
