"""Delay or low pass: what readings corrected exactly separate, where columns do not.

To first order both leave the reading's rate times a time. A delay keeps the amplitude, and a low
pass does not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.finding import Finding
from cspm_ident.diagnosis.regression.block_comparison import behind, paired
from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, Rival, is_timing
from cspm_ident.diagnosis.residuals.corrected_measurement import settled, with_found
from cspm_ident.diagnosis.residuals.data_split import first_part
from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.residuals.residual_equation import in_noise, steady
from cspm_ident.diagnosis.selection.refinement import Cut, refine
from cspm_ident.diagnosis.selection.search_pass import Parts, Recordings, SearchPass
from cspm_ident.diagnosis.selection.search_result import SearchResult
from cspm_ident.diagnosis.thresholds import Thresholds
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.smoothing import filtered
from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]
Left = Callable[[Sequence[Hypothesis]], Array]


def with_lateness_separated(
    found: SearchResult, last: SearchPass, recordings: Recordings, thresholds: Thresholds
) -> tuple[SearchPass, SearchResult]:
    """Return the findings, each delay or low pass as the one of both that leaves less.

    The other is no candidate of the search any more. Where neither leaves significantly less in
    hold-out blocks, they stay alternatives.

    Args:
        found: result of the search.
        last: the search pass that it is of.
        recordings: those searched and those held out.
        thresholds: those of the diagnosis.
    """
    chosen = [each.hypothesis for each in found.findings]

    def cut(parts: Parts) -> Parts:
        return parts if recordings.held_out else first_part(parts, thresholds)

    searched = [_quiet(each) for each in recordings.searched]

    def left(hypotheses: Sequence[Hypothesis]) -> Array:
        return _left(hypotheses, last, searched, cut, thresholds)

    findings = [_separated(each, chosen, left, thresholds) for each in found.findings]
    gone = [c for _, own in findings for c in own]
    last = last._replace(search=last.search.without(gone)) if gone else last
    return last, found._replace(findings=tuple(finding for finding, _ in findings))


def _separated(
    finding: Finding, chosen: Sequence[Hypothesis], left: Left, thresholds: Thresholds
) -> tuple[Finding, tuple[Candidate, ...]]:
    """Return the finding as it is now, and the candidates that are none any more."""
    own = finding.hypothesis
    twin = next((r for r in finding.alternatives if _is_twin(own, r)), None)
    if twin is None:
        return finding, ()
    others = [h for h in chosen if h is not own]
    try:
        worse = left([*others, twin.hypothesis]) - left([*others, own])
    except InputError:
        # One of both corrects a machine to an impossible one: nothing separates them.
        return finding, ()
    rest = tuple(r for r in finding.alternatives if r is not twin)
    if behind(paired(worse)) > thresholds.tie_sigma:
        return replace(finding, alternatives=rest), twin.candidates
    if behind(paired(-worse)) > thresholds.tie_sigma:
        return replace(finding, hypothesis=twin.hypothesis, alternatives=rest), own.candidates
    return finding, ()


def _is_twin(own: Hypothesis, rival: Rival) -> bool:
    """Return whether a rival is the other kind of lateness of the same readings."""
    other = rival.hypothesis
    senses = own.effect.physics.sense, other.effect.physics.sense
    return (
        is_timing(own.effect)
        and is_timing(other.effect)
        and senses[0] is not None
        and senses[1] is not None
        and senses[0].topics == senses[1].topics
        and (own.elements, own.onset) == (other.elements, other.onset)
        and rival.beside is None
    )


def _quiet(measurement: Measurement) -> Measurement:
    """Return tensions without what is noise alone, which undoing a low pass would make larger."""
    tension = measurement.tension
    if tension is None or not np.isfinite(tension.values).all():
        return measurement
    return measurement.with_samples("tension", tension.of_others(filtered(tension)[0]))


def _left(
    hypotheses: Sequence[Hypothesis],
    last: SearchPass,
    searched: Sequence[Measurement],
    cut: Cut,
    thresholds: Thresholds,
) -> Array:
    """Return what hypotheses leave in each hold-out block, readings corrected exactly, (blocks,).

    Raises:
        InputError: the corrected machine is impossible.
    """
    given = last.noise, last.block, cut, last.assumed, thresholds
    weights = refine(searched, hypotheses, *given)
    values = {c: own for c, (own, _) in weights.items() if c.effect.is_correction}
    effects = {c.effect_id: c.effect.with_grid({k: (v,) for k, v in c.shape}) for c in weights}
    moved = [settled(with_found(m, values)) for m in searched]
    parts = cut(
        [
            equations_of(m, list(effects.values()), touched=list(weights), thresholds=thresholds)
            for m in moved
        ]
    )
    gram = gather(in_noise(steady(parts), last.noise), last.block)
    wanted = {(c.effect_id, c.element) for c in weights}
    own = [t for t in gram.terms if isinstance(t, Candidate) and _key(t) in wanted]
    return BlockRegression(gram, thresholds).held_out(gram.with_nuisance(own))


def _key(candidate: Candidate) -> tuple[str, str]:
    return candidate.effect_id, candidate.element
