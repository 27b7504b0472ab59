"""What held-out data say of each finding with its reported parameters.

Regressors select findings, linearised about the described machine. Their parameters are then
refitted, linearised about a machine that has them, and the residuals of that machine are judged.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.finding import Reason
from cspm_ident.diagnosis.regression.block_regression import gain_of
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.diagnosis.validation.holdout_residuals import residuals_of
from cspm_ident.diagnosis.validation.holdout_simulation import LONGEST_S, Baselines

Array = NDArray[np.float64]
# Of each residual, shape (blocks,).
Losses = Mapping[Place, Array]


def losses_left(
    baselines: Baselines,
    found: Mapping[Candidate, Array],
    noise: Mapping[Place, Array],
    block_s: float,
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> dict[Place, Array]:
    """Return the losses of held-out residuals by block, as those that select models.

    They are n·log(1 + Σ residual²/n) of n values in units of their noise, nan without any.

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
            squares, counts = np.zeros(blocks), np.zeros(blocks)
            for equation in equations:
                at = np.clip((equation.times - since) // block_s, 0, blocks - 1).astype(np.intp)
                squares += np.bincount(at, np.sum(equation.left**2, axis=1), blocks)
                counts += equation.left.shape[1] * np.bincount(at, minlength=blocks)
            rows = np.where(counts > 0.0, counts, np.nan)
            own = rows * np.log1p(squares / rows)
            left[place] = np.concatenate([left.get(place, np.zeros(0)), own])
    return left


def objection(
    without: Losses, with_it: Losses, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> Reason | None:
    """Return why held-out data do not confirm a finding; None where they do.

    A finding is contradicted where it significantly raises a residual of any place. It is confirmed
    where it lowers all of them together beyond the scatter of their blocks, or one of them by so
    much that it is no chance among many.

    Args:
        without: losses without the finding, by residual and block.
        with_it: losses with it, likewise.
        thresholds: `certain_sigma` and `tie_sigma`.
    """
    taken = np.array([without[p] - with_it[p] for p in without if p in with_it])
    if not taken.size:
        return Reason.NOT_CONFIRMED
    whole = np.nansum(taken, axis=0)[~np.isnan(taken).all(axis=0)]
    gains, total = [gain_of(each[~np.isnan(each)]) for each in taken], gain_of(whole)
    certain, together = thresholds.certain_sigma, thresholds.tie_sigma
    if any(gain.total < -certain * gain.error for gain in (*gains, total)):
        return Reason.RAISES_HOLDOUT
    confirmed = any(gain.total > certain * gain.error for gain in gains)
    return None if confirmed or total.total > together * total.error else Reason.NOT_CONFIRMED


def raised(without: Losses, with_it: Losses) -> float:
    """Return by how much a finding raises the losses of the residuals that it raises."""
    changes = (float(np.nansum(with_it[p] - without[p])) for p in without if p in with_it)
    return sum(max(0.0, each) for each in changes)
