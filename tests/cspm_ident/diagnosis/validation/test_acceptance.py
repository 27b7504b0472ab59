"""Findings parted by what data say that were not searched."""

from dataclasses import replace

import numpy as np
import pytest

from cspm_ident.diagnosis.diagnose import _reported
from cspm_ident.diagnosis.finding import Finding, HoldOut, Rejection, Status, reported_status
from cspm_ident.diagnosis.parameter import Coefficients
from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.block_regression import Gain
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, Rival
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.selection.search import Search
from cspm_ident.diagnosis.selection.search_result import SearchResult
from cspm_ident.diagnosis.validation import acceptance as module
from cspm_ident.diagnosis.validation.acceptance import Acceptance
from cspm_ident.diagnosis.validation.found_model import Assessment, Model
from cspm_sim.effects import Channel, catalogue


def finding(effect_id, element):
    effect = catalogue()[effect_id]
    hypothesis = Hypothesis(effect, (Candidate(effect, element),))
    return Finding(hypothesis, Gain(100.0, 1.0), 0.5)


DRY, WET, MASS = (
    finding(*each)
    for each in (
        ("winch_coulomb_friction", "surge"),
        ("winch_viscous_friction", "surge"),
        ("bar_mass", "bar"),
    )
)
OPEN = replace(WET, holdout=HoldOut.SILENT)


def gone(finding, reason=Rejection.HOLDOUT_TEST):
    return replace(finding, status=Status.REJECTED, rejection=reason)


def test_what_held_out_data_leave_open_is_kept_and_not_counted_on():
    both = Acceptance((DRY, OPEN, MASS))
    assert (both.kept, both.tested) == ((DRY, OPEN, MASS), (DRY, MASS))
    assert Acceptance((DRY, WET)).tested == (DRY, WET)
    assert not both.has_rejected


def test_what_is_useless_is_rejected_behind_what_was():
    fed_back = gone(MASS, Rejection.FED_BACK)
    before = Acceptance((DRY, WET, fed_back))
    once = before.rejecting([gone(DRY, Rejection.IMPOSSIBLE)])
    assert (once.kept, once.fed_back) == ((WET,), (fed_back,))
    assert [each.rejection for each in once.rejected] == [Rejection.IMPOSSIBLE]
    twice = once.rejecting([gone(WET)])
    assert twice.kept == ()
    assert [each.effect for each in twice.rejected] == [DRY.effect, WET.effect]


@pytest.mark.parametrize(
    "less",
    [{"left_open": OPEN}, {"rejected": gone(WET)}, {"fed_back": gone(WET, Rejection.FED_BACK)}, {}],
)
def test_what_is_unexplained_is_tested_again_where_less_is_counted_on_than_was_found(
    monkeypatch, less
):
    """Beside what is certain, of all that is not."""
    asked = []
    monkeypatch.setattr(
        module, "unexplained_beside", lambda *given: asked.append(given) or ("again",)
    )
    found = SearchResult((DRY, WET, MASS), ("first",), 9)
    acceptance = Acceptance((DRY, *less.values()))
    unexplained = acceptance.unexplained(None, found)
    others = tuple(less[name] for name in ("rejected", "left_open") if name in less)
    fed_back = tuple(less[name] for name in ("fed_back",) if name in less)
    assert (unexplained, asked) == (
        (("again",), [(None, (DRY,), others, fed_back)]) if less else (("first",), [])
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
    gain, share = search.fits.gain(hypothesis, base), search.significance.share(base, own)
    return Finding(hypothesis, gain, share, tuple(Rival(h, 1.0) for h in rivals))


def test_what_explains_the_same_and_is_not_contradicted_replaces_it():
    """Where it moves a fifth as much, a line is too much, and of a square there is nothing."""
    search = Search(shaft(2.0))
    still = shaft(0.2, seed=2)
    line = found_in(search, LINE, SQUARE)
    (alone,) = module.holdout_tested(search.fits, still, [line])
    assert alone.status is Status.REJECTED
    (square,) = module._tested(search, still, [line])
    assert (square.status, square.holdout) == (Status.REPORTED, HoldOut.SILENT)
    assert (square.hypothesis, square.alternatives) == (SQUARE, ())
    assert square.gain.total > line.gain.total
    other_way = shaft(2.0, seed=2, weight=-1.0)
    for judge, found in ((still, found_in(search, LINE)), (other_way, line)):
        (tested,) = module._tested(search, judge, [found])
        assert (tested.hypothesis, tested.status) == (LINE, Status.REJECTED)


def test_what_takes_as_much_as_the_unknown_is_reported_though_no_free_function_does():
    search = Search(shaft(2.0))
    square, late = found_in(search, SQUARE), found_in(search, LATE)
    assert square.share > 0.5
    assert module._would_be_unexplained(search, square, ())
    assert not module._would_be_unexplained(search, replace(square, share=0.14), ())
    assert not module._would_be_unexplained(search, late, ())


@pytest.mark.parametrize(("share", "holdout"), [(0.6, HoldOut.FAINT), (0.4, HoldOut.SILENT)])
def test_what_held_out_data_leave_open_is_named_only_if_it_takes_most_of_a_residual(share, holdout):
    """The shaft hardly moves in them; what takes less may stand for what is left."""
    search, still = Search(shaft(2.0)), shaft(0.2, seed=2)
    square = replace(found_in(search, SQUARE), share=share)
    found = SearchResult((square,), (), 3)
    (kept,) = module.accepted(search, found, still, [], [], 0.5).kept
    assert (kept.hypothesis, kept.holdout) == (SQUARE, holdout)
    assert (reported_status(kept) is Status.DOUBTFUL) is (holdout is HoldOut.SILENT)


def test_what_was_given_up_says_no_more_what_a_finding_is_and_may_be_what_it_is():
    search = Search(shaft(2.0))
    square, late = found_in(search, SQUARE, LINE), found_in(search, LATE)
    beside = search.judged_again(square, [SQUARE, LATE])
    assert beside.gain.total < 0.01 * square.gain.total
    assert [rival.hypothesis for rival in beside.alternatives] == [LINE]
    again = search.judged_again(square, [SQUARE])
    assert (again.gain, again.share) == (square.gain, square.share)
    assert [rival.hypothesis for rival in again.alternatives] == [LINE, late.hypothesis]


@pytest.mark.parametrize("others", [(), (gone(WET),)])
def test_findings_are_judged_once_more_only_where_something_was_rejected(others):
    """The most important first, what is left open last, and no clock of a healthy machine."""
    left_open = replace(MASS, gain=Gain(900.0, 1.0), holdout=HoldOut.SILENT)
    clock = Finding(LATE, Gain(5.0, 1.0), 0.1, status=Status.NEGLIGIBLE)
    kept = (clock, DRY, WET, left_open)
    more = {"winch_coulomb_friction": 10.0, "winch_viscous_friction": 20.0, "bar_mass": 30.0}

    class Again:
        def judged_again(self, each, chosen):
            assert chosen == [finding.hypothesis for finding in kept]
            return replace(each, gain=Gain(more[each.effect], 1.0))

    other = replace(DRY, hypothesis=replace(DRY.hypothesis, onset=3))
    acceptance = Acceptance((*kept, *(gone(other) for _ in others)))
    reported = _reported(Again(), acceptance, Model(tuple(map(Assessment, kept)), {}))
    order = [WET, DRY, MASS] if others else [DRY, WET, MASS]
    assert [each.effect for each in reported] == [each.effect for each in order]
    dry = next(each for each in reported if each.effect == DRY.effect)
    assert dry.gain.total == (10.0 if others else DRY.gain.total)


def test_a_rival_replaces_what_a_model_cannot_have():
    """The square explains what the impossible line did; the line is not tried again."""
    search, judge = Search(shaft(2.0)), shaft(2.0, seed=2)
    line = gone(found_in(search, LINE, SQUARE), Rejection.IMPOSSIBLE)
    rejected = Acceptance((line,))
    again = module.with_rivals(search, judge, rejected, [line])
    assert [each.hypothesis for each in again.kept] == [SQUARE]
    assert again.rejected == (line,)
    square = gone(found_in(search, SQUARE, LINE), Rejection.INSIGNIFICANT)
    both = Acceptance((line, square))
    assert module.with_rivals(search, judge, both, [square]) is both


def twisted(seed, weight=1.0):
    """Two winches whose shafts move alike act on one torque, each half of it."""
    rng, times = np.random.default_rng(seed), 0.01 * np.arange(2400)
    speed = 2.0 * np.sin(2.1 * times) + np.sin(0.83 * times)
    target = (weight * speed + rng.standard_normal(2400))[:, None]
    alike = [speed + 1e-3 * rng.standard_normal(2400) for _ in BOTH.candidates]
    own = {c: 5.0 * each[:, None, None] for c, each in zip(BOTH.candidates, alike, strict=True)}
    place = Place(Channel.WRENCH, "bar")
    return gather([[Equation(place, times, target, own, target)]], 0.5)


VISCOUS = catalogue()["winch_viscous_friction"]
BOTH = Hypothesis(VISCOUS, tuple(Candidate(VISCOUS, name) for name in ("surge", "sway")))


@pytest.mark.parametrize("reason", [Rejection.INSIGNIFICANT, Rejection.IMPOSSIBLE])
def test_what_no_element_shows_alone_all_may_show_with_one_set_of_parameters(reason):
    search = Search(twisted(1))
    each = gone(found_in(search, BOTH), reason)
    again = module.with_rivals(search, twisted(2), Acceptance((each,)), [each])
    if reason is Rejection.IMPOSSIBLE:
        assert again.findings == (each,)
        return
    (kept,) = again.findings
    assert kept.hypothesis == replace(BOTH, common=True)
    values = search.fits.values([kept.hypothesis])
    assert [v.item() for v in values.values()] == pytest.approx([0.1, 0.1], rel=0.05)
    opposite = module.with_rivals(search, twisted(2, -1.0), Acceptance((each,)), [each])
    assert opposite.findings == (each,)


def test_no_rival_is_taken_that_held_out_data_contradict_or_are_silent_on():
    search = Search(shaft(2.0))
    line = gone(found_in(search, LINE, SQUARE), Rejection.IMPOSSIBLE)
    rejected = Acceptance((line,))
    for judge in (shaft(2.0, seed=2, weight=-1.0), shaft(0.02, seed=2)):
        assert module.with_rivals(search, judge, rejected, [line]) is rejected


@pytest.mark.parametrize(("half", "status"), [(0.9, Status.REPORTED), (1.1, Status.DOUBTFUL)])
def test_an_interval_that_contains_zero_is_doubtful(half, status):
    (candidate,) = DRY.hypothesis.candidates
    own = Coefficients(candidate, np.array([0.03]), half * np.array([0.03]))
    assert reported_status(replace(DRY, coefficients=(own,))) is status
