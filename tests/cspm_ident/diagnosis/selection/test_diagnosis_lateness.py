"""Readings that are late, or would be early: which of two clocks is reported."""

import numpy as np
import pytest

from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.hypothesis import (
    Hypothesis,
    is_early,
    is_timing,
    may_be_negligible,
)
from cspm_ident.diagnosis.regression.parameter_estimates import of_clocks
from cspm_ident.diagnosis.residuals.free_shapes import Knots
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.selection.search import Search
from cspm_sim.effects import Channel, catalogue

ROWS, STEP, BLOCK_S = 2400, 0.01, 0.5
TRACKER, CELLS = catalogue()["pose_delay"], catalogue()["tension_delay"]
DRAG = catalogue()["winch_viscous_friction"]
CLOCK = 2.5e-4  # as well as clocks are set to each other [s]
STAMP = 1e-3  # as well as a log stamps what it takes too early [s]
POSE, TENSION = Candidate(TRACKER, "bar"), Candidate(CELLS, "load_cells")


def cable(delay, apart=0.0, noise=0.05, seed=5):
    """One cable's tension under locked winches, its pose late by `delay` [s].

    Its pose, in which `apart` is noise, and its load cells show the same with opposite signs.
    """
    rng = np.random.default_rng(seed)
    times = STEP * np.arange(ROWS)
    rate = 100.0 * (np.sin(2.1 * times) + 0.6 * np.sin(0.83 * times))
    target = delay * rate + noise * rng.standard_normal(ROWS)
    read = rate + apart * np.std(rate) * rng.standard_normal(ROWS)
    columns = {POSE: read, TENSION: -rate}
    shaped = {term: values[:, None, None] for term, values in columns.items()}
    place = Place(Channel.TENSION, "surge_1")
    return Equation(place, times, target[:, None], shaped, target[:, None])


def named(equation):
    return [each.hypothesis for each in Search(gather([[equation]], BLOCK_S)).run().findings]


@pytest.mark.parametrize("apart", [0.0, 0.1])
@pytest.mark.parametrize("delay", [0.003, -0.003])
def test_what_is_late_is_reported_of_two_that_explain_the_same(delay, apart):
    """Also where the noise of its readings makes it explain a hundredth less."""
    late = TRACKER if delay > 0.0 else CELLS
    assert [h.effect for h in named(cable(delay, apart))] == [late]


def test_what_explains_much_more_is_reported_though_it_be_early():
    assert [h.effect for h in named(cable(0.003, apart=0.6))] == [CELLS]


def rig(delay, drag=0.0, like=1.0, seed=7):
    """One winch's torque, load cells late by `delay` [s] and grease; tension follows the angle.

    `like` is how much of the speed's column is that of the tension's rate.
    """
    rng = np.random.default_rng(seed)
    times = STEP * np.arange(ROWS)
    rate = 100.0 * (np.sin(2.1 * times) + 0.6 * np.sin(0.83 * times))
    other = 100.0 * np.cos(1.3 * times)
    speed = like * rate + np.sqrt(1.0 - like**2) * other
    target = delay * rate + drag * speed + 2e-3 * rng.standard_normal(ROWS)
    columns = {Candidate(DRAG, "surge"): -speed, TENSION: rate}
    shaped = {term: values[:, None, None] for term, values in columns.items()}
    place = Place(Channel.SHAFT, "surge")
    return Equation(place, times, target[:, None], shaped, target[:, None])


@pytest.mark.parametrize(
    ("delay", "drag", "like", "reported"),
    [
        (-0.6 * CLOCK, 0.0, -1.0, [CELLS]),
        (0.0, -2.0 * CLOCK, -0.98, [DRAG]),
        (0.0, -0.6 * CLOCK, -0.5, [DRAG]),
    ],
)
def test_what_healthy_clocks_explain_as_well_is_theirs(delay, drag, like, reported):
    """Where they would have to lie farther apart, or explain less, it is friction."""
    assert [h.effect for h in named(rig(delay, drag, like))] == reported


def test_only_effects_on_stamps_are_early_and_only_below_zero():
    def early(candidate, value):
        return is_early({candidate: np.array([value])}, Hypothesis(candidate.effect, (candidate,)))

    assert [is_timing(effect) for effect in (TRACKER, CELLS, DRAG)] == [True, True, False]
    assert early(TENSION, -1.1 * STAMP)
    assert not early(TENSION, 1.1 * STAMP)
    assert not early(TENSION, -0.9 * STAMP)
    assert not early(Candidate(DRAG, "surge_1"), -1.0)


def test_early_readings_beside_late_ones_say_the_same_again():
    search = Search(gather([[cable(0.003, apart=0.1)]], BLOCK_S))
    late, early = Hypothesis(TRACKER, (POSE,)), Hypothesis(CELLS, (TENSION,))
    drag = Hypothesis(DRAG, (Candidate(DRAG, "surge_1"),))
    assert search.fits.contradicts(early, [late])
    assert not search.fits.contradicts(early, [])
    assert not search.fits.contradicts(drag, [late])


@pytest.mark.parametrize(("half", "reported"), [(0.2 * CLOCK, True), (0.7 * CLOCK, False)])
def test_a_delay_counts_from_where_its_interval_leaves_what_clocks_may_be_apart(half, reported):
    for sign in (1.0, -1.0):
        found = {POSE: (np.array([sign * 1.5 * CLOCK]), np.array([half]))}
        assert may_be_negligible(found) is not reported


@pytest.mark.parametrize(("delay", "reported"), [(1.9 * CLOCK, False), (2.1 * CLOCK, True)])
def test_a_delay_between_two_clocks_counts_from_twice_what_one_may_be_off(delay, reported):
    for candidate, least in ((TENSION, 0.0), (TENSION, CLOCK - STAMP), (POSE, 0.0)):
        sign = 1.0 if least == 0.0 else -1.0
        value = np.array([sign * delay + least])
        found = of_clocks({candidate: (value, np.array([0.01 * CLOCK]))})
        assert may_be_negligible(found) is not reported


@pytest.mark.parametrize(("delay", "reported"), [(0.5 * CLOCK, False), (4.0 * CLOCK, True)])
def test_what_healthy_clocks_may_have_done_is_nothing_unknown(delay, reported):
    """A slow motion's delay is a function of time, of which clocks explain what clocks may do."""
    times = STEP * np.arange(ROWS)
    rate = 2000.0 * np.sin(0.5 * times)
    noise = 0.05 * np.random.default_rng(6).standard_normal(ROWS)
    target = (delay * rate + noise)[:, None]
    place = Place(Channel.TENSION, "surge_1")
    columns = {POSE: rate[:, None, None], **Knots().columns(place, {"time [s]": times})}
    search = Search(gather([[Equation(place, times, target, columns, target)]], BLOCK_S))
    assert search._unexplained([], [])
    assert bool(search.unexplained([])) is reported
