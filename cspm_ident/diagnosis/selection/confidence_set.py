"""Model confidence set: the models that predict no worse than the best.

Hansen, Lunde, Nason, Econometrica 79(2), 2011, with their range statistic T_R.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Resamplings of the blocks; their seed makes the result repeatable.
_RESAMPLINGS, _SEED = 1000, 0
# Share of the losses below which differences are rounding errors.
_EQUAL_WITHIN = 1e-9


def confidence_set(losses: Array, rate: float) -> NDArray[np.bool_]:
    """Return which models are not worse than the best with a probability of 1 − rate, (models,).

    The model that is worst beside one of the others is left out, until none is significantly worse.
    Blocks are resampled in runs of the third root of their number (Politis, Romano, J. Am. Stat.
    Assoc. 89(428), 1994), so that correlated blocks do not count as independent.

    Args:
        losses: Σ residual² of each model's predictions, shape (models, blocks).
        rate: of sets that lack the best model.
    """
    sizes, chances = _differences(losses)
    kept = np.arange(len(losses))
    while len(kept) > 1:
        both = np.ix_(kept, kept)
        largest = chances[both].max(axis=(0, 1))
        if float(np.mean(largest >= sizes[both].max())) >= rate:
            break
        kept = np.delete(kept, int(np.argmax(sizes[both].max(axis=1))))
    return np.isin(np.arange(len(losses)), kept)


def _differences(losses: Array) -> tuple[Array, Array]:
    """Return by how many standard errors models differ, (m, m), and resampled models by chance.

    The latter, (m, m, resamplings), are from the difference of all blocks. The standard errors are
    those of the resamplings.
    """
    means = losses.mean(axis=1)
    drawn = (losses - means[:, None]) @ _counts(losses.shape[1]).T / losses.shape[1]
    scatter = np.abs(drawn[:, None] - drawn)
    least = _EQUAL_WITHIN * float(np.abs(means).min(initial=np.inf))
    errors = np.maximum(np.sqrt(np.mean(scatter**2, axis=2)), least)
    return (means[:, None] - means) / errors, scatter / errors[:, :, None]


def _counts(blocks: int) -> Array:
    """Return how often each resampling draws each block, (resamplings, blocks)."""
    random, run = np.random.default_rng(_SEED), max(1, round(blocks ** (1.0 / 3.0)))
    starts = random.integers(0, blocks, (_RESAMPLINGS, -(-blocks // run)))
    drawn = (starts[:, :, None] + np.arange(run)).reshape(_RESAMPLINGS, -1)[:, :blocks] % blocks
    return np.asarray((drawn[:, :, None] == np.arange(blocks)).sum(axis=1), dtype=float)
