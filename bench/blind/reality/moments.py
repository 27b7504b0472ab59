"""Turning bodies: how their points move, and what forces at these turn them by."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_sim.mujoco.influence import Scene

Array = NDArray[np.float64]


def turned(rate: Array, arms: Array) -> Array:
    """Return ω × arm for arms (n, 3); `numpy.cross` takes ten times as long for so few."""
    x, y, z = rate
    return np.asarray(arms @ np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]))


def end_velocities(scene: Scene, exits: Array, ends: Array) -> tuple[Array, Array]:
    """Return how exits and attachments (n, 3) [m] move in world axes, (n, 3) [m/s] each."""
    near = scene.frame[3:6] + turned(scene.frame[6:], exits - scene.frame[:3])
    return near, scene.body[3:6] + turned(scene.body[6:], ends - scene.body[:3])


def moment(arms: Array, forces: Array) -> Array:
    """Return the sum of all arm × force, both (n, 3), as (3,)."""
    products = arms.T @ forces
    apart = products - products.T
    return np.array([apart[1, 2], apart[2, 0], apart[0, 1]])
