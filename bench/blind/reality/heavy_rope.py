"""Ropes that have mass: they hang through, swing, and drag in the air."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bench.blind.reality.modes import swung
from bench.blind.reality.moments import end_velocities, moment
from cspm_sim.mujoco.influence import Acting, Scene

Array = NDArray[np.float64]

LUMPS = 5
LOSS = 0.03  # of each of the rope's modes, as a share of the critical one
THREAD = 5e-4  # linear density of a rope whose drag alone counts [kg/m]

_ORDER = np.arange(1, LUMPS + 1)
# Where lumps sit along the way from exit to attachment; at its end sits half of one.
_PLACES = np.append(_ORDER, LUMPS + 1) / (LUMPS + 1)
# Modes of equal lumps at equal distances on a thread: sines, orthonormal.
_SHAPES = np.sqrt(2.0 / (LUMPS + 1)) * np.sin(np.pi * np.outer(_ORDER, _ORDER) / (LUMPS + 1))
_BENDING = 4.0 * np.sin(0.5 * np.pi * _ORDER / (LUMPS + 1)) ** 2


class HeavyRope:
    """Lumps of mass on the thread between exit and attachment, which move across it.

    Along the thread, which is stiff, half of the weight hangs on either end: the load cell at the
    exit reads more than the middle of the rope carries, the bar is pulled by less.
    """

    def __init__(self, density: Array, drag: Array, gravity: float) -> None:
        """Take the ropes.

        Args:
            density: mass per length (n,) [kg/m]; 0: no such rope.
            drag: what an attachment's slow motion across its rope meets, exit at rest, in still
                air, (n,) [N·s/m].
            gravity: along world z [m/s²].
        """
        self._on = np.flatnonzero(density)
        self._density = density[self._on]
        # A lump at the share s of the way moves s times as fast and hands on s of its force.
        self._drag = drag[self._on] / (np.sum(_PLACES[:-1] ** 2) + 0.5)
        self._gravity = np.array([0.0, 0.0, gravity])
        self._modes = np.zeros((len(self._on), LUMPS, 3))
        self._rates = np.zeros_like(self._modes)
        self._velocity: Array | None = None
        self._felt = np.broadcast_to(self._gravity, (len(self._on), LUMPS + 1, 3))

    def act(self, scene: Scene, acting: Acting) -> None:
        """Add the length that hanging through takes, and what the ends feel of weight and drag."""
        exits, ends, along, length = self._chords(scene)
        apart = length / (LUMPS + 1)
        mass = self._density * apart
        tension = scene.tensions[self._on]
        hang = _SHAPES @ self._modes
        steps = np.diff(hang, axis=1, prepend=0.0, append=0.0)
        acting.length[self._on] -= np.sum(steps**2, axis=(1, 2)) / (2.0 * apart)
        weight = self._density * length * np.sum(self._felt.mean(axis=1) * along, axis=1)
        acting.tension[self._on] += 0.5 * weight
        end = 0.5 * mass[:, None] * self._felt[:, -1]
        end = end - 0.5 * self._drag[:, None] * self._velocities(scene, exits, ends)[:, -1]
        force = (tension / apart)[:, None] * hang[:, -1] + _across(end, along)
        force += weight[:, None] * along
        acting.wrench[:3] += force.sum(axis=0)
        acting.wrench[3:] += moment(ends - scene.body[:3], force)

    def advance(self, scene: Scene, period: float) -> None:
        """Let the lumps swing for a period, from hanging still at first."""
        exits, ends, along, length = self._chords(scene)
        apart = length / (LUMPS + 1)
        mass = self._density * apart
        velocity = self._velocities(scene, exits, ends)
        before, self._velocity = self._velocity, velocity
        still = before is None or period == 0.0
        if before is not None and period > 0.0:
            self._felt = self._gravity - (velocity - before) / period
        slowing = (self._drag / mass)[:, None, None]
        push = _across((self._felt - slowing * velocity)[:, :-1], along[:, None])
        push = _SHAPES @ push
        stiffness = (scene.tensions[self._on] / (apart * mass))[:, None, None] * _BENDING[:, None]
        if still:
            self._modes = push / np.maximum(stiffness, 1.0)
            return
        loss = slowing + 2.0 * LOSS * np.sqrt(stiffness)
        self._modes, self._rates = swung(self._modes, self._rates, stiffness, loss, push, period)

    def _chords(self, scene: Scene) -> tuple[Array, Array, Array, Array]:
        """Return exits, attachments, unit vectors from those to these, and distances [m]."""
        exits, ends = (part[self._on] for part in np.split(scene.ends, 2))
        line = ends - exits
        length = np.sqrt(np.sum(line**2, axis=1))
        return exits, ends, line / length[:, None], length

    def _velocities(self, scene: Scene, exits: Array, ends: Array) -> Array:
        """Return how lumps would move on a straight thread, (ropes, LUMPS + 1, 3) [m/s]."""
        near, far = end_velocities(scene, exits, ends)
        return np.asarray(near[:, None] + _PLACES[:, None] * (far - near)[:, None])


def _across(vectors: Array, along: Array) -> Array:
    """Return the parts of vectors that are at right angles to unit vectors."""
    return np.asarray(vectors - np.sum(vectors * along, axis=-1, keepdims=True) * along)
