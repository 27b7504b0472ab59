"""Moving-block bootstrap of an estimate, in one step about the optimum."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

REPLICATES = 1000


def bootstrap_covariance(
    scores: Sequence[Array],
    information: Array,
    prior: Array,
    length: int,
    seed: int,
    replicates: int = REPLICATES,
) -> Array:
    """Return the covariance of the estimates from scores put together of random blocks.

    Blocks of `length` overlap and stay within their record (Künsch, Ann. Statist. 17(3), 1989), so
    the interval holds for coloured noise whose size changes with the regressors. Scores are drawn
    instead of data (Kline and Santos, J. Econometric Methods 1(1), 2012): a draw that happens to
    miss what excites a parameter then does no harm.

    Args:
        scores: Σ over channels of residual · Jacobian, per record, shape (n, parameters).
        information: of data and priors, shape (parameters, parameters).
        prior: that of the priors alone.
        length: of a block [samples].
        seed: of the draws.
        replicates: how many.
    """
    rng = np.random.default_rng(seed)
    sizes = [min(length, len(score)) for score in scores]
    sums = [_moving_sums(score, size) for score, size in zip(scores, sizes, strict=True)]
    blocks = np.concatenate(sums)
    # Centred, so that samples at the ends, which are drawn less often, shift nothing.
    blocks -= blocks.mean(axis=0)
    total, mean_size = sum(map(len, scores)), np.average(sizes, weights=[len(s) for s in sums])
    draws = max(2, round(total / float(mean_size)))
    share = total / (draws * float(mean_size))
    gradients = rng.standard_normal((replicates, len(prior))) @ _root(prior).T
    for gradient in gradients:
        chosen = rng.integers(len(blocks), size=draws)
        gradient += np.sqrt(share) * blocks[chosen].sum(axis=0)
    steps = np.linalg.solve(information, gradients.T).T
    return np.atleast_2d(np.cov(steps, rowvar=False))


def _moving_sums(values: Array, size: int) -> Array:
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    return np.asarray(sums[size:] - sums[:-size])


def _root(matrix: Array) -> Array:
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))
