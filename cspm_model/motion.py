"""A body's prescribed motion in six degrees of freedom, twice continuously differentiable.

Whatever made the motion (waves, a recorded file, a sequence of moves), it is held as values, first
and second derivatives at equally spaced knots and evaluated as the quintic Hermite spline
through them. Velocity and acceleration are the exact derivatives of the evaluated position, so
that a moving frame is consistent with itself whatever the step size.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cspm_model.kernels.motion import evaluate_motion
from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """Pose `x y z φ θ ψ` (m, rad; Euler angles of R = Rz(ψ)Ry(θ)Rx(φ)) as a function of time.

    Attributes:
        knots: shape (n, 18): pose, its first and its second time derivative at each knot.
        spacing: time between knots [s]; the first knot is at t = 0.
        periodic: whether the motion repeats after n·spacing; otherwise it holds its last pose.
    """

    knots: Array
    spacing: float
    periodic: bool = False

    def __post_init__(self) -> None:
        if self.knots.ndim != 2 or self.knots.shape[1] != 18 or len(self.knots) < 1:
            raise InputError(f"motion: knots have shape {self.knots.shape}, allowed: (n ≥ 1, 18)")
        if not np.isfinite(self.knots).all():
            raise InputError("motion: a knot is not finite, allowed: finite numbers")
        if not self.spacing > 0:
            raise InputError(f"motion: spacing {self.spacing} s, allowed: > 0")
        self.knots.setflags(write=False)

    @property
    def duration(self) -> float:
        """Time after which the motion repeats or stands still [s]."""
        return (len(self.knots) - (0 if self.periodic else 1)) * self.spacing

    def at(self, time: float) -> Array:
        """Return pose, first and second derivative at `time` [s], shape (18,).

        Before t = 0 and, where not periodic, after the last knot the body stands still.
        """
        out = np.empty(18)
        evaluate_motion(time, self.knots, self.spacing, self.periodic, out)
        return out

    @staticmethod
    def still(pose: Array) -> Motion:
        """Return the motion of a body that stands still at `pose`, shape (6,)."""
        return Motion(np.concatenate([pose, np.zeros(12)])[None, :], 1.0)
