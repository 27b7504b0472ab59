"""Which findings stay in a model, and what it is fitted with."""

import numpy as np
import pytest
from run_samples import SCENARIOS

from cspm_ident.block_simulation import Input
from cspm_ident.diagnosis.finding import Finding, HoldOut, Improvement, Rejection, Status
from cspm_ident.diagnosis.parameter import Coefficients, parameters_of
from cspm_ident.diagnosis.regression.block_regression import Gain
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.residuals.corrected_measurement import is_possible, nearest_possible
from cspm_ident.diagnosis.residuals.free_shapes import around
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS
from cspm_ident.diagnosis.validation.found_model import (
    Assessment,
    Model,
    _is_insignificant,
    _needed,
)
from cspm_ident.diagnosis.validation.holdout_simulation import Output
from cspm_ident.signals.measurement import Measurement
from cspm_msgs_py.testbed import load_testbed
from cspm_sim.effects import Channel, catalogue

THESIS = load_testbed(SCENARIOS / "testbeds" / "thesis.yaml")
OUTPUT = Output(Input.SHAFT, "winches/angle/surge_2", "rad", "surge_2", Channel.SHAFT)
WORTH_IT = DEFAULT_THRESHOLDS.whole_share
EFFECTS = ("winch_coulomb_friction", "winch_viscous_friction", "bar_mass")


def finding(effect, share=None, holdout=HoldOut.CONFIRMED):
    """A finding with which a simulated error falls to a share of what it is without it."""
    candidate = Candidate(catalogue()[effect], "surge_1")
    gained = None if share is None else Improvement(OUTPUT.name, OUTPUT.unit, 2.0, 2.0 * share)
    hypothesis = Hypothesis(candidate.effect, (candidate,))
    return Finding(hypothesis, Gain(1.0, 0.1), 0.1, holdout=holdout, improvement=gained)


def model(shares, possible=None, wanted=None, unsure=None, harm=None):
    count = len(shares)
    columns = (
        possible or (True,) * count,
        unsure or (False,) * count,
        wanted or (WORTH_IT,) * count,
        harm or (0.0,) * count,
    )
    found = (finding(*each) for each in zip(EFFECTS, shares, strict=False))
    return Model(tuple(map(Assessment, found, *columns)), {})


def places(gone):
    """Return where in a model each rejected finding is."""
    assert all(each.status is Status.REJECTED for each in gone)
    return [EFFECTS.index(each.effect) for each in gone]


def reasons(gone):
    return [each.rejection for each in gone]


@pytest.mark.parametrize(
    ("shares", "gone"),
    [
        ((0.5, 0.98), []),
        ((0.5, 0.995), [1]),
        # One that harms may be why another seems of no use: that one is judged again without it.
        ((0.995, 1.2), [1]),
        ((None, 0.5), []),
        ((), []),
    ],
)
def test_the_worst_of_no_use_goes(shares, gone):
    assert places(model(shares).useless) == gone
    assert reasons(model(shares).useless) == [Rejection.NO_IMPROVEMENT] * len(gone)


@pytest.mark.parametrize(("share", "gone"), [(0.995, []), (1.005, [0])])
def test_what_moves_too_little_to_lower_an_error_by_much_has_to_lower_it(share, gone):
    assert places(model((share,), wanted=(1.0,)).useless) == gone
    assert places(model((share,)).useless) == [0]


@pytest.mark.parametrize(
    ("effect", "holdout", "needed"),
    [
        ("cable_creep", HoldOut.NOT_TESTED, WORTH_IT),
        ("cable_creep", HoldOut.CONFIRMED, WORTH_IT),
        ("cable_creep", HoldOut.FAINT, 1.0),
        ("cable_creep", HoldOut.SILENT, 1.0),
        ("cable_stiffness", HoldOut.CONFIRMED, 1.0),
        ("cable_creep", HoldOut.DOMINANT, np.inf),
        ("cable_stiffness", HoldOut.DOMINANT, np.inf),
    ],
)
def test_how_much_a_simulation_has_to_gain_by_what_else_is_known(effect, holdout, needed):
    assert _needed(finding(effect, holdout=holdout), DEFAULT_THRESHOLDS) == needed


def test_what_takes_most_of_a_residual_stays_though_no_simulation_gains():
    assert model((1.3,), wanted=(np.inf,)).useless == []
    assert places(model((1.3, 0.995), wanted=(np.inf, WORTH_IT)).useless) == [1]


def test_what_no_machine_can_have_goes_before_anything_is_judged():
    for found in (
        model((1.2, 0.5), (True, False)),
        model((1.2, 0.5), (True, False), unsure=(True, False)),
    ):
        assert places(found.useless) == [1]
        assert reasons(found.useless) == [Rejection.IMPOSSIBLE]


@pytest.mark.parametrize(
    ("possible", "unsure", "gone"),
    [((True, False), None, [1]), ((True, True), (True, True), [1]), ((True, True), None, [])],
)
def test_what_is_untenable_goes_though_nothing_is_held_out(possible, unsure, gone):
    """What is of no use or harms is decided by held-out data alone."""
    found = model((1.2, 0.5), possible, unsure=unsure, harm=(3.0, 0.0))
    assert places(found.untenable) == gone


def test_of_what_may_be_none_the_least_goes_then_what_harms_most():
    """Findings are in the order of their gains."""
    unsure = model((None,) * 3, unsure=(True, True, False)).useless
    assert (places(unsure), reasons(unsure)) == ([1], [Rejection.INSIGNIFICANT])
    harmful = model((1.2, 0.5, 0.5), harm=(0.0, 3.0, 2.0)).useless
    assert (places(harmful), reasons(harmful)) == ([1], [Rejection.DEGRADES_HOLDOUT])
    assert model((0.5, 0.5)).useless == []


@pytest.mark.parametrize(
    ("effect", "half", "unsure"),
    [
        ("winch_coulomb_friction", 0.021, True),
        ("winch_coulomb_friction", 0.019, False),
        # Nothing is known of where it ends, but that it is there.
        ("cable_hysteresis", 0.021, False),
        # The mean of what drifts is none of it.
        ("tension_bias", 0.021, False),
        ("tension_gain", 0.021, True),
        # What no data show may be anything, and is no reason to take it for none.
        ("winch_coulomb_friction", np.inf, False),
    ],
)
def test_what_may_be_none_is_insignificant(effect, half, unsure):
    shape = tuple((name, grid[0]) for name, grid in catalogue()[effect].signature.nonlinear.items())
    candidate = Candidate(catalogue()[effect], "surge_2", shape)
    weights = {candidate: (np.array([-0.02]), np.array([half]))}
    assert _is_insignificant(Hypothesis(candidate.effect, (candidate,)), weights) is unsure


def test_a_machine_has_no_inertia_that_no_body_has():
    measured = Measurement(SCENARIOS / "today", "ab" * 32, THESIS)
    inertia = Candidate(catalogue()["bar_inertia"], "bar")
    assert is_possible(measured, {inertia: np.array([0.0, 0.01, 0.01])})
    assert not is_possible(measured, {inertia: np.array([0.0, 0.3, 0.0])})


@pytest.mark.parametrize(("beyond", "possible"), [(0.002, True), (0.02, False)])
def test_an_inertia_that_no_body_has_is_the_nearest_that_one_has_if_chance_lies_between(
    beyond, possible
):
    measured = Measurement(SCENARIOS / "today", "ab" * 32, THESIS)
    own, half = Candidate(catalogue()["bar_inertia"], "bar"), np.array([6e-5, 3e-3, 1e-3])
    moments = THESIS.testbed.bar.inertia
    beside = moments.ixx + moments.izz - moments.iyy
    for found in (np.array([0.0, beside + beyond, 0.0]), np.array([0.0, 0.0, -beside - beyond])):
        assert not is_possible(measured, {own: found})
        moved = nearest_possible(measured, own, found, half)
        assert is_possible(measured, {own: moved}) is possible
        assert np.array_equal(moved, found) is not possible
        away = np.abs(moved - found) / half
        assert away[1] >= away[2] >= away[0]


def test_an_inertia_that_a_body_has_stays_as_found():
    measured = Measurement(SCENARIOS / "today", "ab" * 32, THESIS)
    own, found = Candidate(catalogue()["bar_inertia"], "bar"), np.array([0.0, 0.05, 0.05])
    np.testing.assert_array_equal(nearest_possible(measured, own, found, 0.1 * found), found)


def test_an_interval_ends_where_the_catalogue_does():
    drag = Candidate(catalogue()["winch_coulomb_friction"], "surge_2")
    cases = ((0.01, 0.004, (0.006, 0.014)), (0.0, 0.004, (0.0, 0.004)), (0.9, 0.2, (0.7, 1.0)))
    for value, half, ends in cases:
        (number,) = parameters_of(Coefficients(drag, np.array([value]), np.array([half])))
        assert (number.low, number.high) == pytest.approx(ends)


@pytest.mark.parametrize("phase", [0.3, np.pi / 4, 2.0, -np.pi / 4, -2.5])
def test_an_amplitude_is_as_sure_whatever_its_phase(phase):
    ripple = Candidate(catalogue()["winch_torque_ripple"], "surge_2", (("order", 6.0),))
    weights = 0.02 * np.array([np.cos(phase), np.sin(phase)])
    own = Coefficients(ripple, weights, np.array([0.001, 0.001]))
    amplitude, order, angle = parameters_of(own)
    assert (amplitude.low, amplitude.high) == pytest.approx((0.019, 0.021), abs=5e-5)
    assert order.ci95 is None
    assert (angle.low, angle.high) == pytest.approx((phase - 0.05, phase + 0.05), abs=2e-3)


def test_of_an_amplitude_one_part_of_which_may_be_none_the_other_is_left():
    ripple = Candidate(catalogue()["winch_torque_ripple"], "surge_2", (("order", 6.0),))
    own = Coefficients(ripple, np.array([0.02, 0.003]), np.array([0.001, 0.01]))
    amplitude = parameters_of(own)[0]
    assert amplitude.low == pytest.approx(0.019, abs=3e-4)
    assert amplitude.high == pytest.approx(np.hypot(0.02, 0.013), abs=3e-4)


def test_what_lies_around_a_row_has_none_of_its_noise():
    noise = np.random.default_rng(3).standard_normal(20_000)
    assert abs(np.corrcoef(noise, around(noise, 4))[0, 1]) < 0.03
    assert abs(np.corrcoef(noise, around(noise, 0))[0, 1]) > 0.99
    line = np.arange(100.0)
    np.testing.assert_allclose(around(line, 4)[4:-4], line[4:-4])
