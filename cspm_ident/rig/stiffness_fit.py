"""The stiffness law fitted to branches of several lengths, thesis (3-8)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.estimation import Estimate, Interval, Parameter, Problem, fit
from cspm_ident.rig.branches import Branch
from cspm_ident.rig.law import Law

Array = NDArray[np.float64]

NAMES = ("a", "b", "c", "d", "rigidity")
UNITS = ("N*m^(b-1)", "1", "1/N", "1/N", "N")
# Where the search for the bend of the law begins; it covers cables from soft to stiff.
START_C, START_D = (0.001, 0.005, 0.02), (-0.03, -0.1, -0.3, -1.0)
# Share of a specimen's points on the asymptote from which on it counts as seen.
ASYMPTOTE_SHARE = 0.05


class Fitted(NamedTuple):
    """A fitted law.

    Attributes:
        law: its values.
        estimate: `NAMES` with intervals.
        asymptote: whether the data reaches the asymptote E·A/l; else `rigidity` means nothing.
        jacobians: of the residuals, by specimen and branch, (n, 5).
        sizes: of each specimen's residuals, by which they are weighted [N/m].
        parameters: `NAMES` as they were fitted.
        fits: whether the scatter of the cycles explains what the law leaves.
    """

    law: Law
    estimate: Estimate
    asymptote: bool
    jacobians: list[list[Array]]
    sizes: list[float]
    parameters: list[Parameter]
    fits: bool = True


def fit_law(groups: Sequence[Sequence[Branch]], floor: float) -> Fitted:
    """Return the law of least Euclidean norm of measured less modelled stiffness, thesis (3-8).

    The intervals are those of the residuals alone (a sandwich of sums over blocks); see
    `law_interval` for what the cycles say. With cables of one length the exponent b stays at 1,
    Hooke's.

    Args:
        groups: the branches of each specimen; specimens weigh by the size of their residuals.
        floor: tension below which the law stays constant [N]; no part of the fit.

    Raises:
        InputError: the data does not suffice.
    """
    branches = [branch for group in groups for branch in group]
    labels = [str(i) for i, group in enumerate(groups) for _ in group]
    start = _start(branches, floor)
    lengths = [float(np.mean(branch.length)) for branch in branches]
    several = max(lengths) > 1.02 * min(lengths)

    def residual(theta: Array) -> list[Array]:
        law = _law(theta, floor)
        return [one.stiffness - law.stiffness(one.tension, one.length) for one in branches]

    parameters = _parameters(start, several)
    problem = Problem(residual, parameters, labels)
    found = fit(problem, list(start[:5]), whiten=False, interval=Interval.SANDWICH)
    estimate = found.estimate
    law = _law(estimate.values, floor)
    sizes = [found.noise[str(i)].channels[0].process_variance ** 0.5 for i in range(len(groups))]
    parts = iter(_jacobians(problem, estimate.values))
    rows = [[next(parts) for _ in group] for group in groups]
    return Fitted(law, estimate, _reaches(law, branches, estimate), rows, sizes, parameters)


def _jacobians(problem: Problem, values: Array) -> list[Array]:
    """Return the derivatives of the residuals, (n, 5) each; those of frozen values are zero."""
    free = [i for i, parameter in enumerate(problem.parameters) if not parameter.frozen]
    found = []
    for part in problem.jacobians(values):
        whole = np.zeros((len(part), len(problem.parameters)))
        whole[:, free] = part[:, 0]
        found.append(whole)
    return found


def _law(values: Array, floor: float) -> Law:
    a, b, c, d, rigidity = (float(value) for value in values)
    return Law(a, b, c, d, rigidity, floor)


def above_cap(law: Law, branch: Branch) -> NDArray[np.bool_]:
    """Return which points of a branch lie on the asymptote, (n,)."""
    return law.uncapped(branch.tension, branch.length) > law.rigidity / branch.length


def _reaches(law: Law, branches: Sequence[Branch], estimate: Estimate) -> bool:
    share = max(float(np.mean(above_cap(law, branch))) for branch in branches)
    low, high = estimate.interval("rigidity")
    return share >= ASYMPTOTE_SHARE and bool(np.isfinite([low, high]).all()) and low > 0.0


def _parameters(start: Law, several_lengths: bool) -> list[Parameter]:
    a, _, _, _, rigidity, _ = start
    return [
        Parameter("a", UNITS[0], 1e-3 * a, 1e3 * a, scale=a),
        Parameter("b", UNITS[1], 0.0, 4.0, scale=0.5, frozen=not several_lengths),
        Parameter("c", UNITS[2], 0.0, 1.0, scale=0.02),
        Parameter("d", UNITS[3], -50.0, -1e-6, scale=0.2),
        Parameter("rigidity", UNITS[4], 1e-2 * rigidity, 1e3 * rigidity, scale=rigidity),
    ]


def _start(branches: Sequence[Branch], floor: float) -> Law:
    """Return the best of a grid of bends, each with the scale that fits it best."""
    rigidity = max(float(np.quantile(one.stiffness * one.length, 0.95)) for one in branches)
    found = []
    for c in START_C:
        for d in START_D:
            shape = Law(1.0, 1.0, c, d, np.inf, floor)
            models = [shape.uncapped(one.tension, one.length) for one in branches]
            pairs = list(zip(models, branches, strict=True))
            scale = sum(float(m @ one.stiffness) for m, one in pairs)
            law = shape._replace(a=scale / sum(float(m @ m) for m in models), rigidity=rigidity)
            misfit = sum(
                float(np.sum((one.stiffness - law.stiffness(one.tension, one.length)) ** 2))
                for one in branches
            )
            found.append((misfit, law))
    return min(found)[1]
