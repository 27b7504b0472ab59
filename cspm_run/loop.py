"""The lockstep schedule without ROS: state k, command k, step k + 1.

At each plant step the sensors observe, the stages that are due compute, everything is published
with the stamp of the state it belongs to, and the plant advances by one period with the new torques
held.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_control.safety import GuardedStage
from cspm_control.stages.distribution_stage import DistributionStage
from cspm_msgs_py.diagnostics import Status
from cspm_msgs_py.schedule import TORQUE_COMMAND, NodePlan
from cspm_msgs_py.stepping.stage import Stage
from cspm_run.assembly import Assembly
from cspm_sim.simulator import Publish, Simulator

Array = NDArray[np.float64]
PublishStatus = Callable[[int, Status], None]


class _Due(NamedTuple):
    """A stage and its share of the schedule."""

    stage: Stage
    plan: NodePlan


class Loop:
    """One run in one process; `step` advances it by one plant period.

    After a step `slack` and `infeasible` describe the state that was just published.

    Attributes:
        parts: what is stepped.
        schedule: of the run.
        simulator: the plant and its sensors.
        known: the latest row of each topic.
        distribution: the stage that distributes tensions, if there is one.
        guards: the stages that have a safe state.
        publish_status: where statuses go.
        last_feasible: when the wrench could be met last [s].
    """

    def __init__(
        self, parts: Assembly, publish: Mapping[str, Publish], publish_status: PublishStatus
    ) -> None:
        """Take the parts, and where messages go: by topic; topics that are absent are not sent."""
        self.parts = parts
        self._publish = publish
        self.publish_status = publish_status
        self.schedule = schedule = parts.schedule
        self.simulator = Simulator(
            parts.plant,
            parts.sensors,
            publish,
            period_ns=parts.period_ns,
            controlled=parts.controlled,
            target=parts.target,
            faults=parts.faults,
        )
        self.known = self.simulator.measured
        self.known[TORQUE_COMMAND] = self.simulator.torque
        self._due = [_Due(stage, schedule.nodes[stage.node]) for stage in parts.stages]
        found = [stage for stage in parts.stages if isinstance(stage, DistributionStage)]
        self.distribution = found[0] if found else None
        self.guards = [stage for stage in parts.stages if isinstance(stage, GuardedStage)]
        self.last_feasible = 0.0

    @property
    def slack(self) -> bool:
        """Whether any cable is slack."""
        return self.simulator.slack

    @property
    def infeasible(self) -> bool:
        """Whether the last wrench cannot be met within the tension limits."""
        return self.distribution is not None and self.distribution.infeasible

    def step(self) -> None:
        """Publish everything that belongs to the current instant, then advance the plant.

        Raises:
            DivergenceError: the plant left the range of its equations, or the bar that is to be
                controlled has turned over.
        """
        simulator = self.simulator
        step, now = simulator.plant.steps, simulator.now_ns
        simulator.observe()
        if step % self.schedule.plant_status_divider == 0:
            self.publish_status(now, simulator.status())
        for stage, plan in self._due:
            if step >= plan.first and step % plan.divider == 0:
                stage.step(now, self.known, self._send)
                if step % plan.status_divider == 0:
                    self.publish_status(now, stage.status())
        self.set_brakes()
        if not self.infeasible:
            self.last_feasible = now * 1e-9
        simulator.torque = self.known[TORQUE_COMMAND]
        simulator.advance()

    def set_brakes(self) -> None:
        """Set the brakes where a guard wants them."""
        if any(guard.brake for guard in self.guards):
            self.simulator.plant.locked = True

    def history(self) -> str:
        """Return what preceded the current instant, in words, for the report of a divergence."""
        events = self.simulator.history()
        if self.infeasible:
            events.insert(0, f"wrench infeasible since {self.last_feasible:.3f} s")
        return "before it: " + "; ".join(events) if events else "nothing unusual before it"

    def _send(self, topic: str, row: Array) -> None:
        self.known[topic] = row
        publish = self._publish.get(topic)
        if publish is not None:
            now = self.simulator.now_ns
            publish(now, now, row)
