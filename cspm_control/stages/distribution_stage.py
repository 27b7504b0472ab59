"""The tension distribution as a stage: wanted wrench and poses to wanted tensions."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from cspm_control.allocation.tension_distribution import TensionDistribution
from cspm_msgs_py.diagnostics import Level, Status
from cspm_msgs_py.schedule import (
    BAR_POSE,
    FRAME_POSE,
    TENSION_COMMAND,
    TENSION_DISTRIBUTION,
    WRENCH,
)
from cspm_msgs_py.stepping.stage import Send

Array = NDArray[np.float64]


class DistributionStage:
    """Sends the wanted tensions; `infeasible` says whether the last wrench cannot be met."""

    node = TENSION_DISTRIBUTION

    def __init__(self, distribution: TensionDistribution) -> None:
        self._distribution = distribution
        self._unmoved = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
        self._steps = self._infeasible = self._saturated = 0
        self._residual = 0.0
        self.infeasible = False

    def step(self, now_ns: int, inputs: Mapping[str, Array], send: Send) -> None:
        """Send the tensions for the latest wrench, at the latest poses."""
        frame = inputs.get(FRAME_POSE, self._unmoved)
        found = self._distribution.step(inputs[WRENCH], inputs[BAR_POSE], frame)
        self.infeasible = not found.feasible
        self._steps += 1
        self._infeasible += self.infeasible
        self._saturated += found.saturated > 0
        self._residual = max(self._residual, found.residual)
        send(TENSION_COMMAND, found.tensions)

    def status(self) -> Status:
        """Return shares of steps with a wrench not met, and with a tension at a limit.

        And the largest missing share of a wrench.
        """
        steps = max(1, self._steps)
        values = {
            "infeasible_share": f"{self._infeasible / steps:.3f}",
            "saturated_share": f"{self._saturated / steps:.3f}",
            "largest_residual": f"{self._residual:.3g}",
        }
        happened = self._infeasible or self._saturated
        trouble = "wrench infeasible" if self._infeasible else "tension at a limit"
        self._steps = self._infeasible = self._saturated = 0
        self._residual = 0.0
        level = Level.WARN if happened else Level.OK
        return Status(level, self.node, trouble if happened else "ok", values)
