"""What leaving out one block at a time does to the weights of columns."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as f_distribution

Array = NDArray[np.float64]

# Of the largest eigenvalue: what is smaller is rounding.
RANK = 1e-9


class Jackknife(NamedTuple):
    """What leaving out one block at a time does to weights, of columns of length 1.

    Attributes:
        weights: from all blocks, shape (m,).
        covariance: of the weights, shape (m, m).
        blocks: effective number of blocks that tell all of them.
        blocks_of: those that tell each weight, shape (m,).
        shares: of what is told, by block, shape (blocks,).
        alike: correlation of what two blocks in turn do to each weight, 0 where it is less, (m,).
    """

    weights: Array
    covariance: Array
    blocks: float
    blocks_of: Array
    shares: Array
    alike: Array

    def spread(self) -> tuple[Array, Array]:
        """Return standard errors (m,) and their degrees of freedom (m,), blocks being alike.

        As of a process of first order, whose mean scatters (1 + ρ)/(1 − ρ) times as much as that of
        independent blocks: a wind that wanders for seconds is met in few states by a short
        recording. How alike they are is seen roughly, so that it leaves one degree of freedom where
        there are blocks for it: with less, Student's factor says that nothing is known of anything.
        """
        more = (1.0 + self.alike) / (1.0 - self.alike)
        errors = np.sqrt(np.maximum(np.diag(self.covariance), 1e-300) * more)
        return errors, np.maximum(self.blocks_of / more, np.minimum(self.blocks_of, 2.0)) - 1.0

    def dominant(self, share: float) -> int | None:
        """Return the block that has more than a share of the information, None where none has.

        A violent start tells nearly all of a recording's speeds; that what it shows goes on
        afterwards is seen only without it.
        """
        most = int(np.argmax(self.shares))
        return most if self.shares[most] > share else None

    def chance(self) -> float:
        """Return the probability of weights as large by chance, by Wald's test."""
        count = len(self.weights)
        if self.blocks <= count:
            return 1.0
        scale = np.sqrt(np.maximum(np.diag(self.covariance), 1e-300))
        sizes = self.weights / scale
        wald = sizes @ np.linalg.pinv(self.covariance / np.outer(scale, scale)) @ sizes
        return float(f_distribution.sf(wald / count, count, self.blocks - count))


def left_out(parts: Array, most_alike: float) -> Jackknife:
    """Return how the weights scatter (Bell and McCaffrey, Surv. Methodol. 28(2), 2002).

    Args:
        parts: each block's products of columns and target, shape (blocks, m + 1, m + 1).
        most_alike: largest correlation of successive blocks that is allowed for.
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
    alike = _alike(apart, most_alike)
    return Jackknife(
        weights, covariance, together, _informative_blocks(reported, inverse), shares, alike
    )


def _informative_blocks(reported: Array, inverse: Array) -> Array:
    """Return how many blocks tell each weight, (m,), by their shares in its variance.

    That of white noise (Satterthwaite, Biometrics Bull. 2(6), 1946), which none can have less than
    nothing of: of columns that resemble each other as well.

    Args:
        reported: the inverse times each block's products, (blocks, m, m).
        inverse: of the products of all blocks, (m, m).
    """
    variance = np.einsum("bij,ij->bi", reported, inverse)
    whole = np.diag(inverse)
    shares = np.divide(variance, whole, out=np.zeros_like(variance), where=whole > RANK)
    return np.asarray(1.0 / np.maximum(np.sum(shares**2, axis=0), RANK))


def _alike(apart: Array, most: float) -> Array:
    """Return the correlation of rows (blocks, m) with the next, from 0 to `most`."""
    squares = np.maximum(np.sum(apart**2, axis=0), 1e-300)
    alike = np.sum(apart[1:] * apart[:-1], axis=0) / squares
    return np.asarray(np.clip(alike, 0.0, most))


def pseudo_inverse(gram: Array) -> Array:
    """Return what `numpy.linalg.pinv` does of a symmetric matrix, in a third of its time."""
    values, vectors = np.linalg.eigh(gram)
    sizes = np.abs(values)
    kept = sizes > RANK * sizes.max(initial=0.0)
    own = vectors[:, kept]
    return np.asarray((own / values[kept]) @ own.T)
