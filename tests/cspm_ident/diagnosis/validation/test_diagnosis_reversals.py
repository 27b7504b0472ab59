"""Whether dry friction is larger near rest, which only reversals of a shaft show."""

from dataclasses import replace

import numpy as np
import pytest

from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place, shapes_of
from cspm_ident.diagnosis.residuals.residual_equation import Equation, steady
from cspm_ident.diagnosis.selection.search import Search
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS
from cspm_ident.diagnosis.validation.reversals import near_rest, with_wider
from cspm_sim.effects import Channel, catalogue
from cspm_sim.effects.signals import WinchSignal

ROWS, STEP, BLOCK_S = 4000, 0.01, 0.8
DRY, WIDER = catalogue()["winch_coulomb_friction"], catalogue()["winch_stribeck_friction"]
STILL = 3.0  # below it a shaft counts as turning [rad/s]


def shaft(law, seed=3, still=STILL, noise=0.3):
    """A winch whose torque misses law(speed), in hundredths of a N·m as the noise."""
    rng = np.random.default_rng(seed)
    times = STEP * np.arange(ROWS)
    speed = 6.0 * (np.sin(2.3 * times) + 0.7 * np.sin(0.91 * times + 1.0))
    signals = np.zeros((ROWS, len(WinchSignal)))
    signals[:, WinchSignal.SPEED] = speed
    columns = {
        Candidate(effect, "surge_1", shape): effect.regressors(signals, **dict(shape))
        for effect in (DRY, WIDER)
        for shape in shapes_of(effect)
    }
    target = (
        0.01 * (np.sign(speed) * law(np.abs(speed)) + noise * rng.standard_normal(ROWS))[:, None]
    )
    turning = np.abs(speed) < still
    place = Place(Channel.SHAFT, "surge_1")
    return Equation(place, times, target, columns, target, turning=turning)


def reported(equation):
    parts = [[equation]]
    found = Search(gather(steady(parts), BLOCK_S)).run()
    (named,) = with_wider(found, parts, BLOCK_S, DEFAULT_THRESHOLDS).findings
    assert named.hypothesis.effect is DRY
    return [rival.hypothesis.effect for rival in named.alternatives]


@pytest.mark.parametrize(
    ("law", "wider"),
    [
        (lambda v: 3.0 + 2.0 * np.exp(-(v**2)), [WIDER]),
        (lambda v: 3.0 + 0.0 * v, []),
        # Bristles that yield take more away near rest than a breakaway would add.
        (lambda v: 3.0 * (1.0 - np.exp(-(v**2))), [WIDER]),
        # No dry friction falls to less than half while it slides.
        (lambda v: 3.0 + 9.0 * np.exp(-(v**2)), []),
    ],
)
def test_more_torque_near_rest_makes_a_larger_breakaway_an_alternative(law, wider):
    assert reported(shaft(law)) == wider


@pytest.mark.parametrize("seed", range(3))
def test_what_reversals_do_not_show_is_left_open(seed):
    """Beside noise of three times the friction all rows show it, those near rest nothing."""
    assert reported(shaft(lambda v: 3.0 + 0.0 * v, seed, noise=8.0)) == [WIDER]


@pytest.mark.parametrize(("half", "reported"), [(0.9, True), (1.1, False)])
def test_friction_near_rest_is_reported_where_half_of_it_would_show(half, reported):
    sure = np.array([2.5, 2.0]), np.array([0.3, 0.1])
    other = np.array([1.0, 2.0]), np.array([half, 0.1])
    near = near_rest([sure, other])
    assert (near is not None) is reported
    if near is not None:
        np.testing.assert_array_equal(near.values, [2.5, 1.0])
        np.testing.assert_array_equal(near.half, [0.3, half])
        np.testing.assert_array_equal(near.sliding, [2.0, 2.0])


def test_what_is_no_dry_friction_is_none_with_a_larger_breakaway():
    """Not even where its column lies in the span of one's, as a square of the speed may."""
    equation = shaft(lambda v: 3.0 + 2.0 * np.exp(-(v**2)))
    (dry,) = (c for c in equation.columns if c.effect is DRY)
    churning = Candidate(replace(DRY, id="winch_churning"), "surge_1")
    (near,) = (c for c in equation.columns if c.nonlinear == {"stribeck_speed": 1.0})
    others = {c: found for c, found in equation.columns.items() if c is not dry}
    columns = others | {churning: equation.columns[near][:, :, 1:]}
    parts = [[replace(equation, columns=columns)]]
    found = Search(
        gather(steady([[replace(equation, columns={churning: columns[churning]})]]), BLOCK_S)
    ).run()
    assert [each.hypothesis.effect.id for each in found.findings] == ["winch_churning"]
    assert with_wider(found, parts, BLOCK_S, DEFAULT_THRESHOLDS) == found


def test_without_reversals_nothing_is_added():
    fast = shaft(lambda v: 3.0 + 2.0 * np.exp(-(v**2)), still=0.0)
    found = Search(gather([[fast.within(0.0, 10.0)]], BLOCK_S)).run()
    assert with_wider(found, [[fast.within(0.0, 10.0)]], BLOCK_S, DEFAULT_THRESHOLDS) == found
