"""What a model's findings are fitted with, and which may be none."""

import numpy as np
import pytest
from run_samples import SCENARIOS

from cspm_ident.diagnosis.parameter import Coefficients, parameters_of
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.residuals.corrected_measurement import is_possible, nearest_possible
from cspm_ident.diagnosis.residuals.free_shapes import around
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.validation.found_model import _is_insignificant
from cspm_ident.signals.measurement import Measurement
from cspm_msgs_py.testbed import load_testbed
from cspm_sim.effects import catalogue

THESIS = load_testbed(SCENARIOS / "testbeds" / "thesis.yaml")


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
