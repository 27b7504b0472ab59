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
from cspm_msgs_py.diagnostics import Level, Status
from cspm_sim.kernels.cable import HAS_CABLE, RADIUS
from cspm_sim.kernels.rows import bar_twist_row, motion_twist_row, pose_row

Array = NDArray[np.float64]
# Takes log time [ns], stamp [ns] and row.
Publish = Callable[[int, int, Array], None]
PublishStatuses = Callable[[int, list[Status]], None]

DIAGNOSTICS_RATE = 10
NO_ROW = np.zeros(0)


class _LastGood(NamedTuple):
    """When all cables were last taut, and the wrench last feasible [s]."""

    taut: float
    feasible: float


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
        cables = plant.parameters.cables
        self._has_cable = cables[:, HAS_CABLE] > 0.0
        # Before anything is measured the winches hold what hangs on them.
        self._torque: Array = cables[:, RADIUS] * plant.tensions
        self._cascade = (
            Cascade(parts.controllers, rates, self._torque) if parts.controllers else None
        )
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
            DivergenceError: the plant left the range of its equations.
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
        self.slack = bool(((plant.tensions <= 0.0) & self._has_cable).any())
        self._slack_steps += self.slack
        self._last_good = _LastGood(
            self._last_good.taut if self.slack else self._now * 1e-9,
            self._last_good.feasible if self.infeasible else self._now * 1e-9,
        )
        if step % self._status_divider == 0:
            self._publish_statuses(self._now, self._statuses())
        plant.step(self._torque)

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
        for topic, values, row in self._truth():
            self._send("/truth" + topic, row)
            sensor = self._parts.sensors.get(topic)
            arrival = sensor.observe(step, self._now, values) if sensor else None
            if arrival is not None:
                stamp, measured = arrival
                self._measured[topic] = measured
                publish = self._publish.get(topic)
                if publish is not None:
                    publish(self._now, stamp, measured)

    def _truth(self) -> list[tuple[str, Array, Array]]:
        """Return topic, values as sensors take them, and row, of all true quantities."""
        plant = self._parts.plant
        found: list[tuple[str, Array, Array]] = []
        if self._parts.testbed.winch_frame:
            pose, twist = np.empty(7), np.empty(6)
            pose_row(plant.frame, pose)
            motion_twist_row(plant.frame, twist)
            found.append(("/winch_frame/pose", plant.frame[:6], pose))
            found.append(("/winch_frame/twist", twist, twist))
        if self._parts.testbed.bar:
            pose, twist = np.empty(7), np.empty(6)
            pose_row(plant.bar_state, pose)
            bar_twist_row(plant.bar_state, twist)
            found.append(("/bar/pose", plant.bar_state[:6], pose))
            found.append(("/bar/twist", twist, twist))
        winches = np.concatenate((plant.angles, plant.speeds, plant.applied_torque(self._torque)))
        found.append(("/winches/state", winches, winches))
        found.append(("/cables/tension", plant.tensions, plant.tensions))
        lengths = plant.unstretched_lengths
        found.append(("/cables/unstretched_length", lengths, lengths))
        return found

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
