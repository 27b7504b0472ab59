"""Findings parted by what data say that were not searched."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from cspm_ident.diagnosis.diagnose import _told
from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.block_regression import Gain
from cspm_ident.diagnosis.regression.hypothesis import Findings, Hypothesis, Named, Rival
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.selection.search import Search
from cspm_ident.diagnosis.validation import acceptance as module
from cspm_ident.diagnosis.validation.acceptance import Standing
from cspm_sim.effects import Channel, catalogue


def named(effect_id, element):
    effect = catalogue()[effect_id]
    hypothesis = Hypothesis(effect, (Candidate(effect, element),))
    return Named(hypothesis, Gain(100.0, 1.0), 0.5, ())


DRY, WET, MASS = (
    named(*each)
    for each in (
        ("winch_coulomb_friction", "surge"),
        ("winch_viscous_friction", "surge"),
        ("bar_mass", "bar"),
    )
)
STANDING = Standing((DRY, WET, MASS), (WET,), (), (WET,), (), ())


def test_what_is_doubted_is_told_and_not_sure():
    assert STANDING.sure == (DRY, MASS)
    assert replace(STANDING, doubted=()).sure == STANDING.kept


def test_what_is_useless_is_rejected_with_what_was():
    once = STANDING.without([0])
    assert (once.kept, once.rejected) == ((WET, MASS), (DRY,))
    twice = once.without([0, 1])
    assert (twice.kept, twice.rejected) == ((), (DRY, WET, MASS))


@pytest.mark.parametrize(
    "less", [{"doubted": (WET,)}, {"rejected": (WET,)}, {"fed_back": (WET,)}, {}]
)
def test_what_is_unknown_is_asked_again_where_less_is_sure_than_was_found(monkeypatch, less):
    """Beside what is sure, of all that is not."""
    asked = []
    monkeypatch.setattr(module, "unknown_beside", lambda *given: asked.append(given) or ("again",))
    found = Findings((DRY, WET, MASS), ("first",), 9)
    stands = Standing(
        (DRY, *less.get("doubted", ())),
        (),
        (),
        **({"doubted": (), "rejected": (), "fed_back": ()} | less),
    )
    unknown = stands.unknown(None, found)
    gone = (*stands.rejected, *stands.doubted)
    assert (unknown, asked) == (
        (("again",), [(None, (DRY,), gone, stands.fed_back)]) if less else (("first",), [])
    )


LINE, SQUARE, LATE = (
    Hypothesis(catalogue()[name], (Candidate(catalogue()[name], element),))
    for name, element in (
        ("winch_viscous_friction", "surge"),
        ("winch_load_friction", "surge"),
        ("tension_delay", "load_cells"),
    )
)


def shaft(loud, seed=1, weight=1.0):
    """Friction by the square of the speed, which moves by `loud`, in units of its noise.

    Columns are in tenths and in ten-thousandths: what they are multiplied with is small.
    """
    rng, times = np.random.default_rng(seed), 0.01 * np.arange(2400)
    speed = loud * (np.sin(2.1 * times) + 0.6 * np.sin(0.83 * times))
    square = speed * np.abs(speed)
    target = (weight * square + rng.standard_normal(2400))[:, None]
    columns = ((LINE, 10.0 * speed), (SQUARE, 10.0 * square), (LATE, 1e4 * square))
    own = {term.candidates[0]: values[:, None, None] for term, values in columns}
    place = Place(Channel.SHAFT, "surge")
    return gather([[Equation(place, times, target, own, target)]], 0.5)


def found_in(search, hypothesis, *rivals):
    base, own = search.fits.columns([]), search.fits.own_columns(hypothesis)
    gain, share = search.fits.gain(hypothesis, base), search.sureness.share(base, own)
    return Named(hypothesis, gain, share, tuple(Rival(h, 1.0) for h in rivals))


def test_what_explains_the_same_and_is_not_contradicted_stands_instead():
    """Where it moves a fifth as much, a line is too much, and of a square there is nothing."""
    search = Search(shaft(2.0))
    still = shaft(0.2, seed=2)
    line = found_in(search, LINE, SQUARE)
    assert module.confirmed(search.fits, still, [line]).rejected == (line,)
    stood = module._confirmed(search, still, [line])
    (square,) = stood.untold
    assert (square.hypothesis, square.alternatives) == (SQUARE, ())
    assert square.gain.total > line.gain.total
    alone = found_in(search, LINE)
    assert module._confirmed(search, still, [alone]).rejected == (alone,)
    other_way = shaft(2.0, seed=2, weight=-1.0)
    assert module._confirmed(search, other_way, [line]).rejected == (line,)


def test_what_takes_as_much_as_the_unknown_is_told_though_no_free_function_does():
    search = Search(shaft(2.0))
    square, late = found_in(search, SQUARE), found_in(search, LATE)
    assert square.share > 0.5
    assert module._would_be_unknown(search, square, ())
    assert not module._would_be_unknown(search, square._replace(share=0.14), ())
    assert not module._would_be_unknown(search, late, ())


def test_what_was_given_up_says_no_more_what_a_finding_is_and_may_be_what_it_is():
    search = Search(shaft(2.0))
    square, late = found_in(search, SQUARE, LINE), found_in(search, LATE)
    beside = search.judged_again(square, [SQUARE, LATE])
    assert beside.gain.total < 0.01 * square.gain.total
    assert [rival.hypothesis for rival in beside.alternatives] == [LINE]
    again = search.judged_again(square, [SQUARE])
    assert (again.gain, again.share) == (square.gain, square.share)
    assert [rival.hypothesis for rival in again.alternatives] == [LINE, late.hypothesis]


@pytest.mark.parametrize("gone", [(), (WET,)])
def test_what_is_told_is_judged_once_more_only_where_something_was_given_up(gone):
    """The most important first, what is doubted last, and no clock of a sound machine."""
    doubted = MASS._replace(gain=Gain(900.0, 1.0))
    clock = Named(LATE, Gain(5.0, 1.0), 0.1, ())
    stands = Standing((clock, DRY, WET, doubted), (), (), (doubted,), gone, ())
    more = {"winch_coulomb_friction": 10.0, "winch_viscous_friction": 20.0, "bar_mass": 30.0}

    class Again:
        def judged_again(self, each, chosen):
            assert chosen == [kept.hypothesis for kept in stands.kept]
            return each._replace(gain=Gain(more[each.hypothesis.effect.id], 1.0))

    model = SimpleNamespace(negligible=(True, False, False, False))
    told = _told(Again(), stands, model)
    assert list(told) == ([2, 1, 3] if gone else [1, 2, 3])
    assert told[1].gain.total == (10.0 if gone else DRY.gain.total)
