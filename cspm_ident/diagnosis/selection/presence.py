"""Which hypotheses of a model are certain, which are exchanged, and which may be absent."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, Rival, parameters_in
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.selection.model_set import NESTED_SHARE, Model, ModelSet, behind_by
from cspm_ident.diagnosis.thresholds import Thresholds

Array = NDArray[np.float64]


def is_missed(models: ModelSet, chosen: Model, own: Hypothesis, thresholds: Thresholds) -> bool:
    """Return whether some model that predicts as well lacks a hypothesis and has nothing instead.

    Then the recordings cannot tell whether it is there.
    """
    return any(
        not list(_instead(models, chosen, other, own, thresholds))
        for other in _without(models, chosen, own)
    )


def exchanged(
    models: ModelSet, chosen: Model, own: Hypothesis, thresholds: Thresholds
) -> tuple[Rival, ...]:
    """Return the hypotheses that other models of the set have in place of one, the closest first.

    One that contains it, as Stribeck friction contains Coulomb's, is no contradiction.
    """
    best: dict[tuple[str, tuple[str, ...]], Rival] = {}
    for other in _without(models, chosen, own):
        behind = max(0.0, behind_by(other, chosen))
        for each in _instead(models, chosen, other, own, thresholds):
            wider = parameters_in(each) > parameters_in(own)
            if wider and models.spanned(each, own) > NESTED_SHARE:
                continue
            key = each.effect.key, each.elements
            if key not in best or behind < best[key].behind:
                best[key] = Rival(each, behind)
    return tuple(sorted(best.values(), key=lambda rival: rival.behind))


def spread(models: ModelSet, chosen: Model, own: Hypothesis) -> dict[Candidate, Array]:
    """Return by how far the weights of a hypothesis lie apart, at most, in models that have it.

    Models of many more parameters are left out: their weights are uncertain for that reason alone.
    """
    near = [each for each in models.members if each.parameters <= chosen.parameters + 1]
    there = [chosen.weights, *(each.weights for each in near if own in each.hypotheses)]
    return {
        c: np.max([np.abs(weights[c] - chosen.weights[c]) for weights in there], axis=0)
        for c in own.candidates
    }


def _without(models: ModelSet, chosen: Model, own: Hypothesis) -> Iterator[Model]:
    """Yield the members without a hypothesis that have at most one more parameter."""
    for each in models.members:
        if own not in each.hypotheses and each.parameters <= chosen.parameters + 1:
            yield each


def _instead(
    models: ModelSet, chosen: Model, other: Model, own: Hypothesis, thresholds: Thresholds
) -> Iterator[Hypothesis]:
    """Yield what another model has that explains most of the same as one of the chosen's."""
    for each in other.hypotheses:
        if each in chosen.hypotheses:
            continue
        both = models.spanned(each, own), models.spanned(own, each)
        if max(both) >= thresholds.majority_share:
            yield each
