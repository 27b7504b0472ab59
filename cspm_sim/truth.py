"""The true quantities of a run, as rows that are refreshed in place."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_model.kernels.motion import evaluate_motion
from cspm_model.kernels.rows import bar_twist_row, motion_twist_row, pose_row
from cspm_model.motion import Motion
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
    """All true quantities of a plant, and of the target where that is measured.

    Attributes:
        target: the target's motion, None where it is not measured.
        target_motion: what it does now, (18,), with its rows `target_pose` and `target_twist`.
        frame_pose, frame_twist, bar_pose, bar_twist: rows of the bodies.
        winches: angles, speeds and reported torques, (3, n).
    """

    def __init__(self, plant: AnyPlant, target: Motion | None = None) -> None:
        """Lay out the rows; `update` fills them. `target` is the target's motion."""
        self._plant, self.target = plant, target
        self.target_motion = np.zeros(18)
        self.target_pose, self.target_twist = np.zeros(7), np.zeros(6)
        self.frame_pose, self.frame_twist = np.zeros(7), np.zeros(6)
        self.bar_pose, self.bar_twist = np.zeros(7), np.zeros(6)
        self.winches = np.zeros((3, len(plant.tensions)))

    @property
    def quantities(self) -> list[Quantity]:
        """What there is to know of this machine."""
        plant, winches = self._plant, self.winches.ravel()
        found = []
        if plant.testbed.winch_frame:
            found.append(Quantity("/winch_frame/pose", plant.frame[:6], self.frame_pose))
            found.append(Quantity("/winch_frame/twist", self.frame_twist, self.frame_twist))
        if plant.testbed.bar:
            found.append(Quantity("/bar/pose", plant.bar_state[:6], self.bar_pose))
            found.append(Quantity("/bar/twist", self.bar_twist, self.bar_twist))
        if self.target is not None:
            found.append(Quantity("/target/pose", self.target_motion[:6], self.target_pose))
            found.append(Quantity("/target/twist", self.target_twist, self.target_twist))
        lengths = plant.unstretched_lengths
        found.append(Quantity("/winches/state", winches, winches))
        found.append(Quantity("/cables/tension", plant.tensions, plant.tensions))
        found.append(Quantity("/cables/unstretched_length", lengths, lengths))
        return found

    def update(self, torque: Array) -> None:
        """Bring all rows to the plant's present state; `torque` (n,) [N·m] was commanded last."""
        plant, winches = self._plant, self.winches
        if plant.testbed.winch_frame:
            pose_row(plant.frame, self.frame_pose)
            motion_twist_row(plant.frame, self.frame_twist)
        if plant.testbed.bar:
            pose_row(plant.bar_state, self.bar_pose)
            bar_twist_row(plant.bar_state, self.bar_twist)
        if self.target is not None:
            motion = self.target
            values = self.target_motion
            evaluate_motion(plant.time, motion.knots, motion.spacing, motion.periodic, values)
            pose_row(values, self.target_pose)
            motion_twist_row(values, self.target_twist)
        winches[0], winches[1] = plant.angles, plant.speeds
        winches[2] = plant.applied_torque(torque)
