"""The models of some hypotheses that predict no worse than the best, and the simplest of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, parameters_in, unusual
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.selection.confidence_set import confidence_set
from cspm_ident.diagnosis.selection.side_by_side import side_by_side
from cspm_ident.diagnosis.selection.subset_scores import Subset, SubsetScores, subsets_of
from cspm_ident.diagnosis.thresholds import Thresholds

Array = NDArray[np.float64]
Weights = dict[Candidate, Array]
Allowed = Callable[[Sequence[Hypothesis], Weights], bool]

# Models that enter the confidence set: the best of all, and the best of each size.
_BEST, _BEST_OF_SIZE = 40, 12
# Subsets whose weights are computed at once.
_AT_ONCE = 500
NESTED_SHARE = 0.999
"""Of the squares: identity but for rounding and the single precision of columns."""


class Model(NamedTuple):
    """Some hypotheses, and how well they predict.

    Attributes:
        hypotheses: beside those that every model has.
        losses: of each block that was not fitted, (blocks,); see `model_set`.
        weights: fitted to all blocks.
    """

    hypotheses: tuple[Hypothesis, ...]
    losses: Array
    weights: Weights

    @property
    def parameters(self) -> int:
        """Number of its free parameters."""
        return sum(map(parameters_in, self.hypotheses))


class ModelSet(NamedTuple):
    """Models that predict no worse than the best.

    Attributes:
        members: the best first.
        free: the hypotheses of which they are made.
        spans: share of the second of each pair of these that the first spans, (free, free).
        undecided: difference of total losses that the model-form error may make.
    """

    members: tuple[Model, ...]
    free: tuple[Hypothesis, ...]
    spans: Array
    undecided: float

    @property
    def chosen(self) -> Model:
        """The member of fewest parameters, and of these the best: what more has is not needed.

        Of those that the model-form error does not separate, it is the least unusual.
        """
        fewest = min(each.parameters for each in self.members)
        few = [each for each in self.members if each.parameters == fewest]
        best = min(float(each.losses.sum()) for each in few)
        near = [each for each in few if each.losses.sum() <= best + self.undecided]
        return min(near, key=lambda each: (unusual(each.weights), each.losses.sum()))

    @property
    def has_none(self) -> bool:
        """Whether the model without any hypothesis is a member."""
        return any(not each.hypotheses for each in self.members)

    def spanned(self, wide: Hypothesis, narrow: Hypothesis) -> float:
        """Return the share of a hypothesis that another spans."""
        return float(self.spans[self.free.index(wide), self.free.index(narrow)])


def behind_by(one: Model, other: Model) -> float:
    """Return by how many standard errors of the difference one model predicts worse."""
    worse = one.losses - other.losses
    scatter = float(worse.std(ddof=1)) * float(np.sqrt(len(worse)))
    return float(worse.sum()) / scatter if scatter > 0.0 else 0.0


def model_set(
    gram: BlockGram,
    base: Sequence[Hypothesis],
    free: Sequence[Hypothesis],
    allowed: Allowed,
    thresholds: Thresholds,
    most: int,
) -> ModelSet:
    """Score every subset of some hypotheses, and return those that predict no worse than the best.

    Models are compared by n·log(1 + Σ residual²/n) of every residual and block, n its rows, in
    units of their noise: the likelihood where each block has an error of its own, unknown in size,
    beside the noise. So no block, and no residual far beyond its noise, decides for all others.
    No law is exact, so that a difference within the model-form error does not separate two models.

    Args:
        gram: Gram matrices of all residuals.
        base: hypotheses that every model has.
        free: hypotheses that a model may have.
        allowed: whether a machine can have hypotheses with these weights.
        thresholds: `false_alarm_rate`.
        most: largest number of hypotheses in a model.
    """
    scores = SubsetScores(side_by_side(gram, base, free))
    spans = scores.spans
    heard = [k for k in range(len(free)) if scores.heard[k]]
    subsets = [
        tuple(heard[k] for k in each)
        for each in subsets_of(len(heard), most, spans[np.ix_(heard, heard)], NESTED_SHARE)
    ]

    def is_allowed(subset: Subset, weights: Sequence[Array]) -> bool:
        chosen = [free[k] for k in subset]
        return not chosen or allowed(chosen, _weights(chosen, weights))

    entered = _entered(subsets, scores, is_allowed)
    rows = np.maximum(np.stack([place.rows for place in gram.places]), 1.0)
    losses = (rows * np.log1p(scores.squares_at(entered) / rows)).sum(axis=1)
    totals = losses.sum(axis=1)
    best, none = float(totals.min()), float(totals[entered.index(())])
    undecided = thresholds.model_form_error_share * (none - best)
    near = totals <= best + undecided
    kept = np.flatnonzero(near | confidence_set(losses, thresholds.false_alarm_rate))
    fitted = scores.weights([entered[k] for k in kept])
    members = []
    for k, weights in zip(kept, fitted, strict=True):
        chosen = tuple(free[i] for i in entered[k])
        members.append(Model(chosen, losses[k], _weights(chosen, weights)))
    ranked = sorted(members, key=lambda each: each.losses.sum())
    return ModelSet(tuple(ranked), tuple(free), spans, undecided)


def _entered(
    subsets: Sequence[Subset],
    scores: SubsetScores,
    is_allowed: Callable[[Subset, Sequence[Array]], bool],
) -> list[Subset]:
    """Return the subsets that are compared: the best of all, and the best of each size."""
    ranked = [subsets[k] for k in np.argsort(scores.squares(subsets), kind="stable")]
    found: list[Subset] = []
    of_size: dict[int, int] = {}
    for first in range(0, len(ranked), _AT_ONCE):
        some = ranked[first : first + _AT_ONCE]
        for subset, weights in zip(some, scores.weights(some), strict=True):
            size = len(subset)
            wanted = len(found) < _BEST or of_size.get(size, 0) < _BEST_OF_SIZE
            if wanted and is_allowed(subset, weights):
                found.append(subset)
                of_size[size] = of_size.get(size, 0) + 1
    return found


def _weights(hypotheses: Iterable[Hypothesis], weights: Sequence[Array]) -> Weights:
    """Return the weights of each candidate; elements that share parameters have the same."""
    found: Weights = {}
    for each, own in zip(hypotheses, weights, strict=True):
        parts = 1 if each.common else len(each.candidates)
        split = np.split(own, parts)
        for k, candidate in enumerate(each.candidates):
            found[candidate] = split[0 if each.common else k]
    return found
