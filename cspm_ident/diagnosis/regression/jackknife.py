"""Block jackknife: how leaving out one block at a time changes the weights of regressors."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as f_distribution

Array = NDArray[np.float64]

# Share of the largest eigenvalue below which an eigenvalue is a rounding error.
RANK = 1e-9


class Jackknife(NamedTuple):
    """Weights with their block jackknife, of regressors scaled to length 1.

    Attributes:
        weights: from all blocks, shape (m,).
        covariance: of the weights, shape (m, m).
        blocks: effective number of blocks with information on all weights together.
        blocks_of: effective number of blocks with information on each weight, shape (m,).
        shares: each block's share of the information, shape (blocks,).
        correlation: of the changes that two successive blocks make to each weight, (m,). Negative
            correlations count as 0.
    """

    weights: Array
    covariance: Array
    blocks: float
    blocks_of: Array
    shares: Array
    correlation: Array

    def spread(self) -> tuple[Array, Array]:
        """Return standard errors (m,) and their degrees of freedom (m,) for correlated blocks.

        The mean of a first-order process has (1 + ρ)/(1 − ρ) times the variance of independent
        blocks. This covers disturbances such as a slowly varying wind, of which a short recording
        has few states. The estimate of ρ is rough. So one degree of freedom is kept where there are
        blocks for it: with fewer, Student's factor would make every weight insignificant.
        """
        more = (1.0 + self.correlation) / (1.0 - self.correlation)
        errors = np.sqrt(np.maximum(np.diag(self.covariance), 1e-300) * more)
        return errors, np.maximum(self.blocks_of / more, np.minimum(self.blocks_of, 2.0)) - 1.0

    def dominant(self, share: float) -> int | None:
        """Return the index of the block with more than a share of the information, or None.

        A violent start holds nearly all information on a recording's speeds. Only the other blocks
        show whether the effect persists.

        Args:
            share: of the information, from 0 to 1.
        """
        most = int(np.argmax(self.shares))
        return most if self.shares[most] > share else None

    def chance(self) -> float:
        """Return the p-value of the weights under the hypothesis that all are 0, by Wald's test."""
        count = len(self.weights)
        if self.blocks <= count:
            return 1.0
        scale = np.sqrt(np.maximum(np.diag(self.covariance), 1e-300))
        sizes = self.weights / scale
        wald = sizes @ np.linalg.pinv(self.covariance / np.outer(scale, scale)) @ sizes
        return float(f_distribution.sf(wald / count, count, self.blocks - count))


def left_out(parts: Array, most_correlation: float) -> Jackknife:
    """Return the block jackknife of the weights (Bell and McCaffrey, Surv. Methodol. 28(2), 2002).

    Args:
        parts: Gram matrix of each block, of regressors and target, shape (blocks, m + 1, m + 1).
        most_correlation: upper limit of the correlation of successive blocks.
    """
    whole, count = parts.sum(axis=0), parts.shape[1] - 1
    inverse = pseudo_inverse(whole[:-1, :-1])
    reported = inverse @ parts[:, :-1, :-1]
    shares = np.einsum("bii->b", reported) / max(1, count)
    heard = shares > RANK
    weights = inverse @ whole[:-1, -1]
    others = whole - parts[heard]
    without = np.einsum(
        "bij,bj->bi",
        np.linalg.pinv(others[:, :-1, :-1], rcond=RANK, hermitian=True),
        others[:, :-1, -1],
    )
    apart, blocks = without - weights, max(1, int(np.count_nonzero(heard)))
    covariance = (blocks - 1) / blocks * apart.T @ apart
    together = 1.0 / max(float(np.sum(shares**2)), RANK)
    correlation = _successive_correlation(apart, most_correlation)
    return Jackknife(
        weights, covariance, together, _informative_blocks(reported, inverse), shares, correlation
    )


def _informative_blocks(reported: Array, inverse: Array) -> Array:
    """Return the effective number of blocks with information on each weight, (m,).

    From each block's share in the weight's variance under white noise (Satterthwaite, Biometrics
    Bull. 2(6), 1946). These shares are never negative, even for collinear regressors.

    Args:
        reported: the inverse Gram matrix times that of each block, (blocks, m, m).
        inverse: of the Gram matrix of all blocks, (m, m).
    """
    variance = np.einsum("bij,ij->bi", reported, inverse)
    whole = np.diag(inverse)
    shares = np.divide(variance, whole, out=np.zeros_like(variance), where=whole > RANK)
    return np.asarray(1.0 / np.maximum(np.sum(shares**2, axis=0), RANK))


def _successive_correlation(apart: Array, most: float) -> Array:
    """Return the correlation of rows (blocks, m) with the next row, clipped to 0 … `most`."""
    squares = np.maximum(np.sum(apart**2, axis=0), 1e-300)
    correlation = np.sum(apart[1:] * apart[:-1], axis=0) / squares
    return np.asarray(np.clip(correlation, 0.0, most))


def pseudo_inverse(gram: Array) -> Array:
    """Return the pseudo-inverse of a symmetric matrix in a third of `numpy.linalg.pinv`'s time."""
    values, vectors = np.linalg.eigh(gram)
    sizes = np.abs(values)
    kept = sizes > RANK * sizes.max(initial=0.0)
    own = vectors[:, kept]
    return np.asarray((own / values[kept]) @ own.T)
