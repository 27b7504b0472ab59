"""Errors that a healthy machine may have too: of its clocks, and of its survey."""

from __future__ import annotations

from collections.abc import Iterable

from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, is_surveyed, is_timing
from cspm_ident.diagnosis.residuals.regressors import Candidate


def clocks_of(candidates: Iterable[Candidate]) -> list[Hypothesis]:
    """Return each clock effect that may be negligible, on all its elements, one for all."""
    timing = (c for c in candidates if c.effect.signature.negligible and is_timing(c.effect))
    return [Hypothesis(c[0].effect, c, common=len(c) > 1) for c in _by_effect(timing)]


def survey_of(candidates: Iterable[Candidate]) -> list[Hypothesis]:
    """Return each effect of surveyed places on all its elements, one for each."""
    surveyed = (c for c in candidates if is_surveyed(c.effect))
    return [Hypothesis(c[0].effect, c) for c in _by_effect(surveyed)]


def _by_effect(candidates: Iterable[Candidate]) -> list[tuple[Candidate, ...]]:
    members: dict[str, list[Candidate]] = {}
    for candidate in candidates:
        members.setdefault(candidate.effect_id, []).append(candidate)
    return [tuple(own) for own in members.values()]
