"""The wave trajectory as a stage: references of all bodies at an instant."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from cspm_control.waves.wave_trajectory import WaveTrajectory
from cspm_msgs_py.diagnostics import Level, Status
from cspm_msgs_py.schedule import WAVE_TRAJECTORY
from cspm_msgs_py.stepping.stage import Send

Array = NDArray[np.float64]


class WaveStage:
    """Sends the reference of each body.

    Attributes:
        trajectories: the motions, by reference topic.
    """

    node = WAVE_TRAJECTORY

    def __init__(self, trajectories: Mapping[str, WaveTrajectory]) -> None:
        """Take the trajectories by reference topic."""
        self.trajectories = trajectories

    def step(self, now_ns: int, inputs: Mapping[str, Array], send: Send) -> None:
        """Send the references at `now_ns`."""
        for topic, trajectory in self.trajectories.items():
            send(topic, trajectory.step(now_ns))

    def status(self) -> Status:
        """Return that all is well: a prescribed motion cannot fail."""
        return Status(Level.OK, self.node, "ok", {})
