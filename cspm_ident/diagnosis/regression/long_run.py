"""Intervals of weights whose blocks are correlated, by equal-weighted cosines."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as t_distribution

from cspm_ident.diagnosis.regression.jackknife import RANK, pseudo_inverse

Array = NDArray[np.float64]

COSINES = 0.41
"""Number of cosines, of blocks to the power of 2/3 (Lazarus, Lewis, Stock, Watson 2018)."""
CORRELATION = 0.55
"""Of successive blocks, at which the variance is unbiased: 93 to 97 % hold from 0 to 0.7."""
FEWEST_STRETCHES = 4.0
"""Of 12 blocks with a correlation of 0.5, or 24 with 0.7: with fewer, intervals hold too rarely."""


class LongRun(NamedTuple):
    """Intervals of weights, each an array of shape (m,).

    Attributes:
        half_widths: of 95 % intervals; infinite without freedom, 0 for what nothing excites.
        freedom: degrees of freedom, the number of cosines.
        stretches: effective number of independent stretches of time.
    """

    half_widths: Array
    freedom: Array
    stretches: Array

    @property
    def few_stretches(self) -> NDArray[np.bool_]:
        """Whether there are too few independent stretches for an interval that holds, (m,)."""
        return np.asarray(self.stretches < FEWEST_STRETCHES)


class _Influence(NamedTuple):
    """What each block does to one weight.

    Attributes:
        changes: by its residuals, shape (blocks,).
        reported: the weight's row of the inverse Gram matrix times that of each block, (blocks, n).
        inverse: of the Gram matrix of all blocks, (n, n).
        variance: of the weight, under white noise of variance 1.
        shares: of the blocks in this variance, (blocks,).
    """

    changes: Array
    reported: Array
    inverse: Array
    variance: float
    shares: Array

    @property
    def blocks(self) -> float:
        """Effective number of blocks that report (Satterthwaite, Biometrics Bull. 2(6), 1946)."""
        return 1.0 / float(self.shares @ self.shares)

    @property
    def span(self) -> int:
        """Number of blocks over which information is spread; all of them if equally."""
        number = np.arange(len(self.shares)) - self.shares @ np.arange(len(self.shares))
        wide = np.sqrt(1.0 + 12.0 * (self.shares @ number**2))
        return min(len(self.shares), round(float(wide)))

    @property
    def stretches(self) -> float:
        """Blocks, less for the correlation of successive changes, freed from its bias.

        The bias is −(1 + 3ρ)/blocks (Kendall, Biometrika 41(3), 1954).
        """
        squares = max(float(self.changes @ self.changes), 1e-300)
        seen = float(self.changes[1:] @ self.changes[:-1]) / squares
        same = np.clip(seen + (1.0 + 3.0 * seen) / self.blocks, 0.0, 1.0)
        return float(self.blocks * (1.0 - same) / (1.0 + same))

    def long_run(self) -> tuple[float, int]:
        """Return the weight's variance and its degrees of freedom.

        Squares of the first cosines' amplitudes, each divided by what white noise would have. So
        the interval is exact under white noise, whatever the blocks' shares and other weights.
        """
        most = min(max(1, int(COSINES * self.span ** (2.0 / 3.0))), round(self.blocks) - 1)
        cosines = _cosines(len(self.changes), most)
        fitted = cosines @ self.reported
        white = self.variance * (cosines * self.shares) @ cosines.T
        white -= fitted @ self.inverse @ fitted.T
        values, turn = np.linalg.eigh(white)
        kept = values > RANK * self.variance
        if not kept.any():
            return np.inf, 0
        squares = (turn.T @ (cosines @ self.changes))[kept] ** 2 / values[kept]
        free = int(np.count_nonzero(kept))
        return float(self.variance * squares.mean() / _loss(self.span, free)), free

    def interval(self) -> tuple[float, int, float]:
        """Return half width, degrees of freedom and independent stretches."""
        variance, free = self.long_run()
        if not free:
            return np.inf, 0, self.stretches
        return float(t_distribution.ppf(0.975, free) * np.sqrt(variance)), free, self.stretches


def long_run(parts: Array, count: int) -> LongRun:
    """Return intervals of the last weights under residuals correlated over blocks.

    By the equal-weighted cosine estimator (Lazarus, Lewis, Stock, Watson, J. Bus. Econ. Stat.
    36(4), 2018). Slow disturbances, such as wind, are in the first cosines as they are in the mean.

    Args:
        parts: Gram matrix of each block, of regressors and target, shape (blocks, n + 1, n + 1).
        count: of the last weights, m; the others are fitted beside them.
    """
    whole = parts.sum(axis=0)
    inverse = pseudo_inverse(whole[:-1, :-1])
    own = inverse[len(inverse) - count :]
    scores = parts[:, :-1, -1] - parts[:, :-1, :-1] @ (inverse @ whole[:-1, -1])
    changes, reported = scores @ own.T, own @ parts[:, :-1, :-1]
    found = np.zeros((3, count))
    for k, row in enumerate(own):
        variance = float(inverse.diagonal()[len(inverse) - count + k])
        if variance > RANK:
            shares = reported[:, k] @ row / variance
            each = _Influence(changes[:, k], reported[:, k], inverse, variance, shares)
            found[:, k] = each.interval()
    return LongRun(*found)


def _cosines(blocks: int, count: int) -> Array:
    """Return cosines of type II, without the constant, (count, blocks)."""
    middle = (np.arange(blocks) + 0.5) / blocks
    return np.asarray(np.cos(np.pi * np.outer(np.arange(1, count + 1), middle)))


@cache
def _loss(blocks: int, count: int) -> float:
    """Return the cosines' variance as a share of the mean's, of blocks correlated as stated."""
    apart = np.subtract.outer(np.arange(blocks), np.arange(blocks))
    alike, cosines = CORRELATION ** np.abs(apart), _cosines(blocks, count)
    seen = np.einsum("ki,ij,kj->", cosines, alike, cosines) / np.sum(cosines**2)
    return float(seen / (alike.sum() / blocks))
