"""Screening: the hypotheses of which all subsets are scored."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.regression.jackknife import RANK
from cspm_ident.diagnosis.selection.side_by_side import side_by_side
from cspm_ident.diagnosis.selection.subset_scores import SubsetScores

Array = NDArray[np.float64]

# Effects that are kept alone, beside the best one, and so on, in each fold.
_KEPT = (8, 5, 4, 3)


def screened(
    gram: BlockGram, base: Sequence[Hypothesis], hypotheses: Sequence[Hypothesis], most: int
) -> list[Hypothesis]:
    """Return the hypotheses that explain most, alone or beside the best others.

    Every fold chooses among those it was not asked to predict; those that most folds choose stay.
    Of an effect on the same elements the best shape counts.

    Args:
        gram: Gram matrices of all residuals.
        base: hypotheses that every model has.
        hypotheses: to choose from.
        most: number that is kept.
    """
    sides = side_by_side(gram, base, hypotheses, apart=False)
    tables = SubsetScores(sides)
    votes: Counter[int] = Counter()
    for table in tables.trained:
        votes.update(_forward(table, tables.own, hypotheses))
    return [hypotheses[k] for k, _ in votes.most_common(most)]


def _forward(
    table: Array, slices: Sequence[slice], hypotheses: Sequence[Hypothesis]
) -> dict[int, int]:
    """Return the hypotheses that a fold keeps, with a vote that is larger for earlier ones."""
    found: dict[int, int] = {}
    for step, count in enumerate(_KEPT):
        gains = gains_of(table, slices)
        ranked = _best_shapes(np.argsort(-gains), hypotheses)
        for k in [k for k in ranked if gains[k] > 0.0][:count]:
            found.setdefault(k, len(_KEPT) - step)
        if not ranked or gains[ranked[0]] <= 0.0:
            break
        table = _without(table, slices[ranked[0]])
    return found


def gains_of(table: Array, slices: Sequence[slice]) -> Array:
    """Return by how much each group of regressors lowers Σ residual², (groups,).

    Args:
        table: products of regressors and target, which comes last, beyond a base.
        slices: the regressors of each group.
    """
    found = np.zeros(len(slices))
    widths = [each.stop - each.start for each in slices]
    for width in sorted(set(widths)):
        rows = [k for k, own in enumerate(widths) if own == width]
        at = np.array([slices[k].start for k in rows])[:, None] + np.arange(width)
        grams = table[at[:, :, None], at[:, None, :]] + RANK * np.eye(width)
        crossed = table[at, -1]
        found[rows] = np.einsum(
            "ki,ki->k", crossed, np.linalg.solve(grams, crossed[:, :, None])[:, :, 0]
        )
    return found


def _best_shapes(order: Iterable[int], hypotheses: Sequence[Hypothesis]) -> list[int]:
    found: dict[tuple[str, tuple[str, ...], bool], int] = {}
    for k in order:
        each = hypotheses[k]
        found.setdefault((each.effect.key, each.elements, each.common), int(k))
    return list(found.values())


def _without(table: Array, own: slice) -> Array:
    """Return the products beyond some regressors."""
    grams = table[own, own] + RANK * np.eye(own.stop - own.start)
    return np.asarray(table - table[:, own] @ np.linalg.solve(grams, table[own]))
