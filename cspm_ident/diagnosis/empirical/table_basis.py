"""Knots, hat functions, smoothness and shape constraints of a table."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Knots of a function of one driver, and of the second driver of a function of two.
FIRST_KNOTS, SECOND_KNOTS = 12, 4
# Share of the rows that one direction of motion needs for knots of its own.
_FEWEST_SHARE = 0.02
# Share of the slowest measured speed at which a table has its knots next to zero.
_INNER_SHARE = 1e-3
# Share of the driver's range that two knots are apart at least.
_APART_SHARE = 1e-6


class Constraint(Enum):
    """What is demanded of a function of a speed, the weakest first."""

    FREE = "free"
    DISSIPATIVE = "dissipative"
    ODD = "odd and dissipative"
    MONOTONE = "odd, dissipative and monotone"


@dataclass(frozen=True)
class Axis:
    """Knots along one driver.

    Attributes:
        name: of the driver.
        knots: ascending, shape (k,).
        opposes: sign with which the function opposes the motion, where the driver is the speed at
            which it acts; 0 for any other driver. Such a function may jump at zero.
        jumps: whether it keeps its values from the slowest measured speeds down to zero, as dry
            friction does, and does not pass through zero as viscous friction does.
    """

    name: str
    knots: Array
    opposes: int = 0
    jumps: bool = False

    @property
    def tabled_knots(self) -> Array:
        """The knots of a table: the same, and two about zero where the function may jump."""
        if not (self.opposes and self.is_symmetric):
            return self.knots
        half = len(self.knots) // 2
        inner = _INNER_SHARE * self.knots[half]
        return np.insert(self.knots, half, [-inner, inner])

    @property
    def tie(self) -> Array:
        """The matrix from values at the knots to values at the tabled knots."""
        identity = np.eye(len(self.knots))
        if not (self.opposes and self.is_symmetric):
            return identity
        half, share = len(self.knots) // 2, 1.0 if self.jumps else _INNER_SHARE
        return np.insert(identity, half, share * identity[half - 1 : half + 1], axis=0)

    def hats(self, values: Array) -> Array:
        """Return hat functions at the driver's values, shape (samples, k)."""
        knots = self.tabled_knots
        tabled = np.stack([np.interp(values, knots, unit) for unit in np.eye(len(knots))], axis=1)
        return np.asarray(tabled @ self.tie)

    @property
    def is_symmetric(self) -> bool:
        """Whether the knots lie alike on both sides of zero."""
        return bool(np.allclose(self.knots, -self.knots[::-1]))

    @property
    def roughness(self) -> Array:
        """Rows whose squares with the values are the penalty on curvature, (m, k).

        Differences of slopes of neighbouring pieces, in units of the range; the piece across zero
        of a function that may jump there is left out.
        """
        at = self.knots / np.ptp(self.knots)
        rows = []
        for i in range(1, len(at) - 1):
            before, after = at[i] - at[i - 1], at[i + 1] - at[i]
            sides = self.knots[i - 1] < 0.0 < self.knots[i], self.knots[i] < 0.0 < self.knots[i + 1]
            if self.opposes and any(sides):
                continue
            row = np.zeros(len(at))
            row[i - 1 : i + 2] = 1.0 / before, -1.0 / before - 1.0 / after, 1.0 / after
            rows.append(row * np.sqrt(0.5 * (before + after)))
        return np.array(rows).reshape(-1, len(at))


def axis_of(name: str, values: Array, opposes: int = 0, knots: int = FIRST_KNOTS) -> Axis | None:
    """Return knots at quantiles of a driver's values; None where it hardly changes.

    Args:
        name: of the driver.
        values: of the driver, shape (samples,).
        opposes: as of `Axis`; knots are then symmetric if both directions occur.
        knots: how many.
    """
    low, high = float(values.min()), float(values.max())
    apart = _APART_SHARE * max(abs(low), abs(high))
    if not opposes:
        return _of_quantiles(name, values, knots, apart, 0)
    forward = float(np.mean(values > 0.0))
    if min(forward, 1.0 - forward) < _FEWEST_SHARE:
        return _of_quantiles(name, values, knots, apart, opposes)
    side = _of_quantiles(name, np.abs(values), knots // 2, apart, opposes)
    if side is None or not side.knots[0] > 0.0:
        return None
    return Axis(name, np.concatenate([-side.knots[::-1], side.knots]), opposes)


def _of_quantiles(name: str, values: Array, count: int, apart: float, opposes: int) -> Axis | None:
    found = np.quantile(values, np.linspace(0.0, 1.0, count))
    kept = [float(found[0])]
    for knot in found[1:]:
        if knot - kept[-1] > apart:
            kept.append(float(knot))
    return Axis(name, np.array(kept), opposes) if len(kept) > 2 else None


@dataclass(frozen=True)
class Term:
    """A function of one driver, or of two.

    Attributes:
        axes: of the drivers.
    """

    axes: tuple[Axis, ...]

    @property
    def tie(self) -> Array:
        """The matrix from values at the knots to values of the table."""
        across = len(self.axes[1].knots) if len(self.axes) == 2 else 1
        return np.asarray(np.kron(self.axes[0].tie, np.eye(across)), dtype=float)

    def jumping(self, *, jumps: bool) -> Term:
        """Return the term as one that jumps at zero speed, or does not."""
        return Term((replace(self.axes[0], jumps=jumps), *self.axes[1:]))

    def columns(self, signals: dict[str, Array]) -> Array:
        """Return columns whose weights are the values at the knots, (samples, values)."""
        first = self.axes[0].hats(signals[self.axes[0].name])
        if len(self.axes) == 1:
            return first
        second = self.axes[1].hats(signals[self.axes[1].name])
        return np.asarray((first[:, :, None] * second[:, None, :]).reshape(len(first), -1))

    @property
    def roughness(self) -> Array:
        """Rows whose squares with the values are the penalty on curvature along each driver."""
        if len(self.axes) == 1:
            return self.axes[0].roughness
        one, other = self.axes
        return np.vstack(
            [
                np.kron(one.roughness, np.eye(len(other.knots))),
                np.kron(np.eye(len(one.knots)), other.roughness),
            ]
        )

    @property
    def constraints(self) -> tuple[Constraint, ...]:
        """What may be demanded of the function, the strongest first."""
        if not self.axes[0].opposes:
            return (Constraint.FREE,)
        if not self.axes[0].is_symmetric:
            return Constraint.DISSIPATIVE, Constraint.FREE
        return Constraint.MONOTONE, Constraint.ODD, Constraint.DISSIPATIVE, Constraint.FREE

    def map(self, constraint: Constraint) -> Array:
        """Return the matrix from free or non-negative numbers to the values, (values, numbers).

        The numbers are free where the constraint is, and 0 or more otherwise.
        """
        knots = self.axes[0].knots
        along = np.eye(len(knots))
        if constraint is Constraint.DISSIPATIVE:
            along = np.diag(self.axes[0].opposes * np.sign(knots))
        elif constraint is not Constraint.FREE:
            half = np.eye(len(knots) // 2)
            if constraint is Constraint.MONOTONE:
                half = np.tril(np.ones_like(half))
            along = self.axes[0].opposes * np.vstack([-half[::-1], half])
        across = np.eye(len(self.axes[1].knots)) if len(self.axes) == 2 else np.eye(1)
        return np.asarray(np.kron(along, across), dtype=float)
