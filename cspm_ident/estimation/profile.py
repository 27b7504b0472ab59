"""Profile likelihood: how much worse the best fit becomes while one parameter is held."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.stats import t as student

from cspm_ident.estimation.linear import Solution
from cspm_ident.estimation.nonlinear import solve_free, white_jacobian, white_residual
from cspm_ident.estimation.parameter import free_indices
from cspm_ident.estimation.problem import Problem
from cspm_msgs_py.errors import ConvergenceError, InputError

Array = NDArray[np.float64]


class Profile(NamedTuple):
    """A profile and the interval in which it stays below its threshold.

    Attributes:
        name: of the parameter.
        unit: of its values.
        values: at which it was held, in rising order.
        deviance: −2·(log likelihood − its maximum) there, divided by `inflation`.
        threshold: of the deviance, for 95 %.
        inflation: how much more the estimate varies than it would, were the weighted residuals
            white; 1 where they are.
        ci95: ends; infinite where the profile stays below the threshold up to the bound, or as far
            as was looked.
    """

    name: str
    unit: str
    values: Array
    deviance: Array
    threshold: float
    inflation: float
    ci95: tuple[float, float]


def find_profile(problem: Problem, solution: Solution, name: str) -> Profile:
    """Return the profile likelihood of one parameter (Raue et al. 2009).

    The noise model stays that of the solution. Where it left colour, the threshold grows by the
    ratio of the variance that the solution states to the one that white residuals would have.

    Args:
        problem: what `fit` solved.
        solution: what `fit` returned.
        name: of a free parameter.

    Raises:
        InputError: no free parameter has this name.
        ConvergenceError: the profile found a better fit than the solution.
    """
    free = free_indices(problem.parameters)
    names = [problem.parameters[i].name for i in free]
    if name not in names:
        raise InputError(f"profile of {name!r}; allowed: {', '.join(names)}")
    index = int(free[names.index(name)])
    inflation = _inflation(problem, solution, index)
    trace = _Trace(problem, solution, index, inflation)
    quantile = float(student.ppf(0.975, solution.estimate.degrees_of_freedom))
    ends = tuple(_end(trace, sign, quantile**2) for sign in (-1.0, 1.0))
    values, deviance = np.array(sorted(trace.found.items())).T
    parameter = problem.parameters[index]
    return Profile(
        name, parameter.unit, values, deviance, quantile**2, inflation, (ends[0], ends[1])
    )


class _Trace:
    """Evaluates the profile, each time from the nearest solution known."""

    def __init__(self, problem: Problem, solution: Solution, index: int, inflation: float) -> None:
        estimate = solution.estimate
        self.problem, self.solution, self.index = problem, solution, index
        self.centre = float(estimate.values[index])
        sd, scale = float(estimate.sd[index]), problem.parameters[index].scale
        self.width = min(sd, scale) if isfinite(sd) and sd > 0.0 else 0.1 * scale
        self._inflation = inflation
        residual = white_residual(problem, estimate.values, solution.noise, solution.groups)
        self._base = float(residual @ residual)
        self._points = {self.centre: estimate.values}
        self.found = {self.centre: 0.0}

    def __call__(self, value: float) -> float:
        if value not in self.found:
            nearest = min(self._points, key=lambda known: abs(known - value))
            theta = self._points[nearest].copy()
            theta[self.index] = value
            theta, squares = self._minimum(theta)
            self._points[value] = theta
            self.found[value] = (squares - self._base) / self._inflation
            if self.found[value] < -_BETTER:
                name = self.problem.parameters[self.index].name
                raise ConvergenceError(
                    f"profile of {name}: a better fit at {value:g} than at the estimate; "
                    "start the fit from there"
                )
        return self.found[value]

    def _minimum(self, theta: Array) -> tuple[Array, float]:
        noise, groups = self.solution.noise, self.solution.groups
        others = free_indices(self.problem.parameters)
        others = others[others != self.index]
        if len(others):
            return solve_free(self.problem, theta, noise, groups, others)
        residual = white_residual(self.problem, theta, noise, groups)
        return theta, float(residual @ residual)


_BETTER = 1.0  # of the deviance: what the solver's tolerance and rounding cannot explain
_FARTHEST = 1000.0  # scales
_CLOSE = 1e-2  # of a standard deviation


def _end(trace: _Trace, sign: float, threshold: float) -> float:
    """Return where the profile crosses the threshold on one side, by doubling and bisection."""
    parameter = trace.problem.parameters[trace.index]
    bound = parameter.upper if sign > 0.0 else parameter.lower
    inner, step = trace.centre, trace.width
    while abs(inner - trace.centre) < _FARTHEST * parameter.scale and inner != bound:
        outer = inner + sign * step
        outer = bound if sign * (outer - bound) > 0.0 else outer
        if trace(outer) > threshold:
            return _crossing(trace, inner, outer, threshold, trace.width * _CLOSE)
        inner, step = outer, 2.0 * step
    return sign * inf


def _crossing(
    trace: Callable[[float], float], inner: float, outer: float, threshold: float, close: float
) -> float:
    # The root of the deviance is nearly straight, so that few steps suffice.
    root = np.sqrt(threshold)
    low, high = sorted((inner, outer))
    found = brentq(lambda value: np.sqrt(max(trace(value), 0.0)) - root, low, high, xtol=close)
    return float(found)


def _inflation(problem: Problem, solution: Solution, index: int) -> float:
    """Return the stated variance over the one that white residuals would have."""
    free = free_indices(problem.parameters)
    jacobian = white_jacobian(problem, solution.estimate.values, solution.noise, solution.groups)
    variance = np.diag(np.linalg.pinv(jacobian.T @ jacobian))
    stated = solution.estimate.sd[free] ** 2
    known = np.isfinite(stated) & (variance > 0.0)
    if not known.any():
        return 1.0
    ratio = stated[known] / variance[known]
    own = free[known] == index
    return float(ratio[own][0] if own.any() else np.median(ratio))
