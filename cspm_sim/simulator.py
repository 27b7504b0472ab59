"""The simulated test-bed as its surroundings see it: it is observed, then it advances."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_model.motion import Motion
from cspm_msgs_py.diagnostics import Level, Status
from cspm_msgs_py.errors import DivergenceError
from cspm_msgs_py.schedule import CLOCK
from cspm_sim.any_plant import AnyPlant
from cspm_sim.faults import Faults
from cspm_sim.kernels.phases import COUNTS, LAST_TAUT_NS, SLACK, SLACK_STEPS, STEPS
from cspm_sim.sensors import AnySensor
from cspm_sim.truth import Quantity, Truth

Array = NDArray[np.float64]
# Takes log time [ns], stamp [ns] and row; the row may change after the call.
Publish = Callable[[int, int, Array], None]

NO_ROW = np.zeros(0)


class _Tap(NamedTuple):
    """A true quantity, its sensor if it has one, and where truth and measurement are published."""

    quantity: Quantity
    publish_truth: Publish | None
    sensor: AnySensor | None
    publish_measured: Publish | None


class Simulator:
    """A plant with its sensors.

    Attributes:
        plant: the machine.
        sensors: by topic.
        period_ns: the plant's [ns].
        controlled: whether a closed loop is to keep the bar upright.
        faults: what fails; None: nothing can.
        truth: the true quantities.
        slack_limit: tensions up to which a cable is slack, (n,) [N].
        torque: motor torques (n,) [N·m] that the plant holds.
        measured: the latest row of each sensor, by topic.
        counts: what was observed, as `cspm_sim.kernels.phases` has it.
    """

    def __init__(
        self,
        plant: AnyPlant,
        sensors: Mapping[str, AnySensor],
        publish: Mapping[str, Publish],
        *,
        period_ns: int,
        controlled: bool,
        target: Motion | None = None,
        faults: Faults | None = None,
    ) -> None:
        """Take the parts.

        Args:
            plant: the machine.
            sensors: by topic.
            publish: where messages go, by topic; topics that are absent are not sent.
            period_ns: the plant's [ns].
            controlled: whether a closed loop is to keep the bar upright.
            target: the motion of the target where the bar's reference is measured.
            faults: what fails, if anything can.
        """
        self.plant = plant
        self.faults = faults
        self.sensors = sensors
        self.period_ns = period_ns
        self.controlled = controlled
        cables = plant.testbed.cables
        # Where there is no cable nothing is slack.
        self.slack_limit = np.array([0.0 if cable.has_cable else -1.0 for cable in cables])
        # Before anything is commanded the winches hold what hangs on them.
        radii = np.array([cable.wound_radius for cable in cables])
        self.torque: Array = radii * plant.tensions
        self._clock = publish.get(CLOCK)
        self.truth = Truth(plant, target)
        self._taps = [
            _Tap(q, publish.get("/truth" + q.topic), sensors.get(q.topic), publish.get(q.topic))
            for q in self.truth.quantities
        ]
        self.measured: dict[str, Array] = {}
        self.counts = np.zeros(COUNTS, dtype=np.int64)

    @property
    def slack(self) -> bool:
        """Whether any cable is slack in the state last observed."""
        return bool(self.counts[SLACK])

    @property
    def now_ns(self) -> int:
        """The present instant [ns]."""
        return self.plant.steps * self.period_ns

    def observe(self) -> None:
        """Publish the clock, the truth, and what the sensors make of it."""
        now, step = self.now_ns, self.plant.steps
        if self._clock is not None:
            self._clock(now, now, NO_ROW)
        if self.faults is not None:
            for name in self.faults.advance(now):
                self.plant.part(name)
        self.truth.update(self.torque)
        for quantity, publish_truth, sensor, publish_measured in self._taps:
            if publish_truth is not None:
                publish_truth(now, now, quantity.row)
            arrival = sensor.observe(step, now, quantity.values) if sensor else None
            for stamp, measured in self._arrived(quantity.topic, now, arrival):
                self.measured[quantity.topic] = measured
                if publish_measured is not None:
                    publish_measured(now, stamp, measured)
        counts = self.counts
        counts[SLACK] = (self.plant.tensions <= self.slack_limit).any()
        counts[SLACK_STEPS] += counts[SLACK]
        counts[STEPS] += 1
        if not counts[SLACK]:
            counts[LAST_TAUT_NS] = now

    def advance(self) -> None:
        """Move the plant by one period with `torque` held.

        Raises:
            DivergenceError: the plant left the range of its equations, or the bar that is to be
                controlled has turned over.
        """
        if self.faults is None:
            self.plant.step(self.torque)
        else:
            self._step_with(self.faults)
        self.check_upright()

    def _step_with(self, faults: Faults) -> None:
        locked = self.plant.locked
        self.plant.locked = locked or faults.brake
        try:
            self.plant.step(faults.torque(self.torque))
        finally:
            self.plant.locked = locked

    def _arrived(
        self, topic: str, now_ns: int, arrival: tuple[int, Array] | None
    ) -> Iterable[tuple[int, Array]]:
        if self.faults is not None:
            return self.faults.sensed(topic, now_ns, arrival)
        return () if arrival is None else (arrival,)

    def check_upright(self) -> None:
        """Check that a controlled bar is upright.

        Raises:
            DivergenceError: it has turned over.
        """
        plant = self.plant
        if self.controlled and abs(plant.bar_state[3]) > np.pi:
            raise DivergenceError(
                f"t = {plant.time:.3f} s: bar roll {plant.bar_state[3]:.3f} rad passed ±π, the bar"
                " has turned over"
            )

    def status(self) -> Status:
        """Return the share of steps with a slack cable since the last call, and what was cut."""
        share = int(self.counts[SLACK_STEPS]) / max(1, int(self.counts[STEPS]))
        self.counts[SLACK_STEPS] = self.counts[STEPS] = 0
        level = Level.WARN if share else Level.OK
        values, message = {"slack_share": f"{share:.3f}"}, "slack cable" if share else "ok"
        if self.plant.cut:
            values["cut"] = ", ".join(self.plant.cut)
            level, message = Level.WARN, "cable cut"
        if self.faults is not None:
            found = self.faults.described()
            if any(found.values()):
                values |= found
                level, message = Level.WARN, f"fault: {found['fault_events'] or found['faults']}"
        return Status(level, "plant", message, values)

    def history(self) -> list[str]:
        """Return what preceded the present instant, in words, for the report of a divergence."""
        plant = self.plant
        names = plant.testbed.cable_names
        slack = [n for n, t in zip(names, plant.tensions, strict=True) if t <= 0.0]
        events = [f"{name} cut" for name in plant.cut]
        if self.slack:
            taut, now = int(self.counts[LAST_TAUT_NS]) * 1e-9, ", ".join(slack) or "none now"
            events.append(f"slack since {taut:.3f} s ({now})")
        if plant.testbed.bar:
            pose = ", ".join(f"{value:.3g}" for value in plant.bar_state[:6])
            events.append(f"bar at [{pose}] (m, rad)")
        return events
