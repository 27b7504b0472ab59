"""Least squares with coloured residuals where the model is not linear in its parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from cspm_ident.estimation.estimate import Interval
from cspm_ident.estimation.interval import Linearisation, make_estimate
from cspm_ident.estimation.linear import Solution, check_interval
from cspm_ident.estimation.noise import (
    Noise,
    effective_samples,
    fit_noise,
    rounding_floors,
    whiten_channels,
)
from cspm_ident.estimation.parameter import check_start, free_indices, prior_rows, scales
from cspm_ident.estimation.problem import Problem
from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]


def fit(
    problem: Problem,
    start: Sequence[float],
    *,
    whiten: bool = True,
    interval: Interval | None = None,
    max_order: int | None = None,
    iterations: int = 10,
    seed: int = 0,
    noise: Noise | None = None,
) -> Solution:
    """Estimate the parameters of a model that is simulated.

    Solves with the noise taken for white, models the residual as autoregressive noise, filters the
    residuals with it to white, and solves again until the values stand still.

    Args:
        problem: residuals, parameters, groups.
        start: values to start from, and which frozen parameters keep, shape (parameters,).
        whiten: see `fit_linear`.
        interval: see `fit_linear`.
        max_order: of the autoregression, see `fit_noise`.
        iterations: at most so many rounds of noise model and solution, with white and with
            coloured noise.
        seed: of the bootstrap.
        noise: of each group, where it is known; nothing of it is then taken from the residuals, and
            `whiten` says only whether it has their colour.

    Raises:
        InputError: start, residuals or groups do not fit, or nothing is free.
    """
    theta = check_start(problem.parameters, start)
    residuals = problem.residuals(theta)
    groups = _check_groups(problem, residuals)
    interval = check_interval(interval, whiten, max(part.shape[1] for part in residuals))
    floors = rounding_floors(residuals, groups)
    if noise is None:
        theta, residuals, noise = _alternate(
            problem,
            theta,
            residuals,
            groups,
            floors,
            (0, max_order) if whiten else (0,),
            iterations,
        )
    else:
        theta = _solve(problem, theta, noise, groups)
        residuals = problem.residuals(theta)
    model = _linearise(problem, theta, residuals, noise, groups, whiten, max_order, floors)
    method = "whitened output error" if whiten else "output error"
    estimate = make_estimate(problem.parameters, theta, model, interval, method, seed)
    return Solution(estimate, residuals, groups, noise)


_STILL = 1e-4  # scales


def _alternate(
    problem: Problem,
    theta: Array,
    residuals: list[Array],
    groups: tuple[str, ...],
    floors: Mapping[str, float],
    orders: Sequence[int | None],
    iterations: int,
) -> tuple[Array, list[Array], Noise]:
    """Return where solution and noise model stand still in turn, for one order after the other."""
    unit, free = scales(problem.parameters), free_indices(problem.parameters)
    # First the sizes alone: colour fitted to what a wrong start leaves would hide it for good.
    for order in orders:
        rounds = iterations if order != 0 or _sizes_matter(problem, residuals, groups) else 1
        for _ in range(rounds):
            noise = fit_noise(residuals, groups, order, floors, len(free))
            before = theta
            theta = _solve(problem, theta, noise, groups)
            residuals = problem.residuals(theta)
            if np.all(np.abs(theta - before) <= _STILL * unit):
                break
    return theta, residuals, fit_noise(residuals, groups, order, floors, len(free))


def _sizes_matter(problem: Problem, residuals: Sequence[Array], groups: Sequence[str]) -> bool:
    """Return whether white noise of another size would move the optimum."""
    several = len(set(groups)) > 1 or residuals[0].shape[1] > 1
    return several or len(prior_rows(problem.parameters)[0]) > 0


def _check_groups(problem: Problem, residuals: Sequence[Array]) -> tuple[str, ...]:
    groups = ("",) * len(residuals) if problem.groups is None else tuple(problem.groups)
    if len(groups) != len(residuals) or not residuals:
        raise InputError(
            f"{len(residuals)} residuals in {len(groups)} groups; "
            "allowed: a group for each residual, at least one"
        )
    return groups


def white_residual(problem: Problem, theta: Array, noise: Noise, groups: Sequence[str]) -> Array:
    """Return all residuals with noise N(0, 1) and the priors' behind them, in one row."""
    parts = [
        whiten_channels(noise[group], part).ravel()
        for group, part in zip(groups, problem.residuals(theta), strict=True)
    ]
    where, mean, sd = prior_rows(problem.parameters)
    return np.concatenate([*parts, (theta[where] - mean) / sd])


def white_jacobian(problem: Problem, theta: Array, noise: Noise, groups: Sequence[str]) -> Array:
    """Return the derivative of `white_residual` by the free parameters, shape (rows, free)."""
    free = free_indices(problem.parameters)
    parts = _white_jacobians(problem, theta, noise, groups)
    where, _, sd = prior_rows(problem.parameters)
    prior = np.zeros((len(where), len(free)))
    prior[np.arange(len(where)), np.searchsorted(free, where)] = 1.0 / sd
    return np.concatenate([*(part.reshape(-1, len(free)) for part in parts), prior])


def solve_free(
    problem: Problem,
    theta: Array,
    noise: Noise,
    groups: Sequence[str],
    free: NDArray[np.intp],
) -> tuple[Array, float]:
    """Return the optimum over some free parameters, and the sum of squares there.

    Args:
        problem: residuals and parameters.
        theta: where to start, shape (parameters,).
        noise: how residuals are weighted.
        groups: the group of each residual.
        free: indices of the parameters that may move.
    """
    unit = scales(problem.parameters)[free]
    columns = np.searchsorted(free_indices(problem.parameters), free)

    def whole(some: Array) -> Array:
        result = theta.copy()
        result[free] = some * unit
        return np.asarray(result)

    def residual(some: Array) -> Array:
        return white_residual(problem, whole(some), noise, groups)

    def jacobian(some: Array) -> Array:
        rows = white_jacobian(problem, whole(some), noise, groups)
        return np.asarray(rows[:, columns] * unit)

    lower = np.array([problem.parameters[i].lower for i in free]) / unit
    upper = np.array([problem.parameters[i].upper for i in free]) / unit
    found = least_squares(
        residual, theta[free] / unit, jacobian, (lower, upper), ftol=1e-10, xtol=1e-8, gtol=1e-10
    )
    return whole(found.x), 2.0 * float(found.cost)


def _solve(problem: Problem, theta: Array, noise: Noise, groups: Sequence[str]) -> Array:
    return solve_free(problem, theta, noise, groups, free_indices(problem.parameters))[0]


def _white_jacobians(
    problem: Problem, theta: Array, noise: Noise, groups: Sequence[str]
) -> list[Array]:
    parts = problem.jacobians(theta)
    return [whiten_channels(noise[g], part) for g, part in zip(groups, parts, strict=True)]


def _linearise(
    problem: Problem,
    theta: Array,
    residuals: Sequence[Array],
    noise: Noise,
    groups: Sequence[str],
    white: bool,
    max_order: int | None,
    floors: Mapping[str, float],
) -> Linearisation:
    count = len(free_indices(problem.parameters))
    coloured = noise if white else fit_noise(residuals, groups, max_order, floors, count)
    return Linearisation(
        [whiten_channels(noise[g], part) for g, part in zip(groups, residuals, strict=True)],
        _white_jacobians(problem, theta, noise, groups),
        problem.rounding,
        effective_samples(coloured, residuals, groups),
        white,
    )
