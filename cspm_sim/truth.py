"""The true quantities of a run, as rows that are refreshed in place."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_model.kernels.rows import bar_twist_row, motion_twist_row, pose_row
from cspm_sim.any_plant import AnyPlant

Array = NDArray[np.float64]


class Quantity(NamedTuple):
    """One true quantity; both arrays keep their place and change with the plant.

    Attributes:
        topic: what a sensor of it publishes.
        values: as sensors take them, poses as x y z φ θ ψ.
        row: as messages carry them.
    """

    topic: str
    values: Array
    row: Array


class Truth:
    """All true quantities of a plant."""

    def __init__(self, plant: AnyPlant) -> None:
        """Lay out the rows; `update` fills them."""
        self._plant = plant
        self._frame_pose, self._frame_twist = np.zeros(7), np.zeros(6)
        self._bar_pose, self._bar_twist = np.zeros(7), np.zeros(6)
        self._winches = np.zeros((3, len(plant.tensions)))

    @property
    def quantities(self) -> list[Quantity]:
        """What there is to know of this machine."""
        plant, winches = self._plant, self._winches.ravel()
        found = []
        if plant.testbed.winch_frame:
            found.append(Quantity("/winch_frame/pose", plant.frame[:6], self._frame_pose))
            found.append(Quantity("/winch_frame/twist", self._frame_twist, self._frame_twist))
        if plant.testbed.bar:
            found.append(Quantity("/bar/pose", plant.bar_state[:6], self._bar_pose))
            found.append(Quantity("/bar/twist", self._bar_twist, self._bar_twist))
        lengths = plant.unstretched_lengths
        found.append(Quantity("/winches/state", winches, winches))
        found.append(Quantity("/cables/tension", plant.tensions, plant.tensions))
        found.append(Quantity("/cables/unstretched_length", lengths, lengths))
        return found

    def update(self, torque: Array) -> None:
        """Bring all rows to the plant's present state; `torque` (n,) [N·m] was commanded last."""
        plant, winches = self._plant, self._winches
        if plant.testbed.winch_frame:
            pose_row(plant.frame, self._frame_pose)
            motion_twist_row(plant.frame, self._frame_twist)
        if plant.testbed.bar:
            pose_row(plant.bar_state, self._bar_pose)
            bar_twist_row(plant.bar_state, self._bar_twist)
        winches[0], winches[1] = plant.angles, plant.speeds
        winches[2] = plant.applied_torque(torque)
