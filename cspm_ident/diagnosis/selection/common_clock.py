"""Clock errors that a healthy machine may have too."""

from __future__ import annotations

from collections.abc import Iterable

from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.residuals.regressors import Candidate


def clocks_of(candidates: Iterable[Candidate]) -> list[Hypothesis]:
    """Return each effect that may be negligible, on all its elements, with common parameters."""
    members: dict[str, list[Candidate]] = {}
    for candidate in candidates:
        if candidate.effect.signature.negligible:
            members.setdefault(candidate.effect_id, []).append(candidate)
    return [Hypothesis(c[0].effect, tuple(c), common=len(c) > 1) for c in members.values()]
