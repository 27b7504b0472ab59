"""Comparison of two models by their squared residuals, block by block."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm, wilcoxon

Array = NDArray[np.float64]


def behind(worse: Array) -> float:
    """Return the standard deviations of a normal by which blocks are worse.

    By Wilcoxon's signed-rank test, which no single outlying block decides.
    """
    if not np.any(worse):
        return 0.0
    return float(norm.isf(wilcoxon(worse, alternative="greater").pvalue))


def paired(values: Array) -> Array:
    """Return sums over blocks two by two, (⌈blocks / 2⌉, …).

    Model-form errors are correlated over more than a block. Single blocks would make a difference
    between two imperfect models appear significant.
    """
    return np.add.reduceat(values, np.arange(0, len(values), 2), axis=0)
