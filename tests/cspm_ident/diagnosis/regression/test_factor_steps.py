"""Factors of the file that are far from 1, where a first-order step would be negative."""

import numpy as np
import pytest

from cspm_ident.diagnosis.regression.hypothesis import factors_of, is_allowed
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.selection.refinement import _corrected
from cspm_sim.effects import catalogue

STIFF = Candidate(catalogue()["cable_stiffness"], "a")
LONG = Candidate(catalogue()["cable_length_offset"], "a")
GAIN = Candidate(catalogue()["winch_torque_gain"], "a")


def test_only_corrections_that_multiply_are_factors():
    assert factors_of(STIFF.effect).tolist() == [True]
    assert factors_of(LONG.effect).tolist() == [False]
    # It is physics of the plant: its weight is exact, and is no step of a correction.
    assert factors_of(GAIN.effect).tolist() == [False]


@pytest.mark.parametrize("scale", [0.2, 0.45, 1.0, 2.0, 5.0])
def test_steps_of_first_order_reach_any_factor(scale):
    """To first order a measured tension shows 1 − k/s of a stiffness k that should be s."""
    value, half = np.zeros(1), np.array([0.1])
    for _ in range(12):
        step = 1.0 - (1.0 + value) / scale
        value, _ = _corrected(STIFF.effect, value, step, half)
        assert value[0] > -1.0
    assert 1.0 + value[0] == pytest.approx(scale, rel=1e-3)


def test_an_offset_is_added_and_a_factor_multiplied():
    value, half = _corrected(LONG.effect, np.array([0.2]), np.array([0.1]), np.array([0.01]))
    assert (value[0], half[0]) == pytest.approx((0.3, 0.01))
    value, half = _corrected(STIFF.effect, np.array([1.0]), np.array([0.1]), np.array([0.01]))
    assert (value[0], half[0]) == pytest.approx((2.0 * np.exp(0.1) - 1.0, 0.02 * np.exp(0.1)))


@pytest.mark.parametrize(
    ("candidate", "weight", "allowed"),
    [
        (STIFF, -1.2, True),  # a third of the stiffness
        (STIFF, -3.0, False),
        (STIFF, 8.5, True),
        (STIFF, 20.0, False),
        (STIFF, 1e6, False),
        (LONG, -11.0, False),
        (GAIN, -0.7, True),  # as 1/(1 + 0.7): 0.59 of the true one
        (GAIN, -1.2, False),
    ],
)
def test_a_weight_is_allowed_as_a_step_or_as_its_exponential(candidate, weight, allowed):
    assert is_allowed(candidate, np.array([weight])) is allowed
