"""Physics beside that of the test-bed file: what it sees of the machine, and what it does to it."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Scene(NamedTuple):
    """The machine at an instant; arrays belong to the plant and change with it.

    Attributes:
        time: since the start [s].
        angles: of the motors, (n,) [rad], positive winds in.
        speeds: of the motors, (n,) [rad/s].
        torque: of the drives, (n,) [N·m].
        tensions: at the attachments, as last worked out, (n,) [N].
        unstretched: unstretched lengths, (n,) [m].
        ends: exits, then attachments, in world axes, (2n, 3) [m].
        frame: origin, velocity, ω of the winch frame in world axes, (9,) [m, m/s, rad/s].
        body: the same of the bar.
        rotation: from bar to world axes, (3, 3).
    """

    time: float
    angles: Array
    speeds: Array
    torque: Array
    tensions: Array
    unstretched: Array
    ends: Array
    frame: Array
    body: Array
    rotation: Array


class Acting:
    """What influences do together; they add to it.

    Attributes:
        torque: on the motor shafts, (n,) [N·m], positive winds in.
        tension: in the cables beside that of law and damper, (n,) [N].
        length: gained by the cables beside their winding, (n,) [m].
        radius: length wound per motor angle, (n,) [m/rad].
        wrench: on the bar, at its origin in world axes, (6,) [N, N·m].
    """

    def __init__(self, n: int) -> None:
        """Make it for `n` cables, everything zero."""
        self.torque, self.tension = np.zeros(n), np.zeros(n)
        self.length, self.radius = np.zeros(n), np.zeros(n)
        self.wrench: Array = np.zeros(6)

    def clear(self, radii: Array) -> None:
        """Leave nothing but drums of these radii (n,) [m/rad]."""
        for part in (self.torque, self.tension, self.length, self.wrench):
            part[:] = 0.0
        self.radius[:] = radii


class Influence(Protocol):
    """Physics that takes part at every stage of the integrator and may remember."""

    def act(self, scene: Scene, acting: Acting) -> None:
        """Add what it does at an instant."""

    def advance(self, scene: Scene, period: float) -> None:
        """Bring its memory to the end of a period [s] that ended in this scene."""


class Drive(Protocol):
    """What lies between the torque that is commanded and the torque of the motors."""

    def deliver(self, command: Array) -> Array:
        """Return the torque (n,) [N·m] at an instant at which a command (n,) [N·m] is given."""

    def advance(self, command: Array, period: float) -> None:
        """Bring its memory to the end of a period [s] for which a command is held."""
