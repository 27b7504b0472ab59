"""Of creep with several time constants the interval holds all, of which a recording shows some."""

import numpy as np
import pytest
from measured_samples import measured_with
from scipy.signal import butter, lfilter

from cspm_ident.diagnosis.parameter import Coefficients, parameters_of
from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.regression.coefficients import weights_of
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, is_seen_to_end
from cspm_ident.diagnosis.regression.time_constants import (
    covered_within,
    most_in_all,
    with_spectrum,
)
from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place, shapes_of
from cspm_ident.diagnosis.residuals.residual_equation import Equation, steady
from cspm_ident.diagnosis.selection.refinement import refine, spectra
from cspm_ident.diagnosis.selection.search_pass import noise_of
from cspm_sim.effects import Channel, catalogue
from cspm_sim.effects.signals import CableSignal

CREEP, PLACE = catalogue()["cable_creep"], Place(Channel.TENSION, "hoist_1")
DAMPING = catalogue()["cable_axial_damping"]
STEP, ROWS, BLOCK_S, NOISE = 0.02, 2100, 42.0 / 48.0, 0.05
STIFFNESS, COMPLIANCE = 1000.0, 1e-3
DURATION = STEP * ROWS
ONE, TWO = {2.2: 1.0}, {1.5: 0.5, 9.0: 0.5}
# What fits best as one part is as slow as that which is alone.
SHAPE = {"time_constant": 2.2}
FOUND = Candidate(CREEP, "hoist_1", tuple(SHAPE.items()))


def crept(tension, time_constant):
    """A Kelvin-Voigt element's elongation per compliance, from rest, by the bilinear rule [N]."""
    a = 0.5 * STEP / time_constant
    return lfilter([a / (1 + a), a / (1 + a)], [1.0, -(1 - a) / (1 + a)], tension - tension[0])


def gram(parts, seed):
    """Sums of a cable's residual with creep, of time constants with their shares, in a swell."""
    rng = np.random.default_rng(seed)
    swell = lfilter(*butter(1, (0.05, 0.5), "bandpass", fs=1.0 / STEP), rng.normal(size=ROWS))
    tension = 10.0 + 2.0 * swell / swell.std() * np.minimum(np.arange(ROWS) * STEP, 1.0)
    signals = np.ones((ROWS, len(CableSignal)))
    signals[:, CableSignal.TIME] = times = STEP * np.arange(ROWS)
    signals[:, CableSignal.TENSION], signals[:, CableSignal.DAMPER] = tension, 0.0
    signals[:, CableSignal.STIFFNESS] = STIFFNESS
    elongation = COMPLIANCE * sum(share * crept(tension, t) for t, share in parts.items())
    target = (-STIFFNESS * elongation + NOISE * rng.normal(size=ROWS))[:, None]
    effect = with_spectrum(CREEP, SHAPE, DURATION)
    columns = {
        Candidate(effect, "hoist_1", shape): CREEP.regressors(signals, **dict(shape))
        for shape in shapes_of(effect)
    }
    start = np.ones((ROWS, 1, 1))
    return gather([[Equation(PLACE, times, target, columns, target, start)]], BLOCK_S)


def ends(found):
    """The upper ends of the interval of one part and of two, in units of the compliance."""
    weight, half = weights_of(found, BlockRegression(found), [FOUND])[FOUND]
    one = (weight + half)[0]
    # Without a pair of positive parts nothing is added to one.
    most = most_in_all(found, FOUND, ())
    return one / COMPLIANCE, (one if most is None else most[0]) / COMPLIANCE


@pytest.mark.parametrize("seed", range(6))
def test_all_of_two_parts_is_held_where_one_alone_says_less(seed):
    one, two = ends(gram(TWO, seed))
    assert one < 0.9
    assert 1.0 <= two < 2.0


@pytest.mark.parametrize("seed", range(6))
def test_of_one_part_there_is_hardly_more(seed):
    one, two = ends(gram(ONE, seed))
    assert 1.0 < one < 1.02
    assert two < 1.15


def test_parts_are_those_of_the_grid_that_a_recording_can_show():
    (grid,) = with_spectrum(CREEP, {"time_constant": 2.3}, 42.0).signature.nonlinear.values()
    coarse = np.array([0.1, 0.3, 1.0, 3.0, 10.0, 30.0])
    between = np.sqrt(coarse[1:] * coarse[:-1])
    np.testing.assert_allclose(grid, np.sort([2.3, *coarse, *between]))
    other = catalogue()["cable_hysteresis"]
    assert not other.signature.spectrum
    (grid,) = with_spectrum(other, {"displacement": 2e-3}, 42.0).signature.nonlinear.values()
    assert grid == (2e-3,)


def test_no_time_constant_is_reported_that_outlasts_the_recording():
    short = covered_within(CREEP, 42.0)
    assert short.signature.nonlinear["time_constant"] == (0.1, 0.3, 1.0, 3.0, 10.0, 30.0)
    bounds = {p.name: (p.minimum, p.maximum) for p in short.parameters}
    assert bounds.pop("time_constant") == (0.01, 42.0)
    assert bounds == {p.name: (p.minimum, p.maximum) for p in CREEP.parameters if p.name in bounds}
    assert covered_within(CREEP, 0.05).signature.nonlinear["time_constant"] == (0.1,)
    other = catalogue()["cable_hysteresis"]
    assert covered_within(other, 42.0) is other


@pytest.mark.parametrize(("time_constant", "ends"), [(30.0, True), (41.9, False), (42.0, False)])
def test_a_memory_that_is_as_long_as_can_be_resolved_is_not_seen_to_end(time_constant, ends):
    shape = (("time_constant", time_constant),)
    creep = Candidate(covered_within(CREEP, 42.0), "surge_1", shape)
    other = Candidate(catalogue()["cable_hysteresis"], "surge_1", (("displacement", 0.003),))
    assert is_seen_to_end([creep, other]) is ends
    assert is_seen_to_end([other])


def test_a_spectrum_widens_upwards_only_what_is_reported():
    reported = Coefficients(FOUND, np.array([1e-3, 0.0]), np.array([1e-4, 1e-4]))
    plain = parameters_of(reported)
    assert [plain[0].low, plain[0].high] == pytest.approx([9e-4, 1.1e-3])
    for most, high in ((2e-3, 2e-3), (1e-3, 1.1e-3), (np.inf, 0.1)):
        wide = parameters_of(reported._replace(upper_ends=np.array([most, -np.inf])))
        assert (wide[0].value, wide[0].low) == (plain[0].value, plain[0].low)
        assert wide[0].high == pytest.approx(high)
        assert wide[1] == plain[1]


CREEPING = f"""  - effect: cable_creep
    elements: [hoist_1]
    parameters: {{compliance: {COMPLIANCE}, time_constant: {SHAPE["time_constant"]}}}
"""


@pytest.mark.slow
def test_parts_are_fitted_about_what_was_found_of_effects_with_a_spectrum_alone(tmp_path):
    overrides = "duration=16", "sensors=ideal"
    measured = measured_with(CREEPING, tmp_path / "bag", "worst_case_steep", *overrides)
    given = noise_of(steady([equations_of(measured, [])])), 0.5, lambda parts: parts
    damped = Hypothesis(DAMPING, (Candidate(DAMPING, "hoist_1"),))
    hypotheses = [Hypothesis(CREEP, (FOUND,)), damped]
    found = refine([measured], hypotheses, *given)
    ((crept, most),) = spectra([measured], hypotheses, found, *given).items()
    assert crept.effect_id == CREEP.id
    assert COMPLIANCE <= most[0] < 2.0 * COMPLIANCE
    only = {c: own for c, own in found.items() if c != crept}
    assert spectra([measured], [damped], only, *given) == {}
