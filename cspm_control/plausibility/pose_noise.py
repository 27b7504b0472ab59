"""Poses that tremble more than their sensor's noise and what the cables can do explain."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from cspm_control.plausibility.pose_limits import placed

Array = NDArray[np.float64]
# Of three poses in a row the middle one is judged; more than half of so many have to be off. One
# outlier is in three of them.
WINDOW = 10
_MOST = WINDOW // 2
# So many standard deviations of one coordinate a point may be off. Of any six of ten there are two
# that share no pose: all six are off with C(10, 6)·p² at most. That is once in 10¹² poses
# with p = 6.9·10⁻⁸ that a point is farther off (the chi distribution of three coordinates).
DEVIATIONS = 6.02


class PoseNoise:
    """Finds noise on a pose that neither its sensor has nor the cables can make.

    A point that accelerates by a at most is within a/2·h₁·h₂ of the line between where it was h₁
    before and where it is h₂ after. Noise of standard deviation σ adds σ·√(1 + w² + (1 − w)²) to
    each of its coordinates, with the weights w = h₂/(h₁ + h₂) and 1 − w of its neighbours.
    """

    def __init__(
        self, topic: str, points: Array, accelerations: Array, noise: Array, period_ns: int
    ) -> None:
        """Take what is explained.

        Args:
            topic: of the poses.
            points: of the body, (k, 3) [m].
            accelerations: the largest of each point, (k,) [m/s²].
            noise: standard deviation of each point's coordinates, (k,) [m].
            period_ns: of the topic [ns]; poses follow one another no sooner.
        """
        self._topic, self._points, self._period_ns = topic, points, period_ns
        self._accelerations, self._noise = accelerations, noise * DEVIATIONS
        self._poses: deque[tuple[int, Array]] = deque(maxlen=3)
        self._off: deque[bool] = deque(maxlen=WINDOW)
        # Compiled now and not by the first message.
        off_line(np.zeros(7), np.zeros(7), np.zeros(7), 0.5, points)

    def fault(self, stamp_ns: int, row: Array) -> str | None:
        """Take a pose row (7,) [m]; return how much it trembles, None where that is explained."""
        if self._poses and stamp_ns <= self._poses[-1][0]:
            self._poses.clear()
        self._poses.append((stamp_ns, row))
        if len(self._poses) < 3:
            return None
        distances, allowed = self._judged()
        excess = distances - allowed
        worst = int(excess.argmax())
        self._off.append(bool(excess[worst] > 0.0))
        if sum(self._off) <= _MOST or not self._off[-1]:
            return None
        return (
            f"{self._topic}: {1e3 * distances[worst]:.3g} mm off the way between its neighbours in"
            f" {sum(self._off)} of {len(self._off)} poses, allowed: {1e3 * allowed[worst]:.3g} mm"
            " (safety.pose_acceleration, and the sensor's noise in the test-bed file)"
        )

    def _judged(self) -> tuple[Array, Array]:
        """Return how far the points of the middle pose are off, and may be, (k,) each [m]."""
        (start, first), (middle, row), (end, last) = self._poses
        before, after = (
            1e-9 * max(each, self._period_ns) for each in (middle - start, end - middle)
        )
        weight = after / (before + after)
        gain = math.sqrt(1.0 + weight**2 + (1.0 - weight) ** 2)
        allowed = 0.5 * before * after * self._accelerations + gain * self._noise
        return off_line(first, row, last, weight, self._points), allowed


def points_noise(points: Array, position: float, orientation: float) -> Array:
    """Return the standard deviation of the points' coordinates, at most (k,) [m].

    Args:
        points: of a body, (k, 3) [m].
        position: standard deviation of the pose's position [m].
        orientation: of its angles [rad].
    """
    return np.hypot(position, orientation * np.linalg.norm(points, axis=1))


def point_accelerations(
    points: Array, attachments: Array, pulls: ArrayLike, mass: float, inertia: Array, com: Array
) -> Array:
    """Return what cables pulling in any direction can give points of a body at rest, (k,) [m/s²].

    A force F at s accelerates the point r by (E/m − [r]ₓ·J⁻¹·[s]ₓ)·F, both from the centre of
    mass.

    Args:
        points: (k, 3), in the body's frame [m].
        attachments: where the cables pull, (n, 3) [m].
        pulls: of the cables at most, (n,) [N].
        mass: of the body [kg].
        inertia: about its centre of mass, (3, 3) [kg·m²].
        com: its centre of mass, (3,) [m].
    """
    compliance = np.linalg.inv(inertia)
    found = np.zeros(len(points))
    for i, point in enumerate(points - com):
        for place, pull in zip(attachments - com, np.asarray(pulls), strict=True):
            mobility = np.eye(3) / mass - _cross(point) @ compliance @ _cross(place)
            found[i] += pull * np.linalg.norm(mobility, 2)
    return found


def _cross(vector: Array) -> Array:
    """Return [v]ₓ, with [v]ₓ·u = v × u."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


@njit(cache=True, error_model="numpy")
def off_line(first: Array, row: Array, last: Array, weight: float, points: Array) -> Array:
    """Return how far points are from the line between where they were and will be, (k,) [m].

    Args:
        first: the pose before, x y z qx qy qz qw.
        row: the pose that is judged.
        last: the pose after.
        weight: of the pose before; that of the pose after is the rest to 1.
        points: of the body, (k, 3) [m].
    """
    found = np.zeros(points.shape[0])
    for i in range(points.shape[0]):
        before, here = placed(first, points[i]), placed(row, points[i])
        after = placed(last, points[i])
        square = 0.0
        for axis in range(3):
            on_line = weight * before[axis] + (1.0 - weight) * after[axis]
            square += (here[axis] - on_line) ** 2
        found[i] = math.sqrt(square)
    return found
