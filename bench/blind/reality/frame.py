"""What the winch frame does beside what motion capture sees of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bench.blind.reality.modes import swung
from bench.blind.reality.moments import moment
from cspm_sim.mujoco.influence import Acting, Scene

Array = NDArray[np.float64]

# Of two modes: share of the compliance, and frequency [Hz].
YIELDING_SHARES = np.array([[0.85], [0.15]])
YIELDING_HZ = np.array([[5.3], [17.0]])
_LOSS = 0.05  # of either mode, as a share of the critical one


class YieldingFrame:
    """A frame whose exits, all together, give way to what the cables pull, by two modes.

    Its markers sit at its foot, which does not move. The shift that the tensions at the start have
    brought about is there already. Cables' dampers do not feel how fast it gives way.
    """

    def __init__(self, compliance: float) -> None:
        """Take the compliance in total [m/N]."""
        self._compliance = compliance * YIELDING_SHARES
        self._stiffness = (2.0 * np.pi * YIELDING_HZ) ** 2
        self._shift, self._rate = np.zeros((2, 3)), np.zeros((2, 3))
        self._first: Array | None = None

    def act(self, scene: Scene, acting: Acting) -> None:
        """Add what longer cables and turned ones do."""
        exits, ends = np.split(scene.ends, 2)
        line = ends - exits
        moved = line - self._shift.sum(axis=0)
        length, longer = (np.linalg.norm(each, axis=1) for each in (line, moved))
        acting.length -= longer - length
        turn = line / length[:, None] - moved / longer[:, None]
        force = scene.tensions[:, None] * turn
        acting.wrench[:3] += force.sum(axis=0)
        acting.wrench[3:] += moment(ends - scene.body[:3], force)

    def advance(self, scene: Scene, period: float) -> None:
        """Let the frame swing for a period."""
        exits, ends = np.split(scene.ends, 2)
        line = ends - exits
        pull = scene.tensions @ (line / np.linalg.norm(line, axis=1)[:, None])
        if self._first is None:
            self._first = pull
        push = self._stiffness * self._compliance * (pull - self._first)
        loss = 2.0 * _LOSS * np.sqrt(self._stiffness)
        self._shift, self._rate = swung(
            self._shift, self._rate, self._stiffness, loss, push, period
        )
