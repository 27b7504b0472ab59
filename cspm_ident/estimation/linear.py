"""Least squares with coloured residuals: y = Φ·θ + noise."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from cspm_ident.estimation.estimate import Estimate, Interval
from cspm_ident.estimation.identifiability import find_excitation
from cspm_ident.estimation.interval import Linearisation, make_estimate
from cspm_ident.estimation.noise import (
    Noise,
    effective_samples,
    fit_noise,
    rounding_floors,
    whiten_channels,
)
from cspm_ident.estimation.parameter import Parameter, check_start, free_indices, prior_rows, scales
from cspm_ident.estimation.record import Record, check_records
from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]


class Solution(NamedTuple):
    """An estimate with what it leaves.

    Attributes:
        estimate: values and intervals.
        residuals: y − model at the estimate, per record, shape (n, channels).
        groups: the group of each record.
        noise: the model by which residuals were weighted.
    """

    estimate: Estimate
    residuals: list[Array]
    groups: tuple[str, ...]
    noise: Noise


def fit_linear(
    records: Sequence[Record],
    parameters: Sequence[Parameter],
    start: Sequence[float] | None = None,
    *,
    whiten: bool = True,
    interval: Interval | None = None,
    max_order: int | None = None,
    iterations: int = 20,
    seed: int = 0,
) -> Solution:
    """Estimate the parameters of a linear regression.

    Fits, models the residual as autoregressive noise, filters regressors and target to make it
    white, and repeats until the values stand still (feasible generalised least squares).

    Args:
        records: pieces without gaps; whitening, blocks and lags never span two of them.
        parameters: one for each column of the regressors.
        start: values that frozen parameters keep and from which what the data does not excite does
            not move, shape (parameters,); 0 if none are given.
        whiten: False weights by the size of the noise alone, i.e. plain least squares whose
            intervals nevertheless take the colour into account.
        interval: how the covariance is made; by default from the likelihood where the residuals
            of single channels were whitened, else as a sandwich, which also holds where channels
            are correlated over time.
        max_order: of the autoregression, see `fit_noise`.
        iterations: at most so many with white and so many with coloured noise.
        seed: of the bootstrap.

    Raises:
        InputError: records or parameters do not fit, or the likelihood's interval is requested
            without whitening.
    """
    channels = max((record.target.shape[1] for record in records), default=1)
    interval = check_interval(interval, whiten, channels)
    check_records(records, len(parameters))
    theta = check_start(parameters, np.zeros(len(parameters)) if start is None else start)
    origin, free = theta.copy(), free_indices(parameters)
    groups = tuple(record.group for record in records)
    floors = rounding_floors([record.target for record in records], groups)
    residuals = _residuals(records, theta)
    # First the sizes alone: colour fitted to what a wrong start leaves would hide it for good.
    for order in (0, max_order) if whiten else (0,):
        for _ in range(iterations):
            noise = fit_noise(residuals, groups, order, floors, len(free))
            before = theta
            theta, sd = _solve(records, parameters, origin, noise)
            residuals = _residuals(records, theta)
            if np.all(np.abs(theta - before) <= _STILL * sd):
                break
    noise = fit_noise(residuals, groups, order, floors, len(free))
    model = _linearise(records, residuals, noise, free, whiten, max_order, floors)
    method = "whitened least squares" if whiten else "least squares"
    estimate = make_estimate(parameters, theta, model, interval, method, seed)
    return Solution(estimate, residuals, groups, noise)


_STILL = 1e-2  # of a standard deviation


def check_interval(interval: Interval | None, whiten: bool, channels: int) -> Interval:
    """Return the kind of interval, by default the one that holds for the most channels of a group.

    Raises:
        InputError: the likelihood of white noise for residuals that were not made white.
    """
    if interval is None:
        return Interval.LIKELIHOOD if whiten and channels == 1 else Interval.SANDWICH
    if interval is Interval.LIKELIHOOD and not whiten:
        raise InputError(
            "interval likelihood without whitening would take coloured residuals for white; "
            "allowed: sandwich, bootstrap"
        )
    return interval


def _residuals(records: Sequence[Record], theta: Array) -> list[Array]:
    return [record.target - record.regressors @ theta for record in records]


def exact_rounding(rows: int) -> float:
    """Return the relative error of a matrix of exact numbers with so many rows."""
    return rows * float(np.finfo(float).eps)


def _solve(
    records: Sequence[Record], parameters: Sequence[Parameter], origin: Array, noise: Noise
) -> tuple[Array, Array]:
    """Return the optimum under a noise model, and the free parameters' sd; frozen ones have 1."""
    free = free_indices(parameters)
    rows, left = [], []
    for record in records:
        group = noise[record.group]
        rows.append(whiten_channels(group, record.regressors[:, :, free]).reshape(-1, len(free)))
        left.append(whiten_channels(group, record.target - record.regressors @ origin).ravel())
    stacked, target = np.concatenate(rows), np.concatenate(left)
    chosen = [parameters[i] for i in free]
    seen = find_excitation(stacked, chosen, exact_rounding(len(stacked))).basis
    projection = scales(chosen)[:, None] * seen
    where, mean, prior_sd = prior_rows(chosen)
    prior = projection[where] / prior_sd[:, None]
    matrix = np.concatenate([stacked @ projection, prior])
    goal = np.concatenate([target, (mean - origin[free][where]) / prior_sd])
    triangle = np.asarray(np.linalg.qr(np.column_stack([matrix, goal]), mode="r"))
    size = seen.shape[1]
    root, reduced = triangle[:size, :size], triangle[:size, size]
    theta, sd = origin.copy(), np.ones(len(parameters))
    if size:
        theta[free] += projection @ np.linalg.solve(root, reduced)
        sd[free] = np.linalg.norm(projection @ np.linalg.inv(root), axis=1) + 1e-300
    return _within(theta, parameters, origin, projection, root, reduced), sd


def _within(
    theta: Array,
    parameters: Sequence[Parameter],
    origin: Array,
    projection: Array,
    root: Array,
    reduced: Array,
) -> Array:
    """Return the solution, by bounded least squares where a bound holds it."""
    lower = np.array([p.lower for p in parameters])
    upper = np.array([p.upper for p in parameters])
    if np.all((lower <= theta) & (theta <= upper)):
        return theta
    free = free_indices(parameters)
    back = np.linalg.pinv(projection)
    bounds = lower[free] - origin[free], upper[free] - origin[free]
    unit = scales([parameters[i] for i in free])
    found = lsq_linear(root @ back * unit, reduced, (bounds[0] / unit, bounds[1] / unit))
    result = origin.copy()
    result[free] += found.x * unit
    return np.asarray(result)


def _linearise(
    records: Sequence[Record],
    residuals: Sequence[Array],
    noise: Noise,
    free: NDArray[np.intp],
    white: bool,
    max_order: int | None,
    floors: dict[str, float],
) -> Linearisation:
    groups = [record.group for record in records]
    coloured = noise if white else fit_noise(residuals, groups, max_order, floors, len(free))
    jacobians = [
        whiten_channels(noise[record.group], record.regressors[:, :, free]) for record in records
    ]
    return Linearisation(
        [whiten_channels(noise[g], r) for g, r in zip(groups, residuals, strict=True)],
        jacobians,
        exact_rounding(sum(j.shape[0] * j.shape[1] for j in jacobians)),
        effective_samples(coloured, residuals, groups),
        white,
    )
