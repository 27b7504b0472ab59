"""Alternatives of a friction finding from the rows with a reversal: laws that contain it.

The search leaves these rows out, because a stuck shaft balances any torque. Only they show whether
dry friction is larger near rest. Dry friction with a larger breakaway is an alternative in three
cases: the rows indicate it, they do not determine it, or LuGre presliding masks it.
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

# Largest relative difference of two regressors that count as equal.
_EQUAL_WITHIN = 1e-4


def with_wider(
    found: SearchResult, parts: Parts, block_s: float, thresholds: Thresholds
) -> SearchResult:
    """Return the findings, with wider laws that the reversals leave open added as alternatives.

    Args:
        found: result of the search.
        parts: all rows of the searched data, in units of their noise.
        block_s: length of the blocks [s].
        thresholds: those of the diagnosis.
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
    """Return the shaft equations that a finding acts in, without free functions.

    Empty where no row has a reversal, and for a finding that is a parameter of the file, has an
    onset or acts elsewhere.
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
    """Yield, for each effect that contains a finding, the open form that predicts best.

    The measure is the squared residual of the blocks left out of each fit.
    """
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
            fitted = [weights[c] for c in form.candidates]
            # Less friction than the file says is another number, without a breakaway of its own.
            if any(values[1] < 0.0 for values, _ in fitted):
                continue
            reported = near_rest(fitted, thresholds)
            forms.setdefault(form.effect.id, []).append((form, reported))
    for same_effect in forms.values():
        if left_open := _left_open(same_effect, thresholds):
            yield min(left_open, key=lambda form: float(fits.held_out(form, base).sum()))


def _is_case(narrow: Hypothesis, wide: Hypothesis, rows: Parts) -> bool:
    """Return whether `narrow` equals `wide` with equal coefficients near rest and sliding."""
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
    # Regressors are stored in single precision.
    return all(np.linalg.norm(b - a) <= _EQUAL_WITHIN * np.linalg.norm(a) for a, b in pairs)


class NearRest(NamedTuple):
    """Dry friction near rest and while a shaft slides.

    Attributes:
        values: friction of each element near rest, shape (elements,) [N·m].
        half: half widths of their 95 % intervals, shape (elements,) [N·m].
        sliding: friction of each element while it slides, shape (elements,) [N·m].
    """

    values: Array
    half: Array
    sliding: Array


def near_rest(
    weights: Sequence[tuple[Array, Array]], thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> NearRest | None:
    """Return the friction near rest; None where one element's interval is too wide.

    Args:
        weights: of each element, the coefficients near rest and while sliding, and half widths of
            their 95 % intervals.
        thresholds: `majority_share`.
    """
    found = np.array([own for own, _ in weights])
    half = np.array([own for _, own in weights])
    sliding = found[:, 1]
    if not np.all(half <= thresholds.majority_share * sliding[:, None]):
        return None
    return NearRest(found[:, 0], half[:, 0], sliding)


def _left_open(
    forms: Sequence[tuple[Hypothesis, NearRest | None]], thresholds: Thresholds
) -> list[Hypothesis]:
    """Return the forms of one effect that the reversals do not exclude.

    Args:
        forms: in ascending order of the range near rest, with friction near rest where determined.
        thresholds: `breakaway_excess_share`.
    """
    reported = [(form, near) for form, near in forms if near is not None]
    if not reported:
        return [form for form, _ in forms]
    excess = thresholds.breakaway_excess_share
    larger = [form for form, near in reported if _is_larger(form, near, excess)]
    widest, near = reported[-1]
    hidden = np.all(near.values + near.half < (1.0 - excess) * near.sliding)
    return larger or ([widest] if hidden else [])


def _is_larger(form: Hypothesis, near: NearRest, excess: float) -> bool:
    """Return whether friction near rest is closer to a significant breakaway than to none.

    Its values must also be plausible for the effect.
    """
    effect, shape = form.effect, form.candidates[0].nonlinear
    least = np.maximum(near.values - near.half, near.sliding)
    return bool(np.all(near.values >= (1.0 + 0.5 * excess) * near.sliding)) and all(
        effect.is_plausible(effect.values(each, **shape))
        for each in np.column_stack([least, near.sliding]).tolist()
    )


def _within(gram: BlockGram, hypothesis: Hypothesis) -> Hypothesis | None:
    """Return the hypothesis reduced to candidates with regressors in `gram`; None without any."""
    there = tuple(c for c in hypothesis.candidates if c in gram.slices)
    return replace(hypothesis, candidates=there) if there else None


def _forms(gram: BlockGram, hypothesis: Hypothesis) -> Iterator[Hypothesis]:
    """Yield all effects with more coefficients, in each shape, on the hypothesis's elements."""
    groups: dict[tuple[str, tuple[tuple[str, float], ...]], list[Candidate]] = {}
    for term in gram.terms:
        if isinstance(term, Candidate) and term.element in hypothesis.elements:
            groups.setdefault((term.effect_id, term.shape), []).append(term)
    for members in groups.values():
        form = Hypothesis(members[0].effect, tuple(members))
        if len(members) == len(hypothesis.candidates) and freedom(form) > freedom(hypothesis):
            yield form
