"""Least squares whose errors are those of white residuals, as textbooks have them."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as f_distribution
from scipy.stats import t as t_distribution

from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds

Array = NDArray[np.float64]
Index = NDArray[np.intp]
_Kind = TypeVar("_Kind", bound="WhiteSums")


class WhiteSums(BlockRegression):
    """Sums that take each row for independent of all others, to show what blocks are good for."""

    def __init__(self, gram: BlockGram, thresholds: Thresholds = DEFAULT_THRESHOLDS) -> None:
        """Assemble the products, and count the rows."""
        super().__init__(gram, thresholds)
        self._rows = int(sum(place.rows.sum() for place in gram.places))

    def _like(self: _Kind) -> _Kind:
        """Return a regression of the same kind and rows, without Gram matrices."""
        other = super()._like()
        other._rows = self._rows
        return other

    def covariance(self, base: Index, columns: Index) -> Array:
        """Return σ²·(XᵀX)⁻¹, the columns' part."""
        both = np.concatenate([base, columns])
        bread = np.linalg.pinv(self._whole.at(both, both), rcond=1e-9, hermitian=True)
        own, scale = slice(len(base), None), self._lengths[columns]
        variance = self.squares_of(both) / self._free(both)
        return np.asarray(variance * bread[own, own] / np.outer(scale, scale))

    def p_value(self, base: Index, columns: Index) -> float:
        """Return the probability of so large a gain by chance, by the F test over rows."""
        both = np.concatenate([base, columns])
        after, free = self.squares_of(both), self._free(both)
        gained = (self.squares_of(base) - after) / len(columns)
        return float(f_distribution.sf(gained / (after / free), len(columns), free))

    def half_width(self, base: Index, columns: Index) -> Array:
        """Return half the widths of 95 % intervals of the weights of columns beside a base."""
        factor = t_distribution.ppf(0.975, self._free(np.concatenate([base, columns])))
        variances = np.diag(self.covariance(base, columns))
        return np.asarray(factor * np.sqrt(np.maximum(variances, 0.0)))

    def _free(self, columns: Index) -> int:
        return max(1, self._rows - len(columns))
