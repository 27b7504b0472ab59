"""The motion controller as a stage: bar pose and reference to wanted wrench."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from cspm_control.controllers.computed_wrench import ComputedWrench
from cspm_control.controllers.motion_controller import MotionController
from cspm_model.motion import Motion
from cspm_msgs_py.diagnostics import Level, Status
from cspm_msgs_py.schedule import (
    BAR_POSE,
    BAR_REFERENCE,
    FRAME_POSE,
    MOTION_CONTROLLER,
    MOTION_INTERNALS,
    WRENCH,
)
from cspm_msgs_py.stepping.stage import Send

Array = NDArray[np.float64]

UNMOVED = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])


class MotionStage:
    """Sends the wanted wrench.

    Attributes:
        controller: what computes it.
        deviation: by how much the bar is to be where its reference is not, if at all.
        internals: whether the controller's terms are sent as well.
        suspended: whether nobody follows the wrench.
        start_ns: when the planned deviation begins [ns].
    """

    node = MOTION_CONTROLLER

    def __init__(
        self,
        controller: MotionController | ComputedWrench,
        deviation: Motion | None = None,
        *,
        internals: bool = False,
    ) -> None:
        """Take the controller, and by how much the bar is to be where its reference is not.

        With `internals` the controller's terms are sent as well.
        """
        self.controller, self.deviation, self.internals = controller, deviation, internals
        self.suspended = False
        self.start_ns = 0

    def start(self, start_ns: int) -> None:
        """Let the planned deviation begin at an instant [ns]; without a call it begins at 0."""
        self.start_ns = start_ns

    def suspend(self, suspended: bool) -> None:
        """Begin anew with every step while nobody follows the wrench; go on from there."""
        self.suspended = suspended

    def step(self, now_ns: int, inputs: Mapping[str, Array], send: Send) -> None:
        """Send the wrench for the latest pose and reference."""
        if self.suspended:
            self.controller.restart()
        pose, reference = inputs[BAR_POSE], inputs[BAR_REFERENCE]
        if isinstance(self.controller, MotionController):
            send(WRENCH, self.controller.step(pose, reference))
        else:
            frame = inputs.get(FRAME_POSE, UNMOVED)
            plan, time = self.deviation, 1e-9 * (now_ns - self.start_ns)
            deviation = None if plan is None else plan.at(time)
            send(WRENCH, self.controller.step(pose, frame, reference, deviation))
        if self.internals:
            send(MOTION_INTERNALS, self.controller.terms.ravel())

    def status(self) -> Status:
        """Return that all is well, the motion controller having no limit of its own to meet.

        And the bar's mass, where that is estimated.
        """
        values = {}
        if isinstance(self.controller, ComputedWrench) and self.controller.adapted_mass:
            values["bar_mass"] = f"{self.controller.adapted_mass:.3f} kg"
        return Status(Level.OK, self.node, "ok", values)
