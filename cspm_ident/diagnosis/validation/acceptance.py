"""Which findings stand before data that were not searched, and what is unknown beside them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import compress

from cspm_ident.diagnosis.regression.block_gram import Evidence
from cspm_ident.diagnosis.regression.collinearity import RIVAL_SHARE
from cspm_ident.diagnosis.regression.hypothesis import Findings, Hypothesis, Named, Unknown
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.selection.search import Search
from cspm_ident.diagnosis.selection.unexplained import UNKNOWN_SHARE
from cspm_ident.diagnosis.validation.holdout_test import Confirmed, confirmed
from cspm_ident.diagnosis.validation.instrumental_variables import (
    instruments_of,
    is_proportional,
    shows_in_what_was_asked,
)
from cspm_ident.signals.measurement import Measurement

Parts = Sequence[Sequence[Equation]]


@dataclass(frozen=True)
class Standing:
    """Findings by what data say that were not searched.

    Attributes:
        kept: what is told.
        faint: of that, of which these data show little.
        plain: of that, what takes most of one of their residuals.
        doubted: of that, what is told as doubtful, though they say nothing of it.
        rejected: what does not stand.
        fed_back: what the motion that was asked for does not show, and controllers feed back.
    """

    kept: tuple[Named, ...]
    faint: tuple[Named, ...]
    plain: tuple[Named, ...]
    doubted: tuple[Named, ...]
    rejected: tuple[Named, ...]
    fed_back: tuple[Named, ...]

    @property
    def sure(self) -> tuple[Named, ...]:
        """What is told and not doubtful."""
        return tuple(each for each in self.kept if each not in self.doubted)

    @property
    def has_given_up(self) -> bool:
        """Whether anything that was found is not told."""
        return bool(self.rejected or self.fed_back)

    def without(self, useless: Collection[int]) -> Standing:
        """Return the same with some of what was kept rejected, by where they are there."""
        gone = tuple(self.kept[k] for k in useless)
        kept = tuple(each for k, each in enumerate(self.kept) if k not in useless)
        return replace(self, kept=kept, rejected=(*self.rejected, *gone))

    def unknown(self, search: Search, found: Findings) -> tuple[Unknown, ...]:
        """Return what nothing explains beside what is sure, of all that was found."""
        if not (self.has_given_up or self.doubted):
            return found.unknown
        return unknown_beside(search, self.sure, (*self.rejected, *self.doubted), self.fed_back)


def standing_of(
    search: Search,
    found: Findings,
    judge: Evidence | None,
    searched: Sequence[Measurement],
    rows: Parts,
    block: float,
) -> Standing:
    """Part what was found by whether it stands.

    Args:
        search: in which it was found.
        found: that.
        judge: sums of what was not searched; None: nothing is judged by it.
        searched: the recordings.
        rows: their equations, in units of their noise.
        block: length of the blocks [s].
    """
    stood = Confirmed(found.named) if judge is None else _confirmed(search, judge, found.named)
    kept, fed_back = _asked_for(search, stood.kept, searched, rows, block)
    doubted = _doubted(search, kept, stood, fed_back)
    rejected = (*stood.rejected, *(each for each in stood.untold if each not in doubted))
    kept, faint = (*kept, *doubted), (*stood.faint, *doubted)
    # Unknown would be told instead, of which held-out data say as little; with it nothing is.
    if doubted and not unknown_beside(search, kept, rejected, fed_back):
        doubted = ()
    return Standing(kept, faint, stood.plain, doubted, rejected, fed_back)


def _confirmed(search: Search, judge: Evidence, found: Sequence[Named]) -> Confirmed:
    """Part what was found by whether it stands, or what explains the same does in its place.

    A bar that comes to rest contradicts drag in proportion to its speed, and not to its square.
    """
    stood = confirmed(search.fits, judge, found)
    for each in stood.rejected:
        for instead in _instead(search, each, found):
            others = [instead if other is each else other for other in found]
            if instead not in confirmed(search.fits, judge, others).rejected:
                return _confirmed(search, judge, others)
    return stood


def _instead(search: Search, named: Named, found: Sequence[Named]) -> Iterator[Named]:
    """Yield what explains the same as a finding by itself, nearest first."""
    others = [h for h in _hypotheses(found) if h is not named.hypothesis]
    base = search.fits.columns(others)
    alone = [a for a in named.alternatives if a.beside is None]
    for rival in sorted(alone, key=lambda each: each.behind):
        if not search.fits.is_plausible([*others, rival.hypothesis]):
            continue
        gain = search.fits.gain(rival.hypothesis, base)
        share = search.sureness.share(base, search.fits.own_columns(rival.hypothesis))
        rest = tuple(a for a in named.alternatives if a is not rival)
        yield Named(replace(rival.hypothesis, onset=named.hypothesis.onset), gain, share, rest)


def _asked_for(
    search: Search,
    kept: Sequence[Named],
    searched: Sequence[Measurement],
    rows: Parts,
    block: float,
) -> tuple[tuple[Named, ...], tuple[Named, ...]]:
    """Part what was found by whether the motion that was asked for shows it, if it has to."""
    hypotheses, wanted = _hypotheses(kept), [instruments_of(each) for each in searched]
    values = search.fits.values(hypotheses)

    def stays(named: Named) -> bool:
        own = named.hypothesis
        return (
            not is_proportional(own.effect)
            or own.onset > 0
            or search.fits.is_negligible(own, hypotheses)
            or shows_in_what_was_asked(rows, wanted, own.candidates, values, block)
        )

    told = [stays(each) for each in kept]
    gone = (each for each, stay in zip(kept, told, strict=True) if not stay)
    return tuple(compress(kept, told)), tuple(gone)


def _doubted(
    search: Search,
    kept: Sequence[Named],
    stood: Confirmed,
    fed_back: Sequence[Named],
) -> tuple[Named, ...]:
    """Return what is told as doubtful, though data that were not searched say nothing of it.

    It explains as much as what without it is unknown, of which they say nothing either.
    """
    if not stood.untold:
        return ()
    unknown = unknown_beside(search, kept, (*stood.rejected, *stood.untold), fed_back)
    if not unknown:
        return tuple(e for e in stood.untold if _would_be_unknown(search, e, kept))
    most = RIVAL_SHARE * max(gain.total for _, gain, _ in unknown)
    beside = Findings((), unknown, 0)
    return tuple(e for e in stood.untold if e.gain.total >= most and beside.is_doubtful(e))


def _would_be_unknown(search: Search, named: Named, kept: Sequence[Named]) -> bool:
    """Return whether a finding takes as much as is told as unknown, though no free function does.

    Nor may it be what a sound machine has as well.
    """
    every = _hypotheses([*kept, named])
    return named.share >= UNKNOWN_SHARE and not search.fits.is_negligible(named.hypothesis, every)


def unknown_beside(
    search: Search,
    kept: Sequence[Named],
    rejected: Sequence[Named],
    fed_back: Sequence[Named] = (),
) -> tuple[Unknown, ...]:
    """Return what nothing explains beside what was kept.

    What was rejected explains nothing, but for what a sound machine has as well: clocks drift, so
    that what they did in the part that was searched may be gone in the other, and controllers feed
    noise back.
    """
    every = _hypotheses([*kept, *rejected])
    sound = [h for h in _hypotheses(rejected) if search.fits.is_negligible(h, every)]
    return search.unknown(_hypotheses(kept), [*sound, *_hypotheses(fed_back)])


def _hypotheses(named: Sequence[Named]) -> list[Hypothesis]:
    return [each.hypothesis for each in named]
