"""Which combinations of parameters the data sees."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from cspm_ident.estimation.parameter import Parameter, scales

Array = NDArray[np.float64]

LARGEST_SD = 1.0  # in scales: known no better than the change that matters
LEAST_WEIGHT = 0.01  # share of a direction below which a parameter has no part in it
LEAST_NAMED = 0.05  # of the largest weight, to appear in the direction's name


class Direction(NamedTuple):
    """A combination of parameters that can change without the data showing it.

    Attributes:
        name: such as "bar mass + 0.98 hoist stiffness"; weights count scales of the parameters.
        weights: by parameter, the largest is 1.
        sd: predicted standard deviation along it, in scales of the parameter with weight 1;
            infinite where nothing is seen at all.
    """

    name: str
    weights: tuple[tuple[str, float], ...]
    sd: float

    def data(self) -> dict[str, Any]:
        """Return everything as plain data for JSON."""
        sd = self.sd if isfinite(self.sd) else None
        return {"direction": self.name, "weights": dict(self.weights), "sd_in_scales": sd}


class Excitation(NamedTuple):
    """The seen and the unseen part of the space of free parameters, in scales.

    Attributes:
        basis: orthonormal directions that the data sees, shape (free, seen).
        directions: the others, by name.
        unknown: free parameters with a part in one of those, shape (free,).
        rest: covariance that unseen directions of finite sd still lend to the parameters that have
            hardly a part in them, shape (free, free).
    """

    basis: Array
    directions: tuple[Direction, ...]
    unknown: NDArray[np.bool_]
    rest: Array


def find_excitation(
    jacobian: Array, parameters: Sequence[Parameter], rounding: float, inflation: float = 1.0
) -> Excitation:
    """Split the parameter space by the singular values of the scaled Jacobian.

    A direction is unseen where its predicted standard deviation exceeds one scale, or where its
    singular value is rounding. Priors have no part in this: what only they hold, the data does not
    excite.

    Args:
        jacobian: of the whitened residuals (noise variance 1) to the free parameters, (rows, free).
        parameters: the free ones.
        rounding: relative error of the Jacobian.
        inflation: factor on the variance where the noise is known not to be white with variance 1.
    """
    scaled = np.linalg.qr(jacobian * scales(parameters), mode="r")
    _, singular, transposed = np.linalg.svd(scaled, full_matrices=True)
    values = np.zeros(len(parameters))
    values[: len(singular)] = singular
    with np.errstate(divide="ignore"):
        sd = np.sqrt(inflation) / values
    sd[values <= rounding * values.max(initial=0.0)] = np.inf
    unseen = sd > LARGEST_SD
    basis = transposed.T
    part = np.sqrt(np.sum(basis[:, unseen] ** 2, axis=1))
    blind, weak = ~np.isfinite(sd), unseen & np.isfinite(sd)
    rest = (basis[:, weak] * sd[weak] ** 2) @ basis[:, weak].T
    directions = [
        *_directions(basis[:, blind], sd[blind], parameters),
        *_directions(basis[:, weak], sd[weak], parameters),
    ]
    return Excitation(basis[:, ~unseen], tuple(directions), part > LEAST_WEIGHT, rest)


def _directions(unseen: Array, sd: Array, parameters: Sequence[Parameter]) -> list[Direction]:
    """Name the unseen directions, each with one parameter that no other of them has."""
    count = unseen.shape[1]
    if count == 0:
        return []
    _, _, order = qr(unseen.T, mode="economic", pivoting=True)
    sparse = unseen @ np.linalg.inv(unseen[order[:count]])
    found = []
    for column in sparse.T:
        size = np.abs(column)
        # Of equal weights the first leads, so that a direction has one name.
        weights = column / column[np.argmax(size > 0.99 * size.max())]
        seen = float(np.linalg.norm((weights @ unseen) / sd))
        found.append(_direction(weights, 1.0 / seen if seen > 0.0 else np.inf, parameters))
    return found


def _direction(weights: Array, sd: float, parameters: Sequence[Parameter]) -> Direction:
    order = np.argsort(-np.round(np.abs(weights), 2), kind="stable")
    kept = [i for i in order if abs(weights[i]) >= LEAST_NAMED]
    parts = [parameters[kept[0]].name]
    for i in kept[1:]:
        share = f"{abs(weights[i]):.2g} " if abs(abs(weights[i]) - 1.0) >= 0.005 else ""
        parts.append(f"{'+' if weights[i] > 0.0 else '−'} {share}{parameters[i].name}")
    named = tuple((parameters[i].name, float(weights[i])) for i in kept)
    return Direction(" ".join(parts), named, sd)
