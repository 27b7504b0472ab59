"""Functions of drivers that describe a residual: which are found, and in which shape."""

import numpy as np
import pytest

from cspm_ident.diagnosis.empirical.constrained_fit import (
    FOLDS,
    fitted,
    folds_of,
    is_better,
    sums_of,
)
from cspm_ident.diagnosis.empirical.table_basis import Constraint, Term, axis_of
from cspm_ident.diagnosis.empirical.table_choice import Drivers, chosen

ROWS = 4000
TIMES = 0.01 * np.arange(ROWS)
FOLD = folds_of(TIMES, 1.0)


def signals(seed=3):
    rng = np.random.default_rng(seed)
    parts = [np.interp(TIMES, TIMES[::50], rng.normal(size=ROWS // 50)) for _ in range(3)]
    speed, tension, angle = parts
    return {"speed": 3.0 * speed, "tension": 30.0 + 6.0 * tension, "angle": angle}


def residual(function, noise=1.0, seed=5):
    own = signals()
    return function(own) + noise * np.random.default_rng(seed).standard_normal(ROWS)


def plan_of(target, opposes=1, planes=True):
    own = signals()
    moving = np.abs(own["speed"]) > 0.2
    kept = {name: values[moving] for name, values in own.items()}
    drivers = Drivers(target[moving], kept, FOLD[moving], {"speed": opposes}, planes)
    plan = chosen(drivers, 0.15, 0.15)
    if plan is None:
        return None, None, drivers
    columns = np.hstack([term.columns(kept) for term in plan.terms])
    return plan, columns @ fitted(sums_of(columns, drivers.target, drivers.folds), plan), drivers


def names(plan):
    return [[axis.name for axis in term.axes] for term in plan.terms]


def left(model, drivers):
    return np.sqrt(np.mean((drivers.target - model) ** 2))


def test_a_function_of_one_driver_is_found_and_leaves_the_noise():
    plan, model, drivers = plan_of(residual(lambda s: 8.0 * np.exp(-(s["angle"] ** 2))))
    assert names(plan) == [["angle"]]
    assert left(model, drivers) == pytest.approx(1.0, abs=0.05)


def test_a_function_that_jumps_where_the_speed_changes_sign_is_followed():
    plan, model, drivers = plan_of(residual(lambda s: 5.0 * np.sign(s["speed"])))
    assert names(plan) == [["speed"]]
    assert plan.constraints[0] is Constraint.MONOTONE
    assert left(model, drivers) == pytest.approx(1.0, abs=0.05)


def test_a_product_of_two_drivers_needs_both():
    def product(s):
        return 0.4 * (s["tension"] - 20.0) * np.sign(s["speed"])

    plan, model, drivers = plan_of(residual(product))
    assert sorted(names(plan)[0]) == ["speed", "tension"]
    assert left(model, drivers) < 1.1
    _, model, drivers = plan_of(residual(product), planes=False)
    assert left(model, drivers) > 1.5


def test_two_functions_that_add_up_are_both_found():
    target = residual(lambda s: 4.0 * np.tanh(s["speed"]) + 6.0 * np.sin(2.0 * s["angle"]))
    plan, model, drivers = plan_of(target, planes=False)
    assert sorted(names(plan)) == [["angle"], ["speed"]]
    assert left(model, drivers) == pytest.approx(1.0, abs=0.06)


def test_noise_alone_is_not_described():
    found = [plan_of(residual(lambda s: 0.0 * s["speed"], seed=seed))[0] for seed in range(20)]
    assert found == [None] * 20


@pytest.mark.parametrize("opposes", [1, -1])
def test_what_takes_energy_out_is_dissipative_and_what_brings_it_in_is_free(opposes):
    """The constraint's sign: a wrench opposes with the other sign than a resisting torque."""
    target = residual(lambda s: 5.0 * opposes * np.tanh(s["speed"]))
    plan, _, _ = plan_of(target, opposes)
    assert plan.constraints[0] is Constraint.MONOTONE
    plan, model, drivers = plan_of(-target, opposes)
    assert plan.constraints[0] is Constraint.FREE
    assert left(model, drivers) == pytest.approx(1.0, abs=0.05)


def test_friction_that_differs_by_direction_is_dissipative_and_not_odd():
    target = residual(lambda s: np.where(s["speed"] > 0.0, 9.0, -2.0))
    plan, model, drivers = plan_of(target)
    assert plan.constraints[0] is Constraint.DISSIPATIVE
    assert left(model, drivers) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("constraint", [c for c in Constraint if c is not Constraint.FREE])
def test_a_constraint_holds_for_whatever_numbers_are_not_negative(constraint):
    axis = axis_of("speed", signals()["speed"][np.abs(signals()["speed"]) > 0.2], 1)
    numbers = np.random.default_rng(2).uniform(0.0, 1.0, Term((axis,)).map(constraint).shape[1])
    values = Term((axis,)).map(constraint) @ numbers
    assert np.all(values * axis.knots >= 0.0)
    if constraint is not Constraint.DISSIPATIVE:
        assert values == pytest.approx(-values[::-1])
    if constraint is Constraint.MONOTONE:
        assert np.all(np.diff(values) >= -1e-12)


def test_a_straight_line_is_not_rough_and_a_jump_at_rest_is_not_either():
    values = signals()["speed"][np.abs(signals()["speed"]) > 0.2]
    free, jumping = axis_of("tension", values), axis_of("speed", values, 1)
    assert free.roughness @ free.knots == pytest.approx(np.zeros(len(free.roughness)), abs=1e-9)
    step = np.sign(jumping.knots)
    assert jumping.roughness @ step == pytest.approx(np.zeros(len(jumping.roughness)), abs=1e-9)
    assert np.abs(free.roughness @ np.abs(free.knots)).max() > 0.1


def test_motion_in_one_direction_has_knots_in_one_direction():
    axis = axis_of("speed", np.abs(signals()["speed"]) + 0.1, 1)
    assert axis.knots[0] > 0.0
    assert not axis.is_symmetric
    assert Term((axis,)).constraints == (Constraint.DISSIPATIVE, Constraint.FREE)


def test_a_driver_that_stands_still_has_no_knots():
    assert axis_of("tension", np.full(100, 3.0)) is None


def test_better_means_by_more_than_the_scatter_between_folds():
    before = np.full(FOLDS, 2.0)
    assert is_better(before, before - np.array([0.1, 0.12, 0.09, 0.1, 0.11]))
    assert not is_better(before, before - np.array([1.0, -1.0, 0.6, -0.5, 0.1]))


@pytest.mark.parametrize(("jumps", "near_rest"), [(True, 4.0), (False, 0.0)])
def test_a_function_of_a_speed_keeps_its_value_to_rest_or_passes_through_zero(jumps, near_rest):
    speed = signals()["speed"][np.abs(signals()["speed"]) > 0.2]
    term = Term((axis_of("speed", speed, 1),)).jumping(jumps=jumps)
    axis, values = term.axes[0], 4.0 * np.sign(term.axes[0].knots)
    table = term.tie @ values
    assert np.interp(0.001, axis.tabled_knots, table) == pytest.approx(near_rest, abs=0.03)
    assert np.interp(-0.001, axis.tabled_knots, table) == pytest.approx(-near_rest, abs=0.03)
    assert np.interp(1.0, axis.tabled_knots, table) == pytest.approx(4.0)
    at = np.array([-1.0, 0.001, 0.5])
    assert term.columns({"speed": at}) @ values == pytest.approx(
        np.interp(at, axis.tabled_knots, table)
    )
