"""A reference that leaves its motion for a goal, and comes back when it is asked to."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from cspm_control.waves.realisation import envelope
from cspm_control.waves.wave_trajectory import WaveTrajectory
from cspm_model.kernels.rows import reference_row
from cspm_model.motion import Motion
from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]
_DOFS = 6


class GoalTrajectory(WaveTrajectory):
    """The prescribed motion, or a goal, and a minimum-jerk passage from one to the other.

    With the passage's share s from 0 to 1, the reference is (1 − s)·a + s·b, where a is left and b
    is gone to. Both may move, and the derivatives are those of that product.
    """

    def __init__(self, motion: Motion, duration: float, check: Callable[[Array], None]) -> None:
        """Follow the motion until a goal comes.

        Args:
            motion: the prescribed one.
            duration: of a passage [s].
            check: raises `InputError` for a pose x y z φ θ ψ where the machine cannot hold.
        """
        super().__init__(motion)
        self._duration, self._check = duration, check
        # None is the motion itself.
        self._left: Array | None = None
        self._wanted: Array | None = None
        self._since: float | None = None
        self._share = 1.0
        self._time: float | None = None

    @property
    def remaining(self) -> float:
        """Time until what is gone to is reached [s]; 0 once it is."""
        if self._time is None or self._share >= 1.0:
            return 0.0
        since = self._time if self._since is None else self._since
        return max(0.0, since + self._duration - self._time)

    @property
    def at_goal(self) -> bool:
        """Whether a goal is followed in place of the motion."""
        return self._wanted is not None

    def go(self, goal: Array | None) -> None:
        """Go to a pose x y z φ θ ψ (6,) [m], [rad], or back to the motion.

        Raises:
            InputError: the run has not begun, the reference is on its way, or the machine cannot
                hold somewhere on it.
        """
        if self._time is None:
            raise InputError("the run has not begun, allowed: a goal while it is under way")
        if self.remaining:
            raise InputError(f"on the way for {self.remaining:.1f} s more, allowed: a goal then")
        begin = self.values[:_DOFS].copy()
        end = self.motion.at(self._time)[:_DOFS] if goal is None else np.asarray(goal, dtype=float)
        for share in np.linspace(0.0, 1.0, 5)[1:]:
            self._check(begin + share * (end - begin))
        self._left, self._wanted = self._wanted, None if goal is None else end.copy()
        self._since, self._share = None, 0.0

    def step(self, stamp_ns: int) -> Array:
        """Return the reference row (19,) at `stamp_ns`; `values` keeps pose and derivatives."""
        row = super().step(stamp_ns)
        self._time = stamp_ns * 1e-9
        if self._left is None and self._wanted is None and self._share >= 1.0:
            return row
        self._since = self._time if self._since is None else self._since
        profile = envelope(np.array([self._time - self._since]), self._duration)
        share, rate, acceleration = (float(each[0]) for each in profile)
        self._share = share
        left, wanted = self._values(self._left), self._values(self._wanted)
        self.values = _blended(left, wanted, share, rate, acceleration)
        reference_row(self.values, row)
        if share >= 1.0:
            self._left = self._wanted
        return row

    def _values(self, pose: Array | None) -> Array:
        """Return pose and derivatives (18,) of a goal, or of the motion."""
        if pose is None:
            return self.values.copy()
        return np.concatenate([pose, np.zeros(2 * _DOFS)])


def _blended(left: Array, wanted: Array, s: float, ds: float, dds: float) -> Array:
    """Return (1 − s)·left + s·wanted with its two derivatives, (18,) each."""
    a, b = left.reshape(3, _DOFS), wanted.reshape(3, _DOFS)
    apart = b - a
    return np.concatenate(
        [
            a[0] + s * apart[0],
            a[1] + s * apart[1] + ds * apart[0],
            a[2] + s * apart[2] + 2.0 * ds * apart[1] + dds * apart[0],
        ]
    )
