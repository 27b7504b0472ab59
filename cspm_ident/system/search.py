"""The optimum of parameters and initial states, found in turn."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from cspm_ident.estimation import Problem
from cspm_ident.estimation.parameter import free_indices, prior_rows, scales
from cspm_ident.system.choice import Chosen
from cspm_ident.system.machine import machine_with
from cspm_ident.system.shooting import Shooting
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]

# The initial states are free to first order only, so they are found anew for better parameters.
_MOST_PASSES = 12
_STILL = 1e-3  # scales
# Of a step, tried in turn until the residuals become smaller.
_SHARES = (1.0, 0.5, 0.25, 0.125)


def search(
    problem: Problem,
    machine: Testbed,
    chosen: Sequence[Chosen],
    shootings: Sequence[Shooting],
    theta: Array,
    progress: Callable[[str], None],
) -> tuple[Array, bool]:
    """Return where parameters and initial states stand still, and whether they came to.

    Residuals are weighted by sensor noise. No noise model is fitted on the way: what wrong
    parameters leave would pass for noise.

    Args:
        problem: its residuals are those of the shootings.
        machine: as described.
        chosen: what is fitted.
        shootings: the windows, whose initial states are moved.
        theta: where to start, shape (parameters,).
        progress: called with what is being done.

    Raises:
        InputError: nothing is free.
    """
    if not len(free_indices(problem.parameters)):
        raise InputError("identify system: nothing is free, allowed: at least one to be fitted")
    held, unit = theta, scales(problem.parameters)
    for number in range(_MOST_PASSES):
        progress(f"initial states and parameters, pass {number + 1}")
        for shooting in shootings:
            shooting.relinearise(machine_with(machine, chosen, theta))
        step, share = bounded_step(problem, theta, held)
        theta = theta + share * step
        if np.all(np.abs(step) <= _STILL * unit):
            return theta, True
        for shooting in shootings:
            shooting.follow(machine_with(machine, chosen, theta))
    return theta, False


def bounded_step(problem: Problem, theta: Array, held: Array) -> tuple[Array, float]:
    """Return the Gauss-Newton step within the bounds, and the share of it that is an advance.

    The linear problem with bounds is solved by an active set (Stark and Parker 1995).

    Args:
        problem: residuals over the sensors' noise, parameters.
        theta: where, shape (parameters,).
        held: what hardly excited parameters are held at, by one scale, shape (parameters,).
    """
    unit, free = scales(problem.parameters), free_indices(problem.parameters)
    residuals = _row(problem.residuals(theta))
    # What nothing excites must not wander off on the way; what is excited hardly feels one scale.
    # Counted in what the residuals still are, since far from the optimum noise is the least.
    far = max(1.0, float(np.sqrt(np.mean(np.square(residuals)))))
    where, means, deviations = prior_rows(problem.parameters)
    where, means = np.concatenate([where, free]), np.concatenate([means, held[free]])
    deviations = np.concatenate([deviations, unit[free] / far])

    def missing(values: Array) -> float:
        known = (values[where] - means) / deviations
        return float(np.sum(np.square(_row(problem.residuals(values)))) + np.sum(np.square(known)))

    parts = [part.reshape(-1, len(free)) for part in problem.jacobians(theta)]
    prior = np.zeros((len(where), len(free)))
    prior[np.arange(len(where)), np.searchsorted(free, where)] = 1.0 / deviations
    columns = np.concatenate([*parts, prior]) * unit[free]
    target = np.concatenate([residuals, (theta[where] - means) / deviations])
    limits = np.array([(p.lower, p.upper) for p in problem.parameters])[free].T
    found = lsq_linear(columns, -target, (limits - theta[free]) / unit[free], method="bvls")
    step = np.zeros(len(theta))
    step[free] = found.x * unit[free]
    least = float(np.sum(np.square(target)))
    share = next((share for share in _SHARES if missing(theta + share * step) < least), 0.0)
    return step, share


def _row(parts: Sequence[Array]) -> Array:
    return np.concatenate([part.ravel() for part in parts])
