"""What a cable does beside the law and the damper of the model."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bench.blind.reality.moments import end_velocities, moment
from cspm_sim.mujoco.influence import Acting, Scene

Array = NDArray[np.float64]

# Where the elements of a Maxwell-slip chain yield, in units of the mean.
_YIELDS = np.array([0.3, 0.6, 0.9, 1.3, 1.9])
CREEP_TIMES = (1.5, 9.0)  # [s]
SEGMENTS = 6
DRUM_GRIP = 10.0  # tension by which the rope's slip on the drum is scaled [N]
YIELDING = 4.0  # [s]


def elongations(scene: Scene) -> Array:
    """Return how much longer each cable is than unstretched, (n,) [m]."""
    exits, ends = np.split(scene.ends, 2)
    return np.asarray(np.linalg.norm(ends - exits, axis=1) - scene.unstretched)


class MaxwellSlip:
    """Internal friction of a rope: five springs in parallel, each of which slides at its force.

    Lampaert, Swevers, Al-Bender, IEEE Trans. Automatic Control 47 (2002).
    """

    def __init__(self, force: Array, displacement: float = 1e-3) -> None:
        """Take the force of all sliding (n,) [N] and the mean elongation at which they do [m]."""
        share = force[:, None] / len(_YIELDS)
        self._most = share
        self._stiffness = share / (displacement * _YIELDS)
        self._forces = np.zeros((len(force), len(_YIELDS)))
        self._elongation: Array | None = None

    def act(self, scene: Scene, acting: Acting) -> None:
        """Add the springs' forces."""
        acting.tension += self._forces.sum(axis=1)

    def advance(self, scene: Scene, period: float) -> None:
        """Stretch the springs, and let those beyond their force slide."""
        now = elongations(scene)
        if self._elongation is not None:
            grown = (now - self._elongation)[:, None]
            self._forces = np.clip(self._forces + self._stiffness * grown, -self._most, self._most)
        self._elongation = now


class Creep:
    """Elongation that follows the tension late, by two time constants of equal share.

    What the tension at the start has brought about is there already.
    """

    def __init__(self, compliance: Array) -> None:
        """Take the compliance in total (n,) [m/N]."""
        self._shares = compliance[:, None] / len(CREEP_TIMES)
        self._crept = np.zeros((len(compliance), len(CREEP_TIMES)))
        self._first: Array | None = None

    def act(self, scene: Scene, acting: Acting) -> None:
        """Add the length."""
        acting.length += self._crept.sum(axis=1)

    def advance(self, scene: Scene, period: float) -> None:
        """Creep for a period."""
        if self._first is None:
            self._first = scene.tensions.copy()
        goal = self._shares * (scene.tensions - self._first)[:, None]
        self._crept += (goal - self._crept) * -np.expm1(-period / np.array(CREEP_TIMES))


class DrumSlip:
    """Rope that slips out over its drum while it turns, the more the higher the tension."""

    def __init__(self, share: Array, radii: Array) -> None:
        """Take slip per length wound at `DRUM_GRIP` (n,), and drum radii (n,) [m/rad]."""
        self._share, self._radii = share, radii
        self._slipped = np.zeros(len(share))

    def act(self, scene: Scene, acting: Acting) -> None:
        """Add the length."""
        acting.length += self._slipped

    def advance(self, scene: Scene, period: float) -> None:
        """Slip for a period."""
        wound = self._radii * np.abs(scene.speeds) * period
        self._slipped = self._slipped + self._share * wound * scene.tensions / DRUM_GRIP


class LooseningAnchor:
    """An anchor that gives way from a time on, until it has given a length."""

    def __init__(self, length: Array, onset: float) -> None:
        """Take the lengths (n,) [m] and the onset [s]."""
        self._length, self._onset = length, onset

    def act(self, scene: Scene, acting: Acting) -> None:
        """Add the length."""
        acting.length -= self._length * np.expm1(-max(0.0, scene.time - self._onset) / YIELDING)

    def advance(self, scene: Scene, period: float) -> None:
        """Keep no memory."""


class SegmentDrag:
    """Drag on the pieces of a moving cable; each piece hands its share to the bar.

    Pieces move as the straight line between exit and attachment does.
    """

    def __init__(self, coefficient: Array) -> None:
        """Take what an attachment's motion across its cable meets, exit at rest, (n,) [N·s/m]."""
        middle = (np.arange(SEGMENTS) + 0.5) / SEGMENTS
        self._middle = middle
        # A piece at the share s of the way moves s times as fast and hands on s of its force.
        self._pieces = coefficient / np.sum(middle**2)

    def act(self, scene: Scene, acting: Acting) -> None:
        """Add the wrench on the bar."""
        exits, ends = np.split(scene.ends, 2)
        line = ends - exits
        line = line / np.linalg.norm(line, axis=1)[:, None]
        near, far = end_velocities(scene, exits, ends)
        s = self._middle[:, None, None]
        speed = (1.0 - s) * near + s * far
        across = speed - np.sum(speed * line, axis=2)[:, :, None] * line
        force = -self._pieces[:, None] * np.sum(s * across, axis=0)
        acting.wrench[:3] += force.sum(axis=0)
        acting.wrench[3:] += moment(ends - scene.body[:3], force)

    def advance(self, scene: Scene, period: float) -> None:
        """Keep no memory."""
