"""How much of one explanation another cannot imitate, in a recording or along a planned motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.columns import Candidate, Place
from cspm_ident.diagnosis.equation import Equation, in_noise
from cspm_sim.effects import Effect

Array = NDArray[np.float64]


def with_shape(candidate: Candidate) -> Effect:
    """Return the candidate's effect, looked at with its own nonlinear parameters alone."""
    return replace(candidate.effect, nonlinear={k: (v,) for k, v in candidate.shape})


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
    starts = np.cumsum([0, *(each.nuisance.shape[2] for each in known)])
    widths = [_width(known, rival) for rival in rivals]
    acting, rows = [], []
    for equation, first in zip(known, starts[:-1], strict=True):
        shape = equation.target.shape
        effect = np.zeros(shape)
        for candidate, weights in truth.items():
            if candidate in equation.columns:
                effect += equation.columns[candidate] @ weights
        parts = [
            equation.columns.get(rival, np.zeros((*shape, width)))
            for rival, width in zip(rivals, widths, strict=True)
        ]
        own = np.zeros((*shape, int(starts[-1])))
        if equation.nuisance.size:
            own[:, :, first : first + equation.nuisance.shape[2]] = equation.nuisance
        table = np.concatenate([*parts, own], axis=2)
        acting.append(effect.reshape(-1))
        rows.append(table.reshape(-1, table.shape[2]))
    if not acting:
        return 0.0
    target, table = np.concatenate(acting), np.concatenate(rows)
    sizes = np.linalg.norm(table, axis=0)
    table = table[:, sizes > 0.0] / sizes[sizes > 0.0]
    if not table.shape[1]:
        return float(np.linalg.norm(target))
    return float(np.linalg.norm(target - table @ np.linalg.lstsq(table, target, rcond=None)[0]))


def _width(equations: Sequence[Equation], candidate: Candidate) -> int:
    found = (e.columns[candidate].shape[2] for e in equations if candidate in e.columns)
    return next(found, 0)
