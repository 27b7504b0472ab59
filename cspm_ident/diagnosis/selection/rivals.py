"""Rivals: other hypotheses that explain the same as a given one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.regression.collinearity import overlap, places_for
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, has_one_system
from cspm_ident.diagnosis.residuals.regressors import Candidate

Index = NDArray[np.intp]


def rivals_of(
    gram: BlockGram,
    sums: BlockRegression,
    base: Index,
    hypothesis: Hypothesis,
    free: Sequence[Candidate],
) -> list[Hypothesis]:
    """Return the best shape of every other effect that explains the same as a hypothesis.

    Rivals act on the same elements. An effect on other elements is tried on its best element and on
    all of them, with common parameters if one system reads them. For a single element, the same
    effect on each other element is a rival too.

    Args:
        gram: Gram matrices of all columns.
        sums: the block regression of its columns.
        base: columns that are fitted beside.
        hypothesis: the hypothesis to replace.
        free: candidates that may be added.
    """
    elements = set(hypothesis.elements)
    groups: dict[tuple[str, tuple[tuple[str, float], ...]], list[Candidate]] = {}
    for candidate in free:
        groups.setdefault((candidate.effect_id, candidate.shape), []).append(candidate)
    best: dict[tuple[str, bool], tuple[float, Hypothesis]] = {}
    for (name, _), members in groups.items():
        if name == hypothesis.effect.id:
            continue
        for own in places_for(members, elements):
            effect = members[0].effect
            rival = Hypothesis(effect, own, common=len(own) > 1 and has_one_system(effect))
            gain = float(sums.gains_beyond(base, [gram.columns_of(own)])[0])
            key = name, len(own) > 1
            if key not in best or gain > best[key][0]:
                best[key] = gain, rival
    rivals = [rival for _, rival in best.values()]
    if len(elements) == 1:
        group = hypothesis.effect.id, hypothesis.candidates[0].shape
        elsewhere = (c for c in groups.get(group, ()) if c.element not in elements)
        rivals += [Hypothesis(hypothesis.effect, (c,)) for c in elsewhere]
    columns = gram.columns_of(hypothesis.candidates)
    return [r for r in rivals if overlap(sums, base, columns, gram.columns_of(r.candidates))]
