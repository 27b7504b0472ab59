"""What rows in which shafts turn round say of a finding: whether it is a case of something wider.

They are left out of the search, for a shaft that sticks takes any torque. But there alone shows
whether dry friction is larger near rest. Bristles that yield before they slip take torque away near
rest, so that what is larger there is none of their doing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.columns import Candidate
from cspm_ident.diagnosis.equation import Equation
from cspm_ident.diagnosis.evidence import Evidence, gather
from cspm_ident.diagnosis.fits import Fits
from cspm_ident.diagnosis.hypothesis import Findings, Hypothesis, Named, Rival, freedom, is_number
from cspm_ident.diagnosis.likeness import contains
from cspm_ident.diagnosis.sums import Sums, gain_of
from cspm_sim.effects import Channel

Parts = Sequence[Sequence[Equation]]
Index = NDArray[np.intp]

# Standard errors by which the wider form has to explain more.
_SIGMAS = 2.0


def with_wider(
    found: Findings, parts: Parts, block_s: float, summed: Callable[[Evidence], Sums]
) -> Findings:
    """Return findings, with wider forms that reversals speak for among their alternatives.

    Args:
        found: what a search found.
        parts: all rows of what was searched, in units of their noise.
        block_s: length of the blocks [s].
        summed: makes sums that tell what is sure.
    """
    chosen = [each.hypothesis for each in found.named]
    named = []
    for each in found.named:
        told = {rival.hypothesis.effect.id for rival in each.alternatives}
        rows = _reversing(each.hypothesis, parts)
        wider = _wider(each, chosen, rows, block_s, summed) if rows else ()
        rivals = tuple(Rival(h, 0.0) for h in wider if h.effect.id not in told)
        named.append(each._replace(alternatives=each.alternatives + rivals))
    return found._replace(named=tuple(named))


def _reversing(hypothesis: Hypothesis, parts: Parts) -> list[list[Equation]]:
    """Return the winches' equations that a finding acts in, if their shafts turn round.

    Without free functions.
    """
    effect = hypothesis.effect
    if effect.regression.channel is not Channel.SHAFT or is_number(hypothesis) or hypothesis.onset:
        return []
    own = [
        [
            e.only({term for term in e.columns if isinstance(term, Candidate)})
            for e in part
            if e.place.channel is Channel.SHAFT and e.place.element in hypothesis.elements
        ]
        for part in parts
    ]
    return own if any(e.turning.any() for part in own for e in part) else []


def _wider(
    named: Named,
    chosen: Sequence[Hypothesis],
    rows: Parts,
    block_s: float,
    summed: Callable[[Evidence], Sums],
) -> Iterator[Hypothesis]:
    """Yield wider forms of a finding that surely explain more, the best of each effect."""
    own, others = named.hypothesis, [h for h in chosen if h is not named.hypothesis]
    evidence = gather(rows, block_s)
    if any(candidate not in evidence.slices for candidate in own.candidates):
        return
    fits = Fits(evidence, summed(evidence))
    beside = [h for h in (_within(evidence, h) for h in others) if h is not None]
    base, columns = fits.columns(beside), fits.own_columns(own)
    before = fits.held_out(own, base)
    best: dict[str, tuple[float, Hypothesis]] = {}
    for form in _forms(evidence, own):
        wide = fits.own_columns(form)
        if not contains(fits.sums, base, wide, columns) or not fits.is_plausible([*beside, form]):
            continue
        better = gain_of(before - fits.held_out(form, base))
        least = max(_SIGMAS * better.error, best.get(form.effect.id, (0.0, form))[0])
        if better.total > least:
            best[form.effect.id] = better.total, form
    yield from (form for _, form in best.values())


def _within(evidence: Evidence, hypothesis: Hypothesis) -> Hypothesis | None:
    """Return what of a hypothesis has columns here."""
    there = tuple(c for c in hypothesis.candidates if c in evidence.slices)
    return replace(hypothesis, candidates=there) if there else None


def _forms(evidence: Evidence, hypothesis: Hypothesis) -> Iterator[Hypothesis]:
    """Yield all effects of more numbers, with each shape, on the hypothesis's elements."""
    groups: dict[tuple[str, tuple[tuple[str, float], ...]], list[Candidate]] = {}
    for term in evidence.terms:
        if isinstance(term, Candidate) and term.element in hypothesis.elements:
            groups.setdefault((term.effect_id, term.shape), []).append(term)
    for members in groups.values():
        form = Hypothesis(members[0].effect, tuple(members))
        if len(members) == len(hypothesis.candidates) and freedom(form) > freedom(hypothesis):
            yield form
