"""Whether drives report angles and speeds that their motors can have."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.schedule import WINCH_STATE

Array = NDArray[np.float64]
# Noise beyond so many standard deviations comes once in 10¹⁵ readings.
_DEVIATIONS = 8.0


class DriveMotion:
    """Finds angles and speeds that jump.

    A motor that accelerates by a at most is within a/2·h² of q + q̇·h after the time h, and its
    speed within a·h of q̇. Noise and resolution of the readings come on top.
    """

    def __init__(
        self,
        names: Sequence[str],
        accelerations: Array,
        noise: tuple[float, float],
        period_ns: int,
    ) -> None:
        """Take the drives.

        Args:
            names: of the cables, n.
            accelerations: the largest of each motor, (n,) [rad/s²].
            noise: standard deviations of angles [rad] and speeds [rad/s].
            period_ns: of the readings [ns]; they follow one another no sooner.
        """
        self._names, self._accelerations = tuple(names), accelerations
        self._noise, self._period_ns = noise, period_ns
        self._last: tuple[int, Array] | None = None

    def fault(self, stamp_ns: int, row: Array) -> str | None:
        """Take a row (3n,) of winch states; return what jumps, None where nothing does."""
        if self._last is not None and stamp_ns > self._last[0]:
            before, count = self._last[1], len(self._names)
            wait = 1e-9 * max(stamp_ns - self._last[0], self._period_ns)
            jumps = np.abs(row - before)[: 2 * count].reshape(2, count)
            jumps[0] = np.abs(row[:count] - before[:count] - wait * before[count : 2 * count])
            most = self._allowed(wait)
            if (jumps > most).any():
                return self._named(jumps, most, wait)
        self._last = stamp_ns, row
        return None

    def _allowed(self, wait: float) -> Array:
        """Return by how much angles and speeds may be off after a time [s], (2, n)."""
        angle, speed = _DEVIATIONS * np.sqrt(2.0) * np.array(self._noise)
        reach = 0.5 * self._accelerations * wait**2 + angle + speed * wait
        return np.stack([reach, self._accelerations * wait + speed])

    def _named(self, jumps: Array, most: Array, wait: float) -> str:
        """Return which reading jumps most, and by how much."""
        kind, winch = np.unravel_index(int(np.argmax(jumps / most)), jumps.shape)
        what, unit = (("angle", "rad"), ("speed", "rad/s"))[int(kind)]
        return (
            f"{WINCH_STATE}: {what} of {self._names[winch]} jumped by {jumps[kind, winch]:.3g}"
            f" {unit} in {1e3 * wait:.3g} ms, allowed: {most[kind, winch]:.2g} {unit} (the motor's"
            " rotor_inertia and torque_limit)"
        )
