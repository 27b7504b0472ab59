"""The motion controller as a stage: bar pose and reference to wanted wrench."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from cspm_control.controllers.computed_wrench import ComputedWrench
from cspm_control.controllers.motion_controller import MotionController
from cspm_model.motion import Motion
from cspm_msgs_py.diagnostics import Level, Status
from cspm_msgs_py.schedule import BAR_POSE, BAR_REFERENCE, FRAME_POSE, MOTION_CONTROLLER, WRENCH
from cspm_msgs_py.stepping.stage import Send

Array = NDArray[np.float64]

UNMOVED = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])


class MotionStage:
    """Sends the wanted wrench."""

    node = MOTION_CONTROLLER

    def __init__(
        self, controller: MotionController | ComputedWrench, deviation: Motion | None = None
    ) -> None:
        """Take the controller, and by how much the bar is to be where its reference is not."""
        self._controller, self._deviation = controller, deviation
        self._suspended = False
        self._start_ns = 0

    def start(self, start_ns: int) -> None:
        """Let the planned deviation begin at an instant [ns]; untold it begins at 0."""
        self._start_ns = start_ns

    def suspend(self, suspended: bool) -> None:
        """Begin anew with every step while nobody follows the wrench; go on from there."""
        self._suspended = suspended

    def step(self, now_ns: int, inputs: Mapping[str, Array], send: Send) -> None:
        """Send the wrench for the latest pose and reference."""
        if self._suspended:
            self._controller.restart()
        pose, reference = inputs[BAR_POSE], inputs[BAR_REFERENCE]
        if isinstance(self._controller, MotionController):
            send(WRENCH, self._controller.step(pose, reference))
        else:
            frame = inputs.get(FRAME_POSE, UNMOVED)
            plan, time = self._deviation, 1e-9 * (now_ns - self._start_ns)
            deviation = None if plan is None else plan.at(time)
            send(WRENCH, self._controller.step(pose, frame, reference, deviation))

    def status(self) -> Status:
        """Return that all is well, the motion controller having no limit of its own to meet.

        And the bar's mass, where that is estimated.
        """
        values = {}
        if isinstance(self._controller, ComputedWrench) and self._controller.adapted_mass:
            values["bar_mass"] = f"{self._controller.adapted_mass:.3f} kg"
        return Status(Level.OK, self.node, "ok", values)
