"""Hold-out residuals over time, with the file's model and with the findings, for the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_msgs_py.dofs import DOFS
from cspm_sim.effects import Channel

Array = NDArray[np.float64]

# Number of bins of a signal's values, each with equally many samples.
BINS = 12


@dataclass(frozen=True, eq=False)
class Curve:
    """One component of a residual along one stretch of held-out data.

    Attributes:
        place: which residual.
        component: one degree of freedom of the bar's wrench; else empty.
        times: shape (k,) [s].
        measured: the measured quantity, shape (k,) [N·m for torques and moments, else N].
        before: residual with the file's model, shape (k,).
        after: residual with the findings, shape (k,).
        signals: measured signals that it may depend on, by name and unit, shape (k,) each.
        touched: candidates that act on it.
        recording: which of the judged recordings, counted from 0.
    """

    place: Place
    component: str
    times: Array
    measured: Array
    before: Array
    after: Array
    signals: Mapping[str, Array]
    touched: tuple[Candidate, ...]
    recording: int = 0

    @property
    def unit(self) -> str:
        """Unit of the residual and the measured quantity."""
        moments = DOFS[3:]
        torque = self.place.channel in (Channel.DRIVE, Channel.SHAFT) or self.component in moments
        return "N·m" if torque else "N"

    @property
    def gained(self) -> float:
        """Share of the squared residual that the findings explain; below 0 if they raise it."""
        before = float(np.sum(self.before**2))
        return 1.0 - float(np.sum(self.after**2)) / before if before > 0.0 else 0.0

    @property
    def main_signal(self) -> str:
        """Signal whose bins explain most of the residual `before`; empty without signals."""
        shares = {name: explained_by(values, self.before) for name, values in self.signals.items()}
        return max(shares, key=lambda name: shares[name]) if shares else ""


def held_out_curves(
    parts: Sequence[Sequence[Equation]], weights: Mapping[Candidate, Array]
) -> tuple[Curve, ...]:
    """Return every component of every residual, with the file's model and with the findings.

    Args:
        parts: equations of each held-out recording, in their own units.
        weights: those of the findings' candidates.
    """
    return tuple(
        curve
        for recording, part in enumerate(parts)
        for equation in part
        if len(equation.times)
        for curve in _curves(recording, equation, weights)
    )


def _curves(recording: int, equation: Equation, weights: Mapping[Candidate, Array]) -> list[Curve]:
    own = {c: w for c, w in weights.items() if c in equation.columns}
    before, after = equation.left, equation.less(own).left
    components = DOFS if equation.target.shape[1] > 1 else ("",)
    found = []
    for i, name in enumerate(components):
        touched = tuple(c for c in own if np.any(equation.columns[c][:, i]))
        signals = {k: v for k, v in equation.signals.items() if name in k}
        measured = equation.measured[:, i]
        sides = before[:, i], after[:, i]
        what = equation.place, name, equation.times
        found.append(Curve(*what, measured, *sides, signals, touched, recording))
    return found


def bins_of(signal: Array, count: int = BINS) -> tuple[Array, NDArray[np.intp]]:
    """Return the edges of bins that hold equally many samples, and the bin of each sample.

    A signal that does not change has one bin, between two equal edges.
    """
    edges = np.unique(np.quantile(signal, np.linspace(0.0, 1.0, count + 1)))
    if len(edges) == 1:
        edges = np.repeat(edges, 2)
    return edges, np.clip(np.searchsorted(edges, signal, side="right") - 1, 0, len(edges) - 2)


def explained_by(signal: Array, values: Array, bins: int = BINS) -> float:
    """Return the correlation ratio η²: the share of squares that means over bins explain."""
    edges, home = bins_of(signal, bins)
    whole = float(np.sum((values - values.mean()) ** 2))
    if len(edges) < 3 or whole <= 0.0:
        return 0.0
    counts = np.bincount(home, minlength=len(edges) - 1)
    sums = np.bincount(home, weights=values, minlength=len(edges) - 1)
    filled = counts > 0
    between = np.sum(counts[filled] * (sums[filled] / counts[filled] - values.mean()) ** 2)
    return float(between) / whole
