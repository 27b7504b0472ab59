"""Findings parted by what data say that were not searched."""

from dataclasses import replace

import pytest

from cspm_ident.diagnosis import standing as module
from cspm_ident.diagnosis.columns import Candidate
from cspm_ident.diagnosis.hypothesis import Findings, Hypothesis, Named
from cspm_ident.diagnosis.standing import Standing
from cspm_ident.diagnosis.sums import Gain
from cspm_sim.effects import catalogue


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
