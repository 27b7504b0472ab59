"""The target tracker as a stage: measured poses of the target to the bar's reference."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from cspm_control.waves.target_filter import TargetFilter
from cspm_model.kernels.rows import reference_row
from cspm_msgs_py.diagnostics import Level, Status
from cspm_msgs_py.scenario import Scenario
from cspm_msgs_py.schedule import BAR_REFERENCE, TARGET_POSE, TARGET_TRACKER
from cspm_msgs_py.stepping.stage import Send

Array = NDArray[np.float64]


class TargetStage:
    """Sends the bar's reference: the target as filtered, plus the bar's offset from it.

    The offset is added coordinate by coordinate, as it is to a prescribed motion.

    Attributes:
        filter: what follows the target.
        offset: of the bar from the target, (6,) [m, rad].
        values: the last reference, x y z φ θ ψ, first and second derivatives, (18,).
    """

    node = TARGET_TRACKER

    def __init__(self, target: TargetFilter, offset: Array) -> None:
        """Take the filter, and the bar's offset from the target, (6,) [m, rad]."""
        self.filter, self.offset = target, offset
        self.values: Array = np.zeros(18)

    def step(self, now_ns: int, inputs: Mapping[str, Array], send: Send) -> None:
        """Send the reference (19,) for the latest pose."""
        self.values[:] = self.filter.step(inputs[TARGET_POSE]).ravel()
        self.values[:6] += self.offset
        row = np.empty(19)
        reference_row(self.values, row)
        send(BAR_REFERENCE, row)

    def status(self) -> Status:
        """Return that all is well: poses that do not come stop the stage, which then says so."""
        return Status(Level.OK, self.node, "ok", {})


def target_stage(scenario: Scenario) -> TargetStage:
    """Return the tracker of a scenario's target."""
    rates = scenario.rates
    found = TargetFilter(
        scenario.target.bandwidth,
        period=1.0 / rates.wave_trajectory,
        steps_per_pose=max(1, rates.wave_trajectory // rates.motion_capture),
    )
    return TargetStage(found, np.array(scenario.bar_offset))
