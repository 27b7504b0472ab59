"""The lockstep schedule without ROS: state k, command k, step k + 1.

At each plant step the references are evaluated, the sensors observe, the controllers that are due
compute, everything is published with the stamp of the state it belongs to, and the plant
advances by one period with the new torques held.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_bringup.assembly import Assembly
from cspm_bringup.cascade import Cascade
from cspm_bringup.truth import Quantity, Truth
from cspm_msgs_py.diagnostics import Level, Status
from cspm_msgs_py.errors import DivergenceError
from cspm_sim.sensors import SensorModel

Array = NDArray[np.float64]
# Takes log time [ns], stamp [ns] and row; the row may change after the call.
Publish = Callable[[int, int, Array], None]
PublishStatuses = Callable[[int, list[Status]], None]

DIAGNOSTICS_RATE = 10
NO_ROW = np.zeros(0)


class _LastGood(NamedTuple):
    """When all cables were last taut, and the wrench last feasible [s]."""

    taut: float
    feasible: float


class _Tap(NamedTuple):
    """A true quantity, its sensor if it has one, and where truth and measurement are published."""

    quantity: Quantity
    publish_truth: Publish | None
    sensor: SensorModel | None
    publish_measured: Publish | None


class Loop:
    """One run in one process; `step` advances it by one plant period.

    After a step `slack` and `infeasible` tell of the state that was just published.
    """

    def __init__(
        self, parts: Assembly, publish: Mapping[str, Publish], publish_statuses: PublishStatuses
    ) -> None:
        """Take the parts, and where messages go: by topic; topics that are absent are not sent."""
        plant, rates = parts.plant, parts.scenario.rates
        self._parts = parts
        self._publish = publish
        self._publish_statuses = publish_statuses
        self._reference_divider = rates.plant // rates.wave_trajectory
        self._status_divider = max(1, rates.plant // DIAGNOSTICS_RATE)
        cables = parts.testbed.cables
        # Where there is no cable nothing is slack.
        self._slack_limit = np.array([0.0 if cable.has_cable else -1.0 for cable in cables])
        # Before anything is measured the winches hold what hangs on them.
        radii = np.array([cable.drum_radius / cable.gear_ratio for cable in cables])
        self._torque: Array = radii * plant.tensions
        self._cascade = (
            Cascade(parts.controllers, rates, self._torque) if parts.controllers else None
        )
        self._truth = Truth(plant)
        self._taps = [
            _Tap(
                q, publish.get("/truth" + q.topic), parts.sensors.get(q.topic), publish.get(q.topic)
            )
            for q in self._truth.quantities
        ]
        self._measured: dict[str, Array] = {}
        self._references: dict[str, Array] = {}
        self._slack_steps = 0
        self._now = 0
        self._last_good = _LastGood(0.0, 0.0)
        self.slack = False

    @property
    def infeasible(self) -> bool:
        """Whether the last wrench cannot be met within the tension limits."""
        return self._cascade is not None and self._cascade.infeasible

    def step(self) -> None:
        """Publish everything that belongs to the current instant, then advance the plant.

        Raises:
            DivergenceError: the plant left the range of its equations, or the bar that is to be
                controlled has turned over.
        """
        step = self._parts.plant.steps
        self._now = step * self._parts.period_ns
        self._send("/clock", NO_ROW)
        if step % self._reference_divider == 0:
            for name, trajectory in self._parts.references.items():
                self._references[name] = trajectory.step(self._now)
                self._send(name, self._references[name])
        self._observe(step)
        self._command(step)
        plant = self._parts.plant
        self.slack = bool((plant.tensions <= self._slack_limit).any())
        self._slack_steps += self.slack
        self._last_good = _LastGood(
            self._last_good.taut if self.slack else self._now * 1e-9,
            self._last_good.feasible if self.infeasible else self._now * 1e-9,
        )
        if step % self._status_divider == 0:
            self._publish_statuses(self._now, self._statuses())
        plant.step(self._torque)
        if self._cascade is not None and abs(plant.bar_state[3]) > np.pi:
            raise DivergenceError(
                f"t = {plant.time:.3f} s: bar roll {plant.bar_state[3]:.3f} rad passed ±π, the bar"
                " has turned over"
            )

    def history(self) -> str:
        """Return what preceded the current instant, in words, for the report of a divergence."""
        plant, names = self._parts.plant, self._parts.testbed.cable_names
        slack = [n for n, t in zip(names, plant.tensions, strict=True) if t <= 0.0]
        events = []
        if self.slack:
            events.append(
                f"slack since {self._last_good.taut:.3f} s ({', '.join(slack) or 'none now'})"
            )
        if self.infeasible:
            events.append(f"wrench infeasible since {self._last_good.feasible:.3f} s")
        if self._parts.testbed.bar:
            pose = ", ".join(f"{value:.3g}" for value in plant.bar_state[:6])
            events.append(f"bar at [{pose}] (m, rad)")
        return "before it: " + "; ".join(events) if events else "nothing unusual before it"

    def _send(self, topic: str, row: Array) -> None:
        publish = self._publish.get(topic)
        if publish is not None:
            publish(self._now, self._now, row)

    def _observe(self, step: int) -> None:
        """Publish the truth and what the sensors make of it."""
        now = self._now
        self._truth.update(self._torque)
        for quantity, publish_truth, sensor, publish_measured in self._taps:
            if publish_truth is not None:
                publish_truth(now, now, quantity.row)
            arrival = sensor.observe(step, now, quantity.values) if sensor else None
            if arrival is not None:
                stamp, measured = arrival
                self._measured[quantity.topic] = measured
                if publish_measured is not None:
                    publish_measured(now, stamp, measured)

    def _command(self, step: int) -> None:
        parts = self._parts
        if self._cascade is not None:
            reference = self._references.get("/bar/reference")
            self._torque = self._cascade.step(step, self._measured, reference, self._send)
        elif parts.torque_generator is not None:
            self._torque = parts.torque_generator.step(self._now)
            self._send("/winches/torque_command", self._torque)

    def _statuses(self) -> list[Status]:
        share = self._slack_steps / self._status_divider
        self._slack_steps = 0
        level = Level.WARN if share else Level.OK
        statuses = [
            Status(
                level, "plant", "slack cable" if share else "ok", {"slack_share": f"{share:.3f}"}
            )
        ]
        return statuses + (self._cascade.statuses() if self._cascade else [])
