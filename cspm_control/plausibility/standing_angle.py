"""An encoder that stays the same while its drive says that the motor turns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.schedule import WINCH_STATE

Array = NDArray[np.float64]
# So many steps of the encoder, and standard deviations of the readings, are no motion: a speed that
# is filtered, or off by a little, goes on where the motor does not.
_STEPS, _DEVIATIONS = 10.0, 8.0
_LEAST = 1e-3  # rad


class StandingAngle:
    """Finds angles that stay the same while their speeds add up to a way.

    The way is counted from the time on for which a reading may be old, so that a filter of the
    speed has run out, and anew after as much again: a speed that is a little off adds up to little.
    """

    def __init__(
        self, names: Sequence[str], noise: tuple[float, float], resolution: float, allowed: float
    ) -> None:
        """Take the drives.

        Args:
            names: of the cables, n.
            noise: standard deviations of angles [rad] and speeds [rad/s].
            resolution: of angles [rad].
            allowed: how long a reading may be old [s].
        """
        self._names, self._allowed_ns = tuple(names), round(allowed * 1e9)
        angle, speed = noise
        self._most = max(_LEAST, _STEPS * resolution + _DEVIATIONS * (angle + speed * allowed))
        self._last: tuple[int, Array] | None = None
        self._since = np.zeros(len(self._names), dtype=np.int64)
        self._way = np.zeros(len(self._names))

    def fault(self, stamp_ns: int, row: Array) -> str | None:
        """Take a row (3n,) of winch states; return which angle is stuck, None where none is."""
        count, last = len(self._names), self._last
        self._last = stamp_ns, row
        if last is None:
            self._since[:] = stamp_ns
            return None
        wait, angles = stamp_ns - last[0], row[:count]
        moved = (angles != last[1][:count]) | (wait > self._allowed_ns)
        self._since[moved], self._way[moved] = stamp_ns, 0.0
        age = stamp_ns - self._since
        counted = age > self._allowed_ns
        if not counted.any():
            return None
        self._way += counted * (1e-9 * wait) * row[count : 2 * count]
        again = age > 2 * self._allowed_ns
        found = np.abs(self._way) * counted
        worst = int(np.argmax(found))
        self._since[again], self._way[again] = stamp_ns - self._allowed_ns, 0.0
        if found[worst] <= self._most:
            return None
        return (
            f"{WINCH_STATE}: the same angle of {self._names[worst]} for"
            f" {age[worst] * 1e-6:.0f} ms while its speed makes {found[worst]:.2g} rad, allowed:"
            f" {self._most:.2g} rad (sensors.{WINCH_STATE}): a stuck encoder?"
        )
