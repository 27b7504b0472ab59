"""Whether a finding with its reported parameters degrades the hold-out residuals.

Findings are accepted with regressors linearised about the described machine. Their parameters are
then refitted to the searched data, linearised about a machine that has them. With the refitted
values a finding may raise the hold-out residuals.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_regression import gain_of
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.diagnosis.validation.holdout_residuals import residuals_of
from cspm_ident.diagnosis.validation.holdout_simulation import LONGEST_S, Baselines

Array = NDArray[np.float64]
# Squares of each residual, shape (blocks,).
Squares = Mapping[Place, Array]


def squares_left(
    baselines: Baselines,
    found: Mapping[Candidate, Array],
    noise: Mapping[Place, Array],
    block_s: float,
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> dict[Place, Array]:
    """Return the squared hold-out residuals by block, in squares of the noise.

    Args:
        baselines: the held-out data.
        found: weights of a machine's effects.
        noise: noise of each residual, its unit.
        block_s: length of the blocks [s].
        thresholds: those of residuals.
    """
    blocks = int(np.ceil(LONGEST_S / block_s))
    left: dict[Place, Array] = {}
    for part, since in zip(baselines.parts, baselines.since, strict=True):
        residuals = residuals_of([(part, since)], found, noise, thresholds)
        for place, equations in residuals.items():
            own = np.zeros(blocks)
            for equation in equations:
                rows = np.sum(equation.left**2, axis=1)
                at = np.clip((equation.times - since) // block_s, 0, blocks - 1)
                own += np.bincount(at.astype(np.intp), rows, blocks)
            left[place] = np.concatenate([left.get(place, np.zeros(0)), own])
    return left


def raised(
    without: Squares, with_it: Squares, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> tuple[Place, ...]:
    """Return the hold-out residuals whose squares a finding raises by most of them, significantly.

    What makes one residual worse is no certain cause of another: it may stand for something else.

    Args:
        without: squares left without the finding, by residual and block.
        with_it: squares left with it, likewise.
        thresholds: those of held-out data.
    """
    found = []
    for place in (each for each in without if each in with_it):
        gained = gain_of(without[place] - with_it[place])
        most = gained.total < -thresholds.majority_share * float(without[place].sum())
        if most and gained.total < -thresholds.tie_sigma * gained.error:
            found.append(place)
    return tuple(found)


def harm(without: Squares, with_it: Squares, thresholds: Thresholds = DEFAULT_THRESHOLDS) -> float:
    """Return the squares by which a finding raises the hold-out residuals; 0 if it does not.

    A finding degrades if it significantly raises all residuals together, or one by more than the
    allowed ratio. It never does where it explains most of one residual: it is then present,
    whatever else the model lacks.

    Args:
        without: squares left without the finding, by residual and block.
        with_it: squares left with it, likewise.
        thresholds: those of held-out data.
    """
    both = [place for place in without if place in with_it]
    before = np.array([without[place].sum() for place in both])
    taken = np.array([without[place] - with_it[place] for place in both])
    by_place = taken.sum(axis=1) if both else np.zeros(0)
    if not both or np.any(by_place > thresholds.majority_share * before):
        return 0.0
    whole = gain_of(taken.sum(axis=0))
    significant = whole.total < -thresholds.certain_sigma * whole.error
    worse = significant or np.any(by_place < -before)
    return float(np.sum(np.maximum(-by_place, 0.0))) if worse else 0.0
