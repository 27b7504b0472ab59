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
# At how many instants of a passage it is looked at; acceleration peaks last a fifth of it.
_LOOKS = 25


class GoalTrajectory(WaveTrajectory):
    """The prescribed motion, or a goal, and a minimum-jerk passage from one to the other.

    With the passage's share s from 0 to 1, the reference is (1 − s)·a + s·b, where a is left and b
    is gone to. Both may move, and the derivatives are those of that product. Between poses at a
    distance d the jerk is at most 60·d/T³, T the duration: speed and acceleration never jump.
    """

    def __init__(
        self, motion: Motion, duration: float, check: Callable[[Array, Array], None]
    ) -> None:
        """Follow the motion until a goal comes.

        Args:
            motion: the prescribed one.
            duration: of a passage [s].
            check: raises `InputError` for a passage that the machine cannot make. It gets instants
                of the run (k,) [s], and pose with derivatives at each, (k, 18).
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
                make the passage.
        """
        if self._time is None:
            raise InputError("the run has not begun, allowed: a goal while it is under way")
        if self.remaining:
            raise InputError(f"on the way for {self.remaining:.1f} s more, allowed: a goal then")
        wanted = None if goal is None else np.array(goal, dtype=float)
        self._check(*self._passage(self._wanted, wanted, self._time))
        self._left, self._wanted = self._wanted, wanted
        self._since, self._share = None, 0.0

    def step(self, stamp_ns: int) -> Array:
        """Return the reference row (19,) at `stamp_ns`; `values` keeps pose and derivatives."""
        row = super().step(stamp_ns)
        self._time = stamp_ns * 1e-9
        if self._left is None and self._wanted is None and self._share >= 1.0:
            return row
        self._since = self._time if self._since is None else self._since
        self.values, self._share = self._blended(
            self._left, self._wanted, self.values, self._time - self._since
        )
        reference_row(self.values, row)
        if self._share >= 1.0:
            self._left = self._wanted
        return row

    def _passage(
        self, left: Array | None, wanted: Array | None, begin: float
    ) -> tuple[Array, Array]:
        """Return instants (k,) [s] of a passage that begins at one, and its values (k, 18)."""
        waits = np.linspace(0.0, self._duration, _LOOKS)
        rows = [self._blended(left, wanted, self.motion.at(begin + w), w)[0] for w in waits]
        return begin + waits, np.array(rows)

    def _blended(
        self, left: Array | None, wanted: Array | None, motion: Array, since: float
    ) -> tuple[Array, float]:
        """Return the values (18,) so many s after a passage's beginning, and its share."""
        profile = envelope(np.array([since]), self._duration)
        share, rate, acceleration = (float(each[0]) for each in profile)
        a, b = _values(left, motion), _values(wanted, motion)
        return _product(a, b, share, rate, acceleration), share


def _values(pose: Array | None, motion: Array) -> Array:
    """Return pose and derivatives (18,) of a goal, or those of the motion."""
    return motion if pose is None else np.concatenate([pose, np.zeros(2 * _DOFS)])


def _product(left: Array, wanted: Array, s: float, ds: float, dds: float) -> Array:
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
