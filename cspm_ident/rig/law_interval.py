"""Intervals of a stiffness law, from cycles that repeat each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from cspm_ident.estimation import Estimate
from cspm_ident.estimation.estimate import without_unknown
from cspm_ident.rig.branches import Branch
from cspm_ident.rig.cycle_scatter import chance_of_misfit, deviations, score_covariance
from cspm_ident.rig.response import Response
from cspm_ident.rig.stiffness_fit import Fitted

Array = NDArray[np.float64]

# A misfit that chance makes less often than this is counted.
CHANCE = 0.05


class _Spread(NamedTuple):
    """Covariance of the known parameters, and degrees of freedom of each variance."""

    covariance: Array
    freedom: Array


def with_intervals(found: Fitted, groups: Sequence[Sequence[Branch]], response: Response) -> Fitted:
    """Return a fitted law with intervals of what its cycles and encoders leave open.

    The scatter of the cycles is that of the noise, whatever its colour: a stiffness is a quotient
    of differences, whose noise cancels in sums, and a window over the residuals of their mean is
    never long enough for that. To it comes where encoders rest, which is equal in all cycles. Both
    move the law farther than the residuals alone do, since what the filter did follows from the
    law. Where the residuals are more than the scatter leaves in their mean, the law does not fit:
    then their own interval (a sandwich) is given where it is the wider one.

    Args:
        found: fitted to the branches.
        groups: the branches, by specimen.
        response: of these specimens and branches.
    """
    estimate = found.estimate
    known = np.flatnonzero(np.isfinite(estimate.sd) & (estimate.sd > 0.0))
    if not known.size:
        return found
    rows = [[each[:, known] for each in group] for group in found.jacobians]
    weighted = [
        [each / size**2 for each in group] for group, size in zip(rows, found.sizes, strict=True)
    ]
    direct = _product(weighted, rows)
    bread = np.asarray(np.linalg.inv(direct + _product(weighted, response.law, known)), dtype=float)
    spread = _spread(found, groups, weighted, response, bread)
    half = student.ppf(0.975, spread.freedom) * np.sqrt(np.diag(spread.covariance))
    fits = chance_of_misfit(groups, found.law, found.sizes, len(known)) >= CHANCE
    if not fits:
        half = np.maximum(half, _of_residuals(estimate, known, bread @ direct))
    widened = _estimate(estimate, known, half, spread)
    return found._replace(estimate=without_unknown(widened, found.parameters), fits=fits)


def _product(
    left: Sequence[Sequence[Array]],
    right: Sequence[Sequence[Array]],
    columns: NDArray[np.intp] | None = None,
) -> Array:
    total = 0.0
    for mine, others in zip(left, right, strict=True):
        for one, other in zip(mine, others, strict=True):
            total = total + one.T @ (other if columns is None else other[:, columns])
    return np.asarray(total)


def _spread(
    found: Fitted,
    groups: Sequence[Sequence[Branch]],
    weighted: Sequence[Sequence[Array]],
    response: Response,
    bread: Array,
) -> _Spread:
    """Return what noise and resting encoders do to the law (degrees: Satterthwaite 1946)."""
    noise, rests, counts = [], np.zeros_like(bread), []
    parts = zip(groups, weighted, response.lowest, response.rests, strict=True)
    for group, mine, lowest, places in parts:
        pairs = zip(group, lowest, strict=True)
        each = [deviations(one, found.law) + changes for one, changes in pairs]
        noise.append(bread @ score_covariance(each, mine) @ bread.T)
        counts.append(len(each[0]))
        for changes in places:
            score = sum(change @ part for change, part in zip(changes, mine, strict=True))
            rests = rests + np.outer(bread @ score, bread @ score)
    covariance = sum(noise) + rests
    single = np.diagonal(np.array(noise), axis1=1, axis2=2)
    below = (single**2 / (np.array(counts) - 1.0)[:, None]).sum(axis=0)
    return _Spread(covariance, np.diag(covariance) ** 2 / below)


def _of_residuals(estimate: Estimate, known: NDArray[np.intp], follow: Array) -> Array:
    """Return the half widths that the residuals alone give, where the law follows itself."""
    sd = estimate.sd[known]
    covariance = estimate.correlation[np.ix_(known, known)] * np.outer(sd, sd)
    quantile = float(student.ppf(0.975, estimate.degrees_of_freedom))
    return np.asarray(quantile * np.sqrt(np.diag(follow @ covariance @ follow.T)))


def _estimate(
    estimate: Estimate, known: NDArray[np.intp], half: Array, spread: _Spread
) -> Estimate:
    sd, ends, correlation = estimate.sd.copy(), estimate.ci95.copy(), estimate.correlation.copy()
    own = np.sqrt(np.diag(spread.covariance))
    sd[known] = np.maximum(own, half / student.ppf(0.975, spread.freedom))
    ends[known] = estimate.values[known, None] + half[:, None] * np.array([-1.0, 1.0])
    correlation[np.ix_(known, known)] = spread.covariance / np.outer(own, own)
    return replace(
        estimate,
        sd=sd,
        ci95=ends,
        correlation=correlation,
        degrees_of_freedom=float(spread.freedom.min()),
        method="output error, scatter of the cycles",
    )
