"""Whether the torques of the winches are those that tensions and motion need."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.schedule import WINCH_STATE

Array = NDArray[np.float64]

# The balance is struck over so long [ns]: ten periods of motion capture.
WINDOW_NS = 100_000_000
# A longer silence begins a new window: what happened meanwhile is not known [ns].
LONGEST_GAP_NS = WINDOW_NS // 4
# Brakes of servo motors take up to 0.3 s to open; until then torques prove nothing [ns].
OPENING_NS = 500_000_000
# Friction takes or adds that share of the torque that a tension needs, as in `check-drivers`.
TENSION_SHARE = 0.5


class TorqueBalance:
    """Finds tension without torque, and torque without motion.

    At each motor shaft J·q̈ = τ − (r/n)·t − friction. Integrated over a window: the mean of
    τ − (r/n)·t differs from J·Δq̇/T by mean friction alone, whatever the noise of the speeds.
    """

    def __init__(
        self, names: Sequence[str], radii: Array, inertia: Array, allowed: Array, watched: Array
    ) -> None:
        """Take the winches.

        Args:
            names: of the cables, n.
            radii: cable wound per radian of the motor, (n,) [m].
            inertia: at the motor shaft, (n,) [kg·m²].
            allowed: torque that may be missing or left over at least, (n,) [N·m].
            watched: which winches are judged, (n,).
        """
        self._names, self._radii, self._inertia = tuple(names), radii, inertia
        self._allowed = np.where(watched, allowed, np.inf)
        self._begin: int | None = None
        self._last_ns = self._from_ns = 0
        self._samples, self._count = 0, len(radii)
        self._sum, self._tensions = np.zeros(3 * self._count), np.zeros(self._count)
        self._speeds = np.zeros(self._count)

    def fault(self, stamp_ns: int, row: Array, tensions: Array, *, running: bool) -> str | None:
        """Take a row of winch states; return what does not fit, None if all does.

        Args:
            stamp_ns: its stamp [ns].
            row: angles, speeds [rad/s] and torques [N·m], (3n,).
            tensions: measured last, (n,) [N].
            running: whether the winches are commanded.
        """
        gap = stamp_ns - self._last_ns
        self._last_ns = stamp_ns
        if not running:
            self._begin, self._from_ns = None, stamp_ns + OPENING_NS
            return None
        if stamp_ns < self._from_ns:
            return None
        if self._begin is None or not 0 < gap <= LONGEST_GAP_NS:
            self._open(stamp_ns, row)
            return None
        self._sum += row
        self._tensions += tensions
        self._samples += 1
        if stamp_ns - self._begin < WINDOW_NS:
            return None
        found = self._verdict(1e-9 * (stamp_ns - self._begin), row)
        self._open(stamp_ns, row)
        return found

    def _open(self, stamp_ns: int, row: Array) -> None:
        """Begin a window."""
        self._begin, self._samples = stamp_ns, 0
        self._sum[:], self._tensions[:] = 0.0, 0.0
        self._speeds = row[self._count : 2 * self._count].copy()

    def _verdict(self, seconds: float, row: Array) -> str | None:
        """Return which winch's window does not fit, that which is off most."""
        n = self._count
        needed = self._radii * self._tensions / self._samples
        spin = self._inertia * (row[n : 2 * n] - self._speeds) / seconds
        unexplained = self._sum[2 * n :] / self._samples - needed - spin
        allowed = np.maximum(self._allowed, TENSION_SHARE * np.abs(needed))
        worst = int(np.argmax(np.abs(unexplained) / allowed))
        left, most = unexplained[worst], allowed[worst]
        if abs(left) <= most:
            return None
        what = "torque without motion" if left > 0.0 else "tension without torque"
        torque, needs = left + needed[worst] + spin[worst], needed[worst] + spin[worst]
        return (
            f"{WINCH_STATE}: {what} of {self._names[worst]}: {torque:.3g} N·m where tension and"
            f" motion need {needs:.3g} N·m, allowed: {most:.2g} N·m off (safety.torque_mismatch)"
        )
