"""Effects that a wrong number of the file hides: together the two look like something else."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.columns import Candidate
from cspm_ident.diagnosis.evidence import Evidence
from cspm_ident.diagnosis.hypothesis import Hypothesis
from cspm_ident.diagnosis.sums import Sums

Index = NDArray[np.intp]

# Of the gain: what two things leave of it is no more than models are untrue by.
_ALIKE = 0.99
# Above which either of the two may as well be absent.
_NEEDLESS = 0.01


def absorbed_pairs(
    evidence: Evidence,
    sums: Sums,
    base: Index,
    hypothesis: Hypothesis,
    free: Sequence[Candidate],
) -> list[tuple[Hypothesis, Hypothesis]]:
    """Return effects that together with a wrong number explain what one thing on one element does.

    A drum's radius fitted while the drive's gain was wrong is, to every sensor, an encoder's scale.

    Args:
        evidence: of the columns.
        sums: of these.
        base: columns that are fitted beside.
        hypothesis: what they are like.
        free: candidates that are not among what was chosen.

    Returns:
        (effect, wrong number), of each two the best points; both are needed.
    """
    if len(hypothesis.candidates) > 1:
        return []
    there = [c for c in free if c.element == hypothesis.elements[0]]
    others = [c for c in there if c.effect_id != hypothesis.effect.id]
    numbers = [c for c in others if c.effect.alter is not None]
    effects = [c for c in others if c.effect.alter is None]
    pairs = list(product(effects, numbers))
    least = _ALIKE * sums.gains_beyond(base, [evidence.columns_of(hypothesis.candidates)])[0]
    gains = sums.gains_beyond(base, [evidence.columns_of(pair) for pair in pairs])
    best: dict[tuple[str, str], tuple[Candidate, Candidate]] = {}
    for k in np.argsort(-gains):
        if gains[k] >= least:
            effect, number = pairs[k]
            best.setdefault((effect.effect_id, number.effect_id), pairs[k])
    return [
        (Hypothesis(effect.effect, (effect,)), Hypothesis(number.effect, (number,)))
        for effect, number in best.values()
        if _needed(evidence, sums, base, effect, number)
    ]


def _needed(evidence: Evidence, sums: Sums, base: Index, one: Candidate, other: Candidate) -> bool:
    """Return whether neither of two explains as much without the other."""
    first, second = evidence.columns_of([one]), evidence.columns_of([other])
    return all(
        sums.p_value(np.concatenate([base, beside]), own) < _NEEDLESS
        for beside, own in ((first, second), (second, first))
    )
