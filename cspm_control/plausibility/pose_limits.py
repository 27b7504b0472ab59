"""Where a body can be, how fast it can move, and how far from its reference."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_msgs_py.schedule import BAR_POSE, BAR_REFERENCE

Array = NDArray[np.float64]


class PoseLimits:
    """Finds poses outside the workspace, and jumps that the machine cannot make.

    A jump is the largest movement of a body's points from one believed pose to the next. Its time
    counts as a period at least, so that stamps that tremble do not make it fast.
    """

    def __init__(
        self,
        topic: str,
        middle: Array,
        points: Array,
        workspace: float,
        speed: float,
        period_ns: int,
    ) -> None:
        """Take what is allowed.

        Args:
            topic: of the poses.
            middle: the body's mean position, (3,) [m].
            points: of the body, where cables begin or end, (k, 3) [m].
            workspace: largest distance from the mean position [m].
            speed: largest speed of a point [m/s].
            period_ns: of the topic [ns].
        """
        self._topic, self._middle, self._points = topic, middle, points
        self._workspace, self._speed, self._period_ns = workspace, speed, period_ns
        self._last: tuple[int, Array] | None = None
        # Compiled now and not by the first message.
        farthest(np.zeros(7), np.zeros(7), points)

    def fault(self, stamp_ns: int, row: Array) -> str | None:
        """Take a pose row (7,) [m]; return why it cannot be true, None if it can."""
        distance = float(np.linalg.norm(row[:3] - self._middle))
        if not distance <= self._workspace:
            return (
                f"{self._topic}: {distance:.3g} m from its mean position, allowed: at most"
                f" {self._workspace:.3g} m (safety.workspace)"
            )
        if self._last is not None and stamp_ns > self._last[0]:
            seconds = 1e-9 * max(stamp_ns - self._last[0], self._period_ns)
            moved = farthest(row, self._last[1], self._points)
            if moved > self._speed * seconds:
                return (
                    f"{self._topic}: jumped by {moved:.3g} m in {1e3 * seconds:.3g} ms, allowed:"
                    f" {self._speed:.3g} m/s (safety.pose_speed)"
                )
        self._last = stamp_ns, row
        return None


class FollowingError:
    """Finds a bar that does not follow its reference.

    After the safe state, in which nobody follows, the bar has to come near first: to half of the
    limit, because one that was held at the limit sags beyond before it is drawn nearer.
    """

    def __init__(self, points: Array, limit: float) -> None:
        """Take the bar's points (k, 3) [m] and how far each may be from where it is wanted [m]."""
        self._points, self._limit, self._armed = points, limit, True

    def fault(self, pose: Array, reference: Array, *, running: bool) -> str | None:
        """Take rows of pose (7,) and reference (19,) [m]; return how far off, None if near."""
        error = farthest(pose, reference, self._points)
        self._armed = error <= 0.5 * self._limit or (running and self._armed)
        if error <= self._limit or not self._armed:
            return None
        return (
            f"{BAR_POSE}: {error:.3g} m from {BAR_REFERENCE}, allowed: at most {self._limit:.3g} m"
            " (safety.following_error)"
        )


@njit(cache=True, error_model="numpy")
def farthest(row: Array, other: Array, points: Array) -> float:
    """Return the largest distance of a body's points (k, 3) [m] in two poses x y z qx qy qz qw."""
    most = 0.0
    for i in range(points.shape[0]):
        square = 0.0
        first = placed(row, points[i])
        second = placed(other, points[i])
        for axis in range(3):
            square += (first[axis] - second[axis]) ** 2
        most = max(most, square)
    return float(np.sqrt(most))


@njit(cache=True, error_model="numpy")
def placed(row: Array, point: Array) -> tuple[float, float, float]:
    """Return the world's coordinates of a body's point: p + 2·(w·(v×r) + v×(v×r)) + r."""
    x, y, z, w = row[3], row[4], row[5], row[6]
    cx = y * point[2] - z * point[1]
    cy = z * point[0] - x * point[2]
    cz = x * point[1] - y * point[0]
    return (
        row[0] + point[0] + 2.0 * (w * cx + y * cz - z * cy),
        row[1] + point[1] + 2.0 * (w * cy + z * cx - x * cz),
        row[2] + point[2] + 2.0 * (w * cz + x * cy - y * cx),
    )
