"""A number to be estimated, and what is known of it before."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]


class Prior(NamedTuple):
    """What a datasheet or a scale says: Gaussian with `mean` and standard deviation `sd`."""

    mean: float
    sd: float


@dataclass(frozen=True)
class Parameter:
    """A parameter of a model.

    Attributes:
        name: as it appears in results.
        unit: of its value.
        lower: smallest value allowed.
        upper: largest value allowed.
        scale: a change that matters, in `unit`. A direction that is known no better than one scale
            counts as not excited. Half the range between the bounds where none is given.
        frozen: whether it keeps its start value.
        prior: knowledge from elsewhere, in `unit`.

    Raises:
        InputError: empty range, scale or prior not positive, or neither scale nor both bounds.
    """

    name: str
    unit: str
    lower: float = -inf
    upper: float = inf
    scale: float = 0.0
    frozen: bool = False
    prior: Prior | None = None

    def __post_init__(self) -> None:
        if not self.lower < self.upper:
            raise InputError(
                f"parameter {self.name}: bounds {self.lower:g} to {self.upper:g}; "
                "allowed: lower below upper"
            )
        if self.scale == 0.0 and isfinite(self.upper - self.lower):
            object.__setattr__(self, "scale", 0.5 * (self.upper - self.lower))
        if not 0.0 < self.scale < inf:
            raise InputError(
                f"parameter {self.name}: scale {self.scale:g}; "
                "allowed: finite and above 0, or left out where both bounds are finite"
            )
        if self.prior is not None and not 0.0 < self.prior.sd < inf:
            raise InputError(
                f"parameter {self.name}: prior's standard deviation {self.prior.sd:g}; "
                "allowed: finite and above 0"
            )


def free_indices(parameters: Sequence[Parameter]) -> NDArray[np.intp]:
    """Return where the parameters stand that are not frozen, shape (free,)."""
    return np.flatnonzero([not parameter.frozen for parameter in parameters])


def scales(parameters: Sequence[Parameter]) -> Array:
    """Return the parameters' scales, shape (parameters,)."""
    return np.array([parameter.scale for parameter in parameters])


def prior_rows(parameters: Sequence[Parameter]) -> tuple[Array, Array, Array]:
    """Return where there are priors (indices), their means and standard deviations."""
    found = [(i, *p.prior) for i, p in enumerate(parameters) if p.prior and not p.frozen]
    table = np.array(found, dtype=float).reshape(-1, 3)
    return table[:, 0].astype(np.intp), table[:, 1], table[:, 2]


def check_start(parameters: Sequence[Parameter], start: Sequence[float] | Array) -> Array:
    """Return the start values, shape (parameters,).

    Raises:
        InputError: names that repeat, none that is free, another number of values, not finite or
            outside the bounds.
    """
    if not len(free_indices(parameters)):
        raise InputError("no parameter is free; allowed: at least one that is not frozen")
    names = [parameter.name for parameter in parameters]
    if len(set(names)) < len(names):
        raise InputError(f"parameters {', '.join(names)}: a name repeats; allowed: each name once")
    values = np.asarray(start, dtype=float)
    if values.shape != (len(parameters),):
        raise InputError(
            f"start has shape {values.shape}; allowed: one value for each of {len(names)} "
            "parameters"
        )
    for parameter, value in zip(parameters, values, strict=True):
        if not (isfinite(value) and parameter.lower <= value <= parameter.upper):
            raise InputError(
                f"start of {parameter.name}: {value:g} {parameter.unit}; "
                f"allowed: {parameter.lower:g} to {parameter.upper:g}"
            )
    return values
