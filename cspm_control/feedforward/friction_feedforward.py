"""Torque ahead of the winches' friction, at the speeds of the references."""

from __future__ import annotations

from math import tanh

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_model.kernels.cable import RADIUS
from cspm_model.kernels.kinematics import cable_geometry
from cspm_model.kernels.rotation import euler_from_quaternion
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]

# Columns of the winches' friction: constant torque [N·m], torque per speed [N·m·s/rad], share of
# the load's torque.
DRY, VISCOUS, LOAD, COLUMNS = 0, 1, 2, 3
# Effects that describe it, and which of their parameters goes to which column. Of Stribeck's
# friction what is left at speed: its peak would be overdone where the smooth sign is not yet ±1.
DESCRIBED_BY = {
    "winch_coulomb_friction": ("torque", DRY),
    "winch_stribeck_friction": ("coulomb_torque", DRY),
    "winch_viscous_friction": ("coefficient", VISCOUS),
    "winch_load_friction": ("coefficient", LOAD),
}
# Columns of a reference row: the pose, and its twist.
POSITION, QUATERNION, TWIST = slice(0, 3), slice(3, 7), slice(7, 13)


def winch_friction(testbed: Testbed) -> Array:
    """Return the winches' friction as a test-bed's effects describe it, (n, COLUMNS).

    Raises:
        InputError: they describe none.
    """
    friction = np.zeros((len(testbed.cables), COLUMNS))
    names = testbed.cable_names
    for entry in testbed.effects:
        if entry.effect in DESCRIBED_BY:
            parameter, column = DESCRIBED_BY[entry.effect]
            for element in entry.elements or names:
                if element not in names:
                    raise InputError(
                        f"effects: {entry.effect}: no element '{element}', allowed:"
                        f" {', '.join(names)}"
                    )
                friction[names.index(element), column] += entry.numbers[parameter]
    if not friction.any():
        raise InputError(
            f"control.force.friction_feedforward: the effects of test-bed {testbed.name} tell of no"
            f" friction, allowed: with {', '.join(DESCRIBED_BY)}"
        )
    return friction


class FrictionFeedforward:
    """The torque that friction takes, were the winches as fast as bar and frame are to move.

    With q̇ = −l̇/r of the reference lengths (2-6), cables taken as stiff, the torque is
    (dry + load·r·t)·tanh(r·q̇/v) + viscous·q̇. The reference's speed is free of noise, so that the
    sign cannot chatter, and changes before a motor does that sticks, which a measured speed of zero
    would leave stuck.
    """

    def __init__(self, cables: Array, friction: Array, smooth_below: float) -> None:
        """Take the cables' parameter rows, friction (n, COLUMNS), and v, a cable's speed [m/s]."""
        self.cables, self.friction, self.smooth_below = cables, friction, smooth_below

    def torque(self, bar: Array, frame: Array, tensions: Array) -> Array:
        """Return torques (n,) [N·m] for reference rows (19,) and wanted tensions (n,) [N]."""
        torque = np.empty(len(tensions))
        friction_torque(bar, frame, tensions, self.cables, self.friction, self.smooth_below, torque)
        return torque


@njit(cache=True, error_model="numpy")
def _write_pose(row: Array, out: Array) -> None:
    """Write x y z φ θ ψ of a reference row."""
    out[:3] = row[POSITION]
    out[3], out[4], out[5] = euler_from_quaternion(row[QUATERNION])


@njit(cache=True, error_model="numpy")
def friction_torque(
    bar: Array,
    frame: Array,
    tensions: Array,
    cables: Array,
    friction: Array,
    smooth_below: float,
    out: Array,
) -> None:
    """Write what `FrictionFeedforward.torque` returns."""
    n = len(tensions)
    bar_pose, frame_pose = np.empty(6), np.empty(6)
    _write_pose(bar, bar_pose)
    _write_pose(frame, frame_pose)
    bar_twist, frame_twist = bar[TWIST], frame[TWIST]
    lengths, of_bar, of_frame = np.empty(n), np.empty((n, 6)), np.empty((n, 6))
    cable_geometry(cables, bar_pose, frame_pose, lengths, of_bar, of_frame)
    for i in range(n):
        winding = 0.0
        for axis in range(6):
            winding -= of_bar[i, axis] * bar_twist[axis] + of_frame[i, axis] * frame_twist[axis]
        radius = cables[i, RADIUS]
        dry = friction[i, DRY] + friction[i, LOAD] * radius * abs(tensions[i])
        out[i] = dry * tanh(winding / smooth_below) + friction[i, VISCOUS] * winding / radius
