"""Whether a small companion may be no more than the model-form error of a law beside it."""

import numpy as np
import pytest

from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, is_exact
from cspm_ident.diagnosis.regression.joint_fit import Fits
from cspm_ident.diagnosis.residuals.free_shapes import Knots
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_sim.effects import Channel, catalogue

ROWS, STEP, BLOCK_S = 4800, 0.01, 1.0
TIMES = STEP * np.arange(ROWS)
STRONG, WEAK = np.sin(2.1 * TIMES), np.sin(3.7 * TIMES)
SHAFT, TENSION = Place(Channel.SHAFT, "a"), Place(Channel.TENSION, "a")


def only(effect_id):
    effect = catalogue()[effect_id]
    shape = tuple((name, grid[0]) for name, grid in effect.signature.nonlinear.items())
    return Hypothesis(effect, (Candidate(effect, "a", shape),))


def equation(place, hypotheses, sizes):
    """A residual with so much of two effects, each a column that all residuals share."""
    noise = 0.01 * np.random.default_rng(5).standard_normal(ROWS)
    target = (noise + np.dot(sizes, (STRONG, WEAK)))[:, None]
    (strong,), (weak,) = (h.candidates for h in hypotheses)
    columns = {strong: STRONG[:, None, None], weak: WEAK[:, None, None]}
    return Equation(place, TIMES, target, columns, target)


def may_be_untruth(strong, weak, *residuals):
    """Ask of the weak one; each residual has a place and how much of either it has."""
    own = [only(strong), only(weak)]
    gram = gather([[equation(place, own, sizes) for place, sizes in residuals]], BLOCK_S)
    return Fits(gram, BlockRegression(gram)).may_be_untruth(own)[1]


@pytest.mark.parametrize(("size", "model_form_error"), [(0.06, True), (0.08, False)])
def test_a_companion_is_more_than_seven_hundredths_of_a_law(size, model_form_error):
    reported = "winch_viscous_friction", "winch_load_friction"
    assert may_be_untruth(*reported, (SHAFT, (1.0, size))) is model_form_error


@pytest.mark.parametrize(("elsewhere", "model_form_error"), [(0.0, True), (0.02, False)])
def test_it_is_held_against_what_the_law_takes_where_it_shows(elsewhere, model_form_error):
    """In a residual in which the law takes a tenth it shows by a fifth of that."""
    residuals = (SHAFT, (1.0, 0.02)), (TENSION, (0.1, elsewhere))
    assert (
        may_be_untruth("winch_viscous_friction", "winch_load_friction", *residuals)
        is model_form_error
    )


@pytest.mark.parametrize(
    ("strong", "exact"),
    [
        ("winch_viscous_friction", False),
        ("frame_flexibility", False),
        # The form of a delay is one: filters have others.
        ("tension_delay", False),
        ("cable_stiffness", True),
        ("tension_gain", True),
        ("bar_constant_wrench", True),
        ("winch_torque_offset", True),
    ],
)
def test_numbers_readings_and_constants_have_no_model_form_error(strong, exact):
    assert is_exact(catalogue()[strong]) is exact
    assert may_be_untruth(strong, "winch_load_friction", (SHAFT, (1.0, 0.01))) is not exact


@pytest.mark.parametrize(("signal", "form_error"), [(STRONG, True), (WEAK, False)])
def test_the_error_of_a_function_of_a_signal_is_a_function_of_that_signal(signal, form_error):
    """A companion by its own signal is none; one that is a function of the law's signal may be."""
    own = [only("winch_viscous_friction"), only("winch_load_friction")]
    shape = signal - np.mean(signal) if form_error else signal
    companion = np.abs(shape) if form_error else shape
    target = STRONG + 0.02 * companion + 0.01 * np.random.default_rng(6).standard_normal(ROWS)
    columns = {h.candidates[0]: c for h, c in zip(own, (STRONG, companion), strict=True)}
    columns = {c: values[:, None, None] for c, values in columns.items()}
    columns |= Knots().columns(SHAFT, {"speed [rad/s]": STRONG, "tension [N]": WEAK})
    made = Equation(SHAFT, TIMES, target[:, None], columns, target[:, None])
    gram = gather([[made]], BLOCK_S)
    assert Fits(gram, BlockRegression(gram)).may_be_untruth(own)[1] is form_error
