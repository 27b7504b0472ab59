"""What was estimated, and how well."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_ident.estimation.identifiability import LARGEST_SD, Direction
from cspm_ident.estimation.parameter import Parameter

Array = NDArray[np.float64]


class Interval(Enum):
    """How the intervals are made."""

    LIKELIHOOD = "likelihood"
    SANDWICH = "sandwich"
    BOOTSTRAP = "bootstrap"


@dataclass(frozen=True)
class Estimate:
    """Parameters with intervals.

    Attributes:
        names: of all parameters, frozen ones included.
        units: of the values.
        values: shape (parameters,).
        sd: standard deviations; infinite where not excited, 0 where frozen.
        ci95: lower and upper ends, shape (parameters, 2); (−∞, ∞) where the data does not excite
            the parameter, NaN where it was frozen.
        correlation: of the estimates, shape (parameters, parameters); NaN where sd is not finite
            or 0.
        frozen: names of those that kept their start value.
        at_bound: names of those that the bounds hold; their intervals are not valid, profile them.
        unexcited: combinations of parameters that the data does not see.
        effective_samples: how many independent samples say as much about a constant.
        degrees_of_freedom: of the t distribution that the intervals use.
        method: how values and intervals were made, in words.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: Array
    sd: Array
    ci95: Array
    correlation: Array
    frozen: tuple[str, ...]
    at_bound: tuple[str, ...]
    unexcited: tuple[Direction, ...]
    effective_samples: float
    degrees_of_freedom: float
    method: str

    def value(self, name: str) -> float:
        """Return the value of one parameter."""
        return float(self.values[self.names.index(name)])

    def interval(self, name: str) -> tuple[float, float]:
        """Return the interval of one parameter."""
        lower, upper = self.ci95[self.names.index(name)]
        return float(lower), float(upper)

    def without(self, name: str) -> Estimate:
        """Return the other parameters, with the intervals that they have beside that one."""
        kept = [i for i, each in enumerate(self.names) if each != name]
        return replace(
            self,
            names=tuple(self.names[i] for i in kept),
            units=tuple(self.units[i] for i in kept),
            values=self.values[kept],
            sd=self.sd[kept],
            ci95=self.ci95[kept],
            correlation=self.correlation[np.ix_(kept, kept)],
            frozen=tuple(each for each in self.frozen if each != name),
            at_bound=tuple(each for each in self.at_bound if each != name),
        )

    def data(self) -> dict[str, Any]:
        """Return everything as plain data for JSON; null means infinite or none."""
        return {
            "method": self.method,
            "effective_samples": self.effective_samples,
            "degrees_of_freedom": self.degrees_of_freedom,
            "parameters": [self._parameter(i) for i in range(len(self.names))],
            "correlation": [[_finite(value) for value in row] for row in self.correlation],
            "unexcited": [direction.data() for direction in self.unexcited],
        }

    def _parameter(self, i: int) -> dict[str, Any]:
        name, frozen = self.names[i], self.names[i] in self.frozen
        return {
            "name": name,
            "unit": self.units[i],
            "value": float(self.values[i]),
            "sd": None if frozen else _finite(self.sd[i]),
            "ci95": None if frozen else [_finite(end) for end in self.ci95[i]],
            "frozen": frozen,
            "at_bound": name in self.at_bound,
            "excited": bool(frozen or isfinite(self.sd[i])),
        }


def without_unknown(estimate: Estimate, parameters: Sequence[Parameter]) -> Estimate:
    """Return the estimate with parameters that it knows no better than one scale as not excited.

    The linearisation judges excitation by the size of the noise; an interval that also sees the
    noise's colour may know less.

    Args:
        estimate: of all parameters.
        parameters: the same, in order.
    """
    size = estimate.sd / np.array([parameter.scale for parameter in parameters])
    lost = np.isfinite(size) & (size > LARGEST_SD)
    if not lost.any():
        return estimate
    directions = [
        Direction(name, ((name, 1.0),), float(sd))
        for name, sd, unseen in zip(estimate.names, size, lost, strict=True)
        if unseen
    ]
    ends, correlation = estimate.ci95.copy(), estimate.correlation.copy()
    ends[lost] = (-np.inf, np.inf)
    correlation[lost], correlation[:, lost] = np.nan, np.nan
    return replace(
        estimate,
        sd=np.where(lost, np.inf, estimate.sd),
        ci95=ends,
        correlation=correlation,
        unexcited=(*estimate.unexcited, *directions),
    )


def _finite(value: float) -> float | None:
    return float(value) if isfinite(value) else None
