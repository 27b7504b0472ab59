"""What clocks that are set to each other as well as clocks are do to readings."""

from __future__ import annotations

from collections.abc import Iterable

from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.residuals.regressors import Candidate


def clocks_of(candidates: Iterable[Candidate]) -> list[Hypothesis]:
    """Return, of every such effect among candidates, that it acts on all that it can."""
    members: dict[str, list[Candidate]] = {}
    for candidate in candidates:
        if candidate.effect.signature.negligible:
            members.setdefault(candidate.effect_id, []).append(candidate)
    return [Hypothesis(c[0].effect, tuple(c), common=len(c) > 1) for c in members.values()]
