"""What a sensor's fault makes of what it measures."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WARMING = 12.0  # [s]


class CellOffset:
    """A load cell whose zero has moved."""

    def __init__(self, bias: Array) -> None:
        """Take the biases (n,) [N]."""
        self._bias = bias

    def __call__(self, values: Array, time: float) -> Array:
        """Return the readings."""
        return values + self._bias


class CellGain:
    """A load cell of another sensitivity; what it reads too much falls a little with the load."""

    def __init__(self, excess: Array) -> None:
        """Take the shares (n,)."""
        self._excess = excess

    def __call__(self, values: Array, time: float) -> Array:
        """Return the readings."""
        return values * (1.0 + self._excess)


class CellWarming:
    """A load cell whose zero wanders off while it warms up."""

    def __init__(self, drift: Array) -> None:
        """Take the drifts in the end (n,) [N]."""
        self._drift = drift

    def __call__(self, values: Array, time: float) -> Array:
        """Return the readings."""
        return np.asarray(values - self._drift * np.expm1(-time / WARMING))


class EncoderCounts:
    """Encoders that count too much: angle and speed of all kinds (angle, speed, torque)."""

    def __init__(self, excess: Array) -> None:
        """Take the shares (n,)."""
        self._factor = np.concatenate([1.0 + excess, 1.0 + excess, np.ones(len(excess))])

    def __call__(self, values: Array, time: float) -> Array:
        """Return the readings."""
        return np.asarray(values * self._factor)


class FilteredDelay:
    """A tracker that filters (first order, half of the delay) and then waits for the other half."""

    def __init__(self, delay: float) -> None:
        """Take the delay at low frequencies [s]."""
        self._half = 0.5 * delay
        self._seen: Array | None = None
        self._past: deque[tuple[float, Array]] = deque()

    def __call__(self, values: Array, time: float) -> Array:
        """Return the pose as it was; to be called at every step of the plant."""
        self._past.append((time, self._filtered(values, time)))
        self._seen = values.copy()
        wanted = time - self._half
        while len(self._past) > 2 and self._past[1][0] <= wanted:
            self._past.popleft()
        return self._between(wanted)

    def _filtered(self, values: Array, time: float) -> Array:
        """Return the filter's output, its input being a straight line since the last step.

        Exact however short the filter's time is against the step.
        """
        if self._seen is None:
            return values.copy()
        before, held = self._past[-1]
        steps = (time - before) / self._half
        reached = -np.expm1(-steps)
        risen = (values - self._seen) * (1.0 - reached / steps)
        return np.asarray(held + reached * (self._seen - held) + risen)

    def _between(self, wanted: float) -> Array:
        begin, first = self._past[0]
        if wanted <= begin or len(self._past) == 1:
            return np.asarray(first)
        end, second = self._past[1]
        return np.asarray(first + (wanted - begin) / (end - begin) * (second - first))


class MarkerShift:
    """Markers that sit beside where they are believed to, along world y while the bar is level."""

    def __init__(self, shift: float) -> None:
        """Take the shift [m]."""
        self._shift = shift

    def __call__(self, values: Array, time: float) -> Array:
        """Return the pose of the shifted markers; x y z φ θ ψ."""
        roll, pitch, yaw = values[3:6]
        axis = np.array(
            [
                np.cos(yaw) * np.sin(pitch) * np.sin(roll) - np.sin(yaw) * np.cos(roll),
                np.sin(yaw) * np.sin(pitch) * np.sin(roll) + np.cos(yaw) * np.cos(roll),
                np.cos(pitch) * np.sin(roll),
            ]
        )
        shifted = values.copy()
        shifted[:3] += self._shift * axis
        return shifted
