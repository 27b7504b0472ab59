"""How far the sensors' noise throws an estimate, and to which side, by drawing it once more."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from cspm_ident.estimation import Estimate, Problem, Solution
from cspm_ident.estimation.estimate import without_unknown
from cspm_ident.estimation.noise import whiten_channels
from cspm_ident.estimation.nonlinear import white_jacobian, white_residual
from cspm_ident.estimation.parameter import free_indices, scales

Array = NDArray[np.float64]

DRAWS = 24
# Draws of which the opposite is looked at as well, so that only the bias is left of both.
PAIRS = 6
# Columns of the scaled Jacobian below this share of the largest say nothing.
_ROUNDING = 1e-6
_TINY = 1e-300


def noise_changes(problem: Problem, redrawn: Iterable[Problem], theta: Array) -> list[list[Array]]:
    """Return by how much one more draw of all sensors' noise changes the residuals, per draw.

    Args:
        problem: its residuals, per window and kind of channel (samples, channels).
        redrawn: the same with one more draw of noise on all measured signals each.
        theta: where, shape (parameters,).
    """
    base = problem.residuals(theta)
    return [
        [changed - own for changed, own in zip(each.residuals(theta), base, strict=True)]
        for each in redrawn
    ]


class Scatter(NamedTuple):
    """What noise makes of each parameter.

    Attributes:
        sd: standard deviation, shape (parameters,); 0 where frozen.
        freedom: degrees of freedom that it is known with, shape (parameters,).
    """

    sd: Array
    freedom: Array


def noise_scatter(
    problem: Problem,
    solution: Solution,
    changes: Sequence[Sequence[Array]],
    windows: Sequence[int],
) -> Scatter:
    """Return how noise throws each parameter.

    Noise on the frame's pose passes through cables and bar, which ring for longer than a window
    lasts, so the residuals of a few windows determine its colour badly. Here it went through the
    model itself, and each draw takes one step from the optimum. Windows are independent of each
    other, so that their variances add up, with as many degrees of freedom (Satterthwaite 1946).

    Args:
        problem: what was solved.
        solution: of it.
        changes: of the residuals, as from `noise_changes`.
        windows: the window of each residual.
    """
    theta, noise, groups = solution.estimate.values, solution.noise, solution.groups
    free = free_indices(problem.parameters)
    unit = scales(problem.parameters)[free]
    columns = white_jacobian(problem, theta, noise, groups) * unit
    inverse = np.linalg.pinv(columns, rcond=_ROUNDING)
    starts = np.cumsum([0, *(part.size for part in solution.residuals)])
    steps = np.zeros((len(changes), max(windows) + 1, len(free)))
    for number, change in enumerate(changes):
        for i, (part, group) in enumerate(zip(change, groups, strict=True)):
            own = inverse[:, starts[i] : starts[i + 1]]
            steps[number, windows[i]] += own @ whiten_channels(noise[group], part).ravel()
    each = np.mean(np.square(steps), axis=0)
    total = each.sum(axis=0)
    freedom = np.ones(len(problem.parameters))
    freedom[free] = len(changes) * total**2 / np.maximum(np.sum(each**2, axis=0), _TINY)
    # A prior is a measurement, too, and its noise of one standard deviation is not drawn.
    sd = np.zeros(len(problem.parameters))
    sd[free] = np.sqrt(total + np.sum(inverse[:, starts[-1] :] ** 2, axis=1)) * unit
    return Scatter(sd, np.maximum(freedom, 1.0))


def widened(problem: Problem, estimate: Estimate, scatter: Scatter) -> Estimate:
    """Return the estimate with intervals no narrower than those of the scatter."""
    own = float(student.ppf(0.975, estimate.degrees_of_freedom)) * estimate.sd
    half = np.maximum(own, student.ppf(0.975, scatter.freedom) * scatter.sd)
    ends = np.stack([estimate.values - half, estimate.values + half], axis=1)
    ends[np.isnan(estimate.ci95)] = np.nan
    method = f"{estimate.method}, at least that of redrawn noise"
    found = replace(estimate, sd=np.maximum(estimate.sd, scatter.sd), ci95=ends, method=method)
    return without_unknown(found, problem.parameters)


class Bias(NamedTuple):
    """To which side noise throws each parameter.

    Attributes:
        values: estimate less truth, shape (parameters,); 0 where frozen.
        sd: standard deviation of that mean, shape (parameters,).
    """

    values: Array
    sd: Array


def noise_bias(
    problem: Problem, solution: Solution, pairs: Iterable[tuple[Problem, Problem]]
) -> Bias:
    """Return to which side noise throws each parameter.

    Noise on a signal that drives the model is both in the residuals and in their derivatives,
    which draws the estimate to one side, in proportion to the noise's variance. As much noise once
    more throws it as far once more (SIMEX along a straight line, Cook and Stefanski 1994); a
    Gauss-Newton step from the optimum shows where to.

    Args:
        problem: what was solved.
        solution: of it.
        pairs: the same with one more draw of noise on all measured signals, and with its opposite.
    """
    own = _step(problem, solution)
    steps = [0.5 * (_step(one, solution) + _step(other, solution)) - own for one, other in pairs]
    free = free_indices(problem.parameters)
    values, sd = np.zeros((2, len(problem.parameters)))
    values[free] = np.mean(steps, axis=0)
    sd[free] = np.std(steps, axis=0, ddof=1) / np.sqrt(len(steps))
    return Bias(values, sd)


def without_bias(problem: Problem, estimate: Estimate, bias: Bias) -> Estimate:
    """Return the estimate less its bias, whose own uncertainty widens the intervals.

    What was frozen, is not excited or lies on a bound stays as it is.
    """
    moves = np.isfinite(estimate.ci95).all(axis=1)
    moves &= np.array([name not in estimate.at_bound for name in estimate.names])
    limits = np.array([(p.lower, p.upper) for p in problem.parameters])
    values = np.clip(estimate.values - bias.values, limits[:, 0], limits[:, 1])
    values = np.where(moves, values, estimate.values)
    with np.errstate(invalid="ignore"):
        half = 0.5 * np.diff(estimate.ci95, axis=1)[:, 0]
        sd = np.hypot(estimate.sd, bias.sd)
        half = np.where(moves, half * sd / np.maximum(estimate.sd, _TINY), half)
        ends = np.stack([values - half, values + half], axis=1)
    return replace(
        estimate,
        values=values,
        sd=np.where(moves, sd, estimate.sd),
        ci95=np.where(moves[:, None], ends, estimate.ci95),
        method=f"{estimate.method}, less its bias",
    )


def _step(problem: Problem, solution: Solution) -> Array:
    """Return the Gauss-Newton step of the free parameters from the solution, shape (free,)."""
    theta, noise, groups = solution.estimate.values, solution.noise, solution.groups
    unit = scales(problem.parameters)[free_indices(problem.parameters)]
    columns = white_jacobian(problem, theta, noise, groups) * unit
    residual = white_residual(problem, theta, noise, groups)
    return np.asarray(-np.linalg.pinv(columns, rcond=_ROUNDING) @ residual) * unit
