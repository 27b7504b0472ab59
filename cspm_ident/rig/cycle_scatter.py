"""How far cycles that repeat each other lie apart, and whether a law fits their mean."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as fisher

from cspm_ident.rig.branches import Branch
from cspm_ident.rig.law import Law

Array = NDArray[np.float64]


def deviations(branch: Branch, law: Law) -> Array:
    """Return what a law leaves of each cycle, less what it leaves of the mean, (cycles, n) [N/m].

    Raises:
        ValueError: the branch is no mean of cycles.
    """
    if branch.scatter is None:
        raise ValueError("a branch without cycles has no scatter")
    modelled = law.stiffness(branch.tension + branch.scatter[:, 0], branch.length)
    found = branch.scatter[:, 1] - modelled
    return np.asarray(found - found.mean(axis=0))


def score_covariance(each: Sequence[Array], weighted: Sequence[Array]) -> Array:
    """Return the covariance of the scores of a specimen's mean, (p, p).

    Noise is taken to be independent from cycle to cycle, of whatever colour within; both branches
    of a cycle stay together.

    Args:
        each: deviations of the cycles, by branch (cycles, n).
        weighted: derivatives of the residuals, as they are weighted, by branch (n, p).
    """
    parts = [part @ rows for part, rows in zip(each, weighted, strict=True)]
    scores = np.sum(parts, axis=0)
    count = len(scores)
    return np.asarray(scores.T @ scores / (count * (count - 1.0)))


def chance_of_misfit(
    groups: Sequence[Sequence[Branch]], law: Law, sizes: Sequence[float], parameters: int
) -> float:
    """Return how often scatter alone leaves as much as the law does in the mean of the cycles.

    The F test of lack of fit against pure error, with as many degrees of freedom as there are
    independent samples.

    Args:
        groups: the branches of each specimen.
        law: that was fitted.
        sizes: of each specimen's residuals, as they were weighted [N/m].
        parameters: how many were fitted.
    """
    common, scattered, count = 0.0, 0.0, 0
    cycles = [[deviations(one, law) for one in group] for group in groups]
    for group, mine, size in zip(groups, cycles, sizes, strict=True):
        for one, each in zip(group, mine, strict=True):
            left = one.stiffness - law.stiffness(one.tension, one.length)
            common += float(left @ left) / size**2
            scattered += float(np.sum(each**2)) / (len(each) * (len(each) - 1.0)) / size**2
            count += len(left)
    independent = count * _independent_share([each for mine in cycles for each in mine])
    above = max(independent - parameters, 1.0)
    below = independent * float(np.mean([len(mine[0]) - 1.0 for mine in cycles]))
    return float(fisher.sf(common / above * independent / scattered, above, below))


def _independent_share(each: Sequence[Array]) -> float:
    """Return independent samples per sample, as far as mean squares are concerned."""
    lags = min(part.shape[1] for part in each) // 4
    products = [
        sum(float(np.mean(part[:, lag:] * part[:, : part.shape[1] - lag])) for part in each)
        for lag in range(lags + 1)
    ]
    ratios = np.array(products[1:]) / products[0]
    return float(1.0 / (1.0 + 2.0 * ratios @ ratios))
