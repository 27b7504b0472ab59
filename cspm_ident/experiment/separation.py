"""How much of one explanation another cannot imitate, in a recording or along a planned motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation, in_noise
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS
from cspm_sim.effects import Effect

Array = NDArray[np.float64]


def with_shape(candidate: Candidate) -> Effect:
    """Return the candidate's effect, looked at with its own nonlinear parameters alone."""
    return candidate.effect.with_grid({k: (v,) for k, v in candidate.shape})


def separation(
    equations: Sequence[Equation],
    noise: Mapping[Place, Array],
    truth: Mapping[Candidate, Array],
    rivals: Sequence[Candidate],
) -> float:
    """Return what is left of `truth` when `rivals` and the nuisance are fitted to it.

    √Σ r² over all rows, each residual in units of its noise: the number of standard errors by which
    the rivals would lose if the noise were white. The T-criterion of Atkinson, Fedorov, Biometrika
    62(1), 1975.

    Args:
        equations: with the columns of all candidates.
        noise: of each residual; those that have none are left out.
        truth: candidates with the weights with which they act.
        rivals: candidates whose weights are free.
    """
    (known,) = in_noise([equations], noise)
    if not known:
        return 0.0
    target = np.concatenate([_acting(each, truth).reshape(-1) for each in known])
    table = _free(known, rivals)
    sizes = np.linalg.norm(table, axis=0)
    table = table[:, sizes > 0.0] / sizes[sizes > 0.0]
    if table.shape[1]:
        target = target - table @ np.linalg.lstsq(table, target, rcond=None)[0]
    return float(np.linalg.norm(target))


def decided(
    equations: Sequence[Equation],
    noise: Mapping[Place, Array],
    truth: Mapping[Candidate, Array],
    rivals: Sequence[Candidate],
) -> float:
    """Return the separation less what decides nothing, no model being so true.

    Arguments as of `separation`.
    """
    left = separation(equations, noise, truth, rivals)
    alone = separation(equations, noise, truth, ())
    form_error = DEFAULT_THRESHOLDS.model_form_error_share
    return float(np.sqrt(max(0.0, left**2 - form_error * alone**2)))


def _acting(equation: Equation, truth: Mapping[Candidate, Array]) -> Array:
    """Return what candidates with given weights add to a residual, (k, channels)."""
    out = np.zeros(equation.target.shape)
    for candidate, weights in truth.items():
        if candidate in equation.columns:
            out += equation.columns[candidate] @ weights
    return out


def _free(equations: Sequence[Equation], rivals: Sequence[Candidate]) -> Array:
    """Return the columns of the rivals and of each equation's own nuisance, one row per number."""
    starts = np.cumsum([0, *(each.nuisance.shape[2] for each in equations)])
    widths = [_width(equations, rival) for rival in rivals]
    rows = []
    for equation, first in zip(equations, starts[:-1], strict=True):
        shape = equation.target.shape
        parts = [
            equation.columns.get(rival, np.zeros((*shape, width)))
            for rival, width in zip(rivals, widths, strict=True)
        ]
        own = np.zeros((*shape, int(starts[-1])))
        if equation.nuisance.size:
            own[:, :, first : first + equation.nuisance.shape[2]] = equation.nuisance
        table = np.concatenate([*parts, own], axis=2)
        rows.append(table.reshape(shape[0] * shape[1], table.shape[2]))
    return np.concatenate(rows)


def _width(equations: Sequence[Equation], candidate: Candidate) -> int:
    found = (e.columns[candidate].shape[2] for e in equations if candidate in e.columns)
    return next(found, 0)
