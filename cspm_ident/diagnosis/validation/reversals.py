"""What rows in which shafts turn round say of a finding: whether it is a case of something wider.

They are left out of the search, for a shaft that sticks takes any torque. But there alone shows
whether dry friction is larger near rest. Where it looks so, where they do not tell it, and where
bristles that yield before they slip take so much away near rest that they hide it, dry friction
with a larger breakaway explains as well what dry friction does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.finding import Finding
from cspm_ident.diagnosis.regression.block_gram import BlockGram, gather
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.regression.hypothesis import (
    Hypothesis,
    Rival,
    freedom,
    is_number,
)
from cspm_ident.diagnosis.regression.joint_fit import Fits
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.selection.search_result import SearchResult
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_sim.effects import Channel

Parts = Sequence[Sequence[Equation]]
Array = NDArray[np.float64]

# Of a column's length: what differs by less is the same.
_ALIKE = 1e-4


def with_wider(
    found: SearchResult, parts: Parts, block_s: float, thresholds: Thresholds
) -> SearchResult:
    """Return findings, with wider forms that reversals leave open among their alternatives.

    Args:
        found: what a search found.
        parts: all rows of what was searched, in units of their noise.
        block_s: length of the blocks [s].
        thresholds: of the diagnosis.
    """
    chosen = [each.hypothesis for each in found.findings]
    findings = []
    for each in found.findings:
        reported = {rival.hypothesis.effect.id for rival in each.alternatives}
        rows = _reversing(each.hypothesis, parts)
        wider = _wider(each, chosen, rows, block_s, thresholds) if rows else ()
        rivals = tuple(Rival(h, 0.0) for h in wider if h.effect.id not in reported)
        findings.append(replace(each, alternatives=each.alternatives + rivals))
    return found._replace(findings=tuple(findings))


def _reversing(hypothesis: Hypothesis, parts: Parts) -> list[list[Equation]]:
    """Return the winches' equations that a finding acts in, if their shafts turn round.

    Without free functions.
    """
    effect = hypothesis.effect
    if (
        effect.signature.regression.channel is not Channel.SHAFT
        or is_number(hypothesis)
        or hypothesis.onset
    ):
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
    finding: Finding,
    chosen: Sequence[Hypothesis],
    rows: Parts,
    block_s: float,
    thresholds: Thresholds,
) -> Iterator[Hypothesis]:
    """Yield wider forms of a finding that are left open, of each effect what explains most."""
    own = finding.hypothesis
    others = [h for h in chosen if h is not own]
    gram = gather(rows, block_s)
    if any(candidate not in gram.slices for candidate in own.candidates):
        return
    fits = Fits(gram, BlockRegression(gram, thresholds))
    beside = [h for h in (_within(gram, h) for h in others) if h is not None]
    base = fits.columns(beside)
    forms: dict[str, list[tuple[Hypothesis, NearRest | None]]] = {}
    for form in _forms(gram, own):
        if _is_case(own, form, rows):
            weights = fits.weights([*beside, form])
            reported = near_rest([weights[c] for c in form.candidates], thresholds)
            forms.setdefault(form.effect.id, []).append((form, reported))
    for alike in forms.values():
        if left_open := _left_open(alike, thresholds):
            yield min(left_open, key=lambda form: float(fits.held_out(form, base).sum()))


def _is_case(narrow: Hypothesis, wide: Hypothesis, rows: Parts) -> bool:
    """Return whether one is the other with two numbers that are equal, near rest and sliding."""
    if len(wide.effect.linear) != 2:
        return False
    by_element = {c.element: c for c in wide.candidates}
    pairs = (
        (e.columns[c].sum(axis=2), e.columns[by_element[c.element]].sum(axis=2))
        for part in rows
        for e in part
        for c in narrow.candidates
        if e.place.element == c.element
    )
    # Columns are held in single precision.
    return all(np.linalg.norm(b - a) <= _ALIKE * np.linalg.norm(a) for a, b in pairs)


class NearRest(NamedTuple):
    """Dry friction near rest beside what it is while a shaft slides.

    Attributes:
        values: of each element, shape (elements,) [N·m].
        half: half the widths of their 95 % intervals, likewise.
        sliding: likewise, while it slides.
    """

    values: Array
    half: Array
    sliding: Array


def near_rest(
    weights: Sequence[tuple[Array, Array]], thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> NearRest | None:
    """Return what reversals say of friction near rest; None where one element's is not told.

    Args:
        weights: of each element near rest and while it slides, with half their intervals.
        thresholds: `breakaway_half_width_share`.
    """
    found = np.array([own for own, _ in weights])
    half = np.array([own for _, own in weights])
    sliding = found[:, 1]
    if not np.all(half <= thresholds.breakaway_half_width_share * sliding[:, None]):
        return None
    return NearRest(found[:, 0], half[:, 0], sliding)


def _left_open(
    forms: Sequence[tuple[Hypothesis, NearRest | None]], thresholds: Thresholds
) -> list[Hypothesis]:
    """Return the forms of one effect, ascending in reach, that nothing speaks against."""
    reported = [(form, near) for form, near in forms if near is not None]
    if not reported:
        return [form for form, _ in forms]
    excess = thresholds.breakaway_excess_share
    larger = [form for form, near in reported if _is_larger(form, near, excess)]
    widest, near = reported[-1]
    hidden = np.all(near.values + near.half < (1.0 - excess) * near.sliding)
    return larger or ([widest] if hidden else [])


def _is_larger(form: Hypothesis, near: NearRest, excess: float) -> bool:
    """Return whether friction near rest is nearer to a breakaway worth a word than to none.

    And may be dry friction.
    """
    effect, shape = form.effect, form.candidates[0].nonlinear
    least = np.maximum(near.values - near.half, near.sliding)
    return bool(np.all(near.values >= (1.0 + 0.5 * excess) * near.sliding)) and all(
        effect.is_plausible(effect.values(each, **shape))
        for each in np.column_stack([least, near.sliding]).tolist()
    )


def _within(gram: BlockGram, hypothesis: Hypothesis) -> Hypothesis | None:
    """Return what of a hypothesis has columns here."""
    there = tuple(c for c in hypothesis.candidates if c in gram.slices)
    return replace(hypothesis, candidates=there) if there else None


def _forms(gram: BlockGram, hypothesis: Hypothesis) -> Iterator[Hypothesis]:
    """Yield all effects of more numbers, with each shape, on the hypothesis's elements."""
    groups: dict[tuple[str, tuple[tuple[str, float], ...]], list[Candidate]] = {}
    for term in gram.terms:
        if isinstance(term, Candidate) and term.element in hypothesis.elements:
            groups.setdefault((term.effect_id, term.shape), []).append(term)
    for members in groups.values():
        form = Hypothesis(members[0].effect, tuple(members))
        if len(members) == len(hypothesis.candidates) and freedom(form) > freedom(hypothesis):
            yield form
