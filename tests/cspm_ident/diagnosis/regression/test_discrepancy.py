"""How far unexplained functions of the signals may move the weights of findings."""

import numpy as np
import pytest

from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.regression.discrepancy import moved_by_functions
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.regression.joint_fit import Fits
from cspm_ident.diagnosis.residuals.free_shapes import Knots
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_sim.effects import Channel, catalogue

ROWS, BLOCK_S = 3000, 1.0
TIMES = 0.01 * np.arange(ROWS)
PLACE = Place(Channel.SHAFT, "only")
VISCOUS = catalogue()["winch_viscous_friction"]
TRUE = 0.05


def winch(law, signals, noise=0.01, seed=0):
    """A winch with viscous friction and another law, and free functions of some signals."""
    speed = signals["speed [rad/s]"]
    free = Knots().columns(PLACE, signals)
    columns = {Candidate(VISCOUS, "only"): -speed[:, None, None], **free}
    rough = np.random.default_rng(seed).normal(0.0, noise, ROWS)
    target = (-TRUE * speed + law + rough)[:, None]
    return Equation(PLACE, TIMES, target, columns, target)


def fitted(law, signals, seed=0):
    """The viscous friction's weight, and how far a function may move it."""
    gram = gather([[winch(law, signals, seed=seed)]], BLOCK_S)
    fits = Fits(gram, BlockRegression(gram))
    own = Hypothesis(VISCOUS, (Candidate(VISCOUS, "only"),))
    (weight,) = fits.values([own]).values()
    (half,) = moved_by_functions(fits, [own]).values()
    return float(weight[0]), float(half[0])


def motion(rng):
    """Speed and another signal that is in part a function of it."""
    speed = np.sin(1.7 * TIMES) + 0.6 * np.sin(4.1 * TIMES + rng.uniform(0.0, 6.0))
    other = 0.7 * speed + 0.7 * np.sin(2.9 * TIMES + rng.uniform(0.0, 6.0))
    return {"speed [rad/s]": speed, "tension [N]": other}


def test_the_truth_lies_within_it_for_functions_of_the_prior():
    """Functions of a signal with independent values at its knots: 95 % is claimed."""
    inside, errors, halves = 0, [], []
    for seed in range(80):
        rng = np.random.default_rng(seed)
        signals = motion(rng)
        knots = np.quantile(signals["tension [N]"], np.linspace(0.0, 1.0, 7))
        law = np.interp(signals["tension [N]"], knots, rng.normal(0.0, 0.3, 7))
        weight, half = fitted(law, signals, seed)
        errors.append(abs(weight - TRUE))
        halves.append(half)
        inside += errors[-1] <= half
    assert inside >= 70
    assert np.median(halves) < 5.0 * np.median(errors)


def test_nothing_moves_what_is_all_there_is():
    signals = motion(np.random.default_rng(1))
    _, half = fitted(np.zeros(ROWS), signals)
    assert half < 0.02 * TRUE


@pytest.mark.parametrize(("share", "moved"), [(1.0, True), (0.0, False)])
def test_a_function_of_a_signal_unlike_the_law_moves_it_little(share, moved):
    rng = np.random.default_rng(2)
    speed = np.sin(1.7 * TIMES)
    other = share * speed + (1.0 - share) * np.sin(2.9 * TIMES) + 1e-3 * rng.standard_normal(ROWS)
    law = 0.1 * np.sign(np.sin(6.0 * other))
    _, half = fitted(law, {"speed [rad/s]": speed, "tension [N]": other})
    assert (half > 0.2 * TRUE) is moved


SPEEDS = {name: np.sin(rate * TIMES) for name, rate in (("a", 2.1), ("b", 3.7))}
FIRST, SECOND = (Candidate(VISCOUS, name) for name in SPEEDS)


def moved(*places, common=False):
    """How far functions move two winches' friction, at places with so much of a curve in each."""
    equations = []
    for place, names, curved in places:
        columns = {Candidate(VISCOUS, name): SPEEDS[name][:, None, None] for name in names}
        columns |= Knots().columns(place, {"speed [rad/s]": SPEEDS[names[0]]})
        rough = 0.01 * np.random.default_rng(5).standard_normal(ROWS)
        bent = curved * SPEEDS[names[0]] ** 3
        target = (sum(SPEEDS[name] for name in names) + bent + rough)[:, None]
        equations.append(Equation(place, TIMES, target, columns, target))
    gram = gather([equations], BLOCK_S)
    both = Hypothesis(VISCOUS, (FIRST, SECOND), common=common)
    return moved_by_functions(Fits(gram, BlockRegression(gram)), [both])


def test_a_function_moves_what_acts_where_it_shows():
    shafts = [(Place(Channel.SHAFT, n), (n,), c) for n, c in (("a", 0.2), ("b", 0.0))]
    found = moved(*shafts)
    assert found[FIRST] > 0.02
    assert found[SECOND] < 0.1 * found[FIRST]


def test_what_has_one_cause_moves_as_one():
    shafts = [(Place(Channel.SHAFT, n), (n,), c) for n, c in (("a", 0.2), ("b", 0.0))]
    found = moved(*shafts, common=True)
    assert found[FIRST] == found[SECOND] > 0.02
