"""A finding's parameters in public names and SI units, with their 95 % intervals."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_sim.effects import EffectParameter

Array = NDArray[np.float64]


class Coefficients(NamedTuple):
    """The fitted coefficients of an effect on one element, of m columns.

    Attributes:
        candidate: the effect, its element and its nonlinear parameters.
        values: shape (m,).
        half_widths: half widths of their 95 % intervals, (m,); infinite where the data give none.
        upper_ends: where the effect may also act at other time constants, the upper ends of the
            intervals of the sum over all of them, (m,); None elsewhere.
    """

    candidate: Candidate
    values: Array
    half_widths: Array
    upper_ends: Array | None = None


class Parameter(NamedTuple):
    """A parameter of an effect on one element.

    Attributes:
        element: the element on which the effect acts.
        name: public name.
        value: in `unit`.
        unit: SI.
        low, high: ends of its 95 % interval, within the catalogue's bounds. They equal the value
            where it was searched on a grid.
        is_open: whether the ends are the catalogue's bounds, because the data give none.
    """

    element: str
    name: str
    value: float
    unit: str
    low: float
    high: float
    is_open: bool = False

    @property
    def ci95(self) -> tuple[float, float] | None:
        """Its 95 % interval (low, high), or None."""
        return (self.low, self.high) if self.low < self.high and not self.is_open else None


def parameters_of(own: Coefficients) -> list[Parameter]:
    """Return the parameters of an effect on one element."""
    effect, weights, widths = own.candidate.effect, own.values, own.half_widths
    values = effect.values(weights.tolist(), **own.candidate.nonlinear)
    element = own.candidate.element
    if not np.all(np.isfinite(widths)):
        return [
            _parameter(element, p, values[p.name], p.minimum, p.maximum) for p in effect.parameters
        ]
    upper = -np.inf if own.upper_ends is None else own.upper_ends
    ends = _ends(own.candidate, weights, weights - widths, np.maximum(weights + widths, upper))
    return [
        _parameter(
            element,
            p,
            values[p.name],
            min(values[p.name], max(p.minimum, low)),
            max(values[p.name], min(p.maximum, high)),
        )
        for p, (low, high) in zip(effect.parameters, ends, strict=True)
    ]


def _ends(
    candidate: Candidate, weights: Array, low: Array, high: Array
) -> list[tuple[float, float]]:
    """Return the intervals of an effect's parameters from those of its weights.

    Each weight moves a parameter down and up within its own interval; these changes add in squares
    (GUM, JCGM 100:2008, 5.1.2). So the interval of an amplitude does not depend on its phase.
    """
    names = [p.name for p in candidate.effect.parameters]

    def values(moved: Array) -> Array:
        found = candidate.effect.values(moved.tolist(), **candidate.nonlinear)
        return np.array([found[name] for name in names])

    reported = values(weights)
    squares = np.zeros((2, len(names)))
    for k in range(len(weights)):
        ends = [low[k], high[k], np.clip(0.0, low[k], high[k])]
        moved = [values(np.where(np.arange(len(weights)) == k, end, weights)) for end in ends]
        apart = np.array([reported, *moved]) - reported
        squares += np.square([apart.min(axis=0), apart.max(axis=0)])
    return list(zip(reported - np.sqrt(squares[0]), reported + np.sqrt(squares[1]), strict=True))


def _parameter(
    element: str, own: EffectParameter, value: float, low: float, high: float
) -> Parameter:
    return Parameter(element, own.name, value, own.unit, low, high, own.is_open(low, high))
