"""The tension distribution as a stage: wanted wrench and poses to wanted tensions."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from cspm_control.allocation.lost_cables import LostCables
from cspm_control.allocation.tension_distribution import TensionDistribution
from cspm_msgs_py.diagnostics import Level, Status
from cspm_msgs_py.schedule import (
    BAR_POSE,
    DISTRIBUTION_INTERNALS,
    FRAME_POSE,
    TENSION,
    TENSION_COMMAND,
    TENSION_DISTRIBUTION,
    WRENCH,
)
from cspm_msgs_py.stepping.stage import Send

Array = NDArray[np.float64]

# What is counted: whether the last wrench cannot be met, steps since the last status, and of these
# those with an infeasible wrench and with a tension at a limit.
INFEASIBLE, STEPS, INFEASIBLE_STEPS, SATURATED_STEPS, COUNTS = range(5)


class DistributionStage:
    """Sends the wanted tensions; `infeasible` says whether the last wrench cannot be met.

    Attributes:
        distribution: of the cables that are left.
        names: the cables'.
        lost_cables: what knows which are lost, if anything.
        internals: whether unlimited tensions and active limits are sent too.
        counts: see `INFEASIBLE`.
        bounds: the tension that a whole cable has [N], and the largest missing share of a wrench
            since the last status.
    """

    node = TENSION_DISTRIBUTION

    def __init__(
        self,
        distribution: TensionDistribution,
        names: tuple[str, ...],
        lost_cables: LostCables | None = None,
        *,
        internals: bool = False,
    ) -> None:
        """Take the distribution, the cables' names, and what knows lost cables.

        A lost cable's wanted tension is 0 N, by which the force controller releases its winch. With
        `internals` unlimited tensions and active limits are sent too.
        """
        self.distribution, self.names = distribution, names
        self.lost_cables, self._whole = lost_cables, distribution
        self.internals = internals
        self._unmoved = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
        self.counts, self.bounds = np.zeros(COUNTS, dtype=np.int64), np.zeros(2)

    @property
    def infeasible(self) -> bool:
        """Whether the last wrench cannot be met."""
        return bool(self.counts[INFEASIBLE])

    def step(self, now_ns: int, inputs: Mapping[str, Array], send: Send) -> None:
        """Send the tensions for the latest wrench, at the latest poses."""
        frame = inputs.get(FRAME_POSE, self._unmoved)
        self._look_for_lost(inputs.get(TENSION))
        found = self.distribution.step(inputs[WRENCH], inputs[BAR_POSE], frame)
        counts = self.counts
        counts[INFEASIBLE] = not found.feasible
        counts[STEPS] += 1
        counts[INFEASIBLE_STEPS] += counts[INFEASIBLE]
        counts[SATURATED_STEPS] += found.saturated > 0
        self.bounds[1] = max(self.bounds[1], found.residual)
        send(TENSION_COMMAND, self._of_all_cables(found.tensions))
        if self.internals:
            active = found.active_limits(self.distribution.limits)
            both = [self._of_all_cables(each) for each in (found.unlimited, active)]
            send(DISTRIBUTION_INTERNALS, np.concatenate(both))

    def status(self) -> Status:
        """Return shares of steps with an infeasible wrench, and with a tension at a limit.

        And the largest missing share of a wrench.
        """
        infeasible, steps, infeasible_steps, saturated = self.counts.tolist()
        steps = max(1, steps)
        values = {
            "infeasible_share": f"{infeasible_steps / steps:.3f}",
            "saturated_share": f"{saturated / steps:.3f}",
            "largest_residual": f"{self.bounds[1]:.3g}",
        }
        happened = bool(infeasible_steps or saturated)
        trouble = "wrench infeasible" if infeasible_steps else "tension at a limit"
        if self._lost_names:
            happened, trouble = True, "cable lost"
            values["lost"] = ", ".join(self._lost_names)
        self.counts[:] = infeasible, 0, 0, 0
        self.bounds[1] = 0.0
        level = Level.WARN if happened else Level.OK
        return Status(level, self.node, trouble if happened else "ok", values)

    @property
    def _lost_names(self) -> list[str]:
        found = self.lost_cables
        return [] if found is None else [self.names[i] for i in np.flatnonzero(found.lost)]

    def _look_for_lost(self, measured: Array | None) -> None:
        found = self.lost_cables
        if found is not None and measured is not None and found.step(measured):
            self.distribution = self._whole.without(found.lost)

    def _of_all_cables(self, values: Array) -> Array:
        """Return values of the cables that are left as those of all, with 0 for the lost ones."""
        if len(values) == len(self.names):
            return values
        assert self.lost_cables is not None
        whole = np.zeros(len(self.names))
        whole[~self.lost_cables.lost] = values
        return whole
