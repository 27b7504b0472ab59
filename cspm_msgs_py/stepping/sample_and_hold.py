"""One node's part in a real-time run: it computes on the latest that came, and says how late.

A controller computes when its first input comes; where that input comes less often than the
controller is to compute, a timer has it compute on what it holds. Prescribed torques have no input
but the time: the timer has them computed from the start of the run. Inputs that are too old are not
computed on: silence passes the trouble on, to the force controller, which goes to its safe state.
All times are on the ROS clock and come in as arguments.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.diagnostics import Level, Status
from cspm_msgs_py.errors import ControllerError, InputError
from cspm_msgs_py.schedule import CLOCK, DIAGNOSTICS_RATE, FORCE_CONTROLLER, TENSION, Schedule
from cspm_msgs_py.stepping.admission import Admission
from cspm_msgs_py.stepping.lateness import too_busy
from cspm_msgs_py.stepping.plausibility import Anything, Plausibility
from cspm_msgs_py.stepping.publisher_binding import PublisherBinding
from cspm_msgs_py.stepping.stage import Guard, Stage

Array = NDArray[np.float64]
Publish = Callable[[int, int, Array], None]

_NO_ROW = np.zeros(0)


def _send_nothing(topic: str, row: Array) -> None:
    """Leave a message out."""


class SampleAndHold:
    """Steps a stage in real time.

    Attributes:
        late: computations that began later than one period after the instant they belong to, and
            periods without any.
        stale: times that it did not compute because an input was too old.
        refused: how many messages were unusable, and why the last was.
    """

    def __init__(
        self,
        stage: Stage,
        schedule: Schedule,
        stale_after: float,
        publish: Mapping[str, Publish],
        publish_status: Callable[[int, Status], None],
        guard: Guard | None = None,
        *,
        bindings: Mapping[str, PublisherBinding] | None = None,
        plausibility: Plausibility | None = None,
        lateness_ns: int | None = None,
        on_fault: Callable[[str], None] = lambda _: None,
    ) -> None:
        """Make the node's part.

        Args:
            stage: the controller.
            schedule: of the scenario, for rates and delays.
            stale_after: age beyond its due at which an input is too old [s].
            publish: where outputs go, by topic.
            publish_status: where diagnostics go.
            guard: the stage itself, where it has a safe state.
            bindings: to whom inputs are bound, by topic; absent: to nobody.
            plausibility: says which inputs cannot be true; absent: any can.
            lateness_ns: of a guard, how old the state may be that it answers [ns]; None: any age.
                Beyond it the guard goes to its safe state and nothing is sent.
            on_fault: where there is no guard, called with what has to lead to the safe state.
        """
        plan = schedule.nodes[stage.node]
        self._stage, self._guard, self._on_fault = stage, guard, on_fault
        self._stale_ns = round(stale_after * 1e9)
        self._publish, self._publish_status = publish, publish_status
        self._inputs = plan.inputs
        self._period_ns = plan.divider * schedule.period_ns
        # The force controllers follow the tensions that they close their loop on.
        self._trigger = TENSION if TENSION in plan.inputs else plan.inputs[0]
        interval = schedule.topics[self._trigger].divider
        self._lateness_ns, self._interval_ns = lateness_ns, interval * schedule.period_ns
        self._triggered = self._trigger != CLOCK and interval <= plan.divider
        # Half an interval allows for jitter where the sensor is faster than the controller.
        self._wait_ns = self._period_ns - interval * schedule.period_ns // 2
        self._delays = {
            name: schedule.topics[name].delay * schedule.period_ns
            for name in (*plan.inputs, *plan.held)
        }
        self._limits = {
            name: self._stale_ns + schedule.topics[name].divider * schedule.period_ns
            for name in self._delays
        }
        if stage.node == FORCE_CONTROLLER:
            # The guard allows what the scenario says and not a period more.
            self._limits = dict.fromkeys(self._delays, self._stale_ns)
        self._rows: dict[str, Array] = {}
        bound = bindings or {}
        self._admissions = {name: Admission(name, bound.get(name)) for name in self._delays}
        self._plausibility = plausibility or Anything()
        self._implausible: set[str] = set()
        self._safe = False
        self._stamp = self._due = 0
        self._sent: dict[str, int] = {}
        self._start_ns: int | None = None
        self._computed_ns: int | None = None
        self._awake_ns = 0
        self._status_due = 0
        self._worst_ns = 0
        self.late = self.stale = 0
        self.refused = (0, "")

    def start(self, start_ns: int) -> None:
        """Let what follows the time alone begin at an instant [ns] on the ROS clock."""
        self._start_ns = start_ns

    @property
    def safe(self) -> bool:
        """Whether the winches are in their safe state, as far as this node knows."""
        return self._safe if self._guard is None else self._guard.safe

    def note_safe(self, safe: bool) -> None:
        """Take from the node that has a guard whether the winches are in their safe state."""
        self._safe = safe

    def receive(
        self, topic: str, stamp_ns: int, row: Array, now_ns: int, gid: bytes | None = None
    ) -> None:
        """Take a message, and compute if it is the one that the stage waits for.

        Args:
            topic: its topic.
            stamp_ns: its stamp [ns].
            row: its numbers.
            now_ns: the present instant [ns].
            gid: identity of its publisher, None if unknown.

        Raises:
            InputError: it is another publisher's, or its stamp or its numbers cannot be true.
        """
        admission = self._admissions[topic]
        before = admission.stamp_ns
        fault = admission.fault(stamp_ns, now_ns, gid, safe=self.safe)
        if fault is not None:
            raise InputError(fault)
        if stamp_ns == before:
            return
        self._check_plausible(topic, stamp_ns, row)
        self._rows[topic] = row
        if topic == self._trigger and self._triggered:
            if before is not None and stamp_ns < before:
                # A clock that was restarted: what is due is counted from its new stamps.
                self._due = stamp_ns
            if stamp_ns >= self._due:
                self._due = stamp_ns + self._wait_ns
                self._compute(stamp_ns, now_ns)

    def _check_plausible(self, topic: str, stamp_ns: int, row: Array) -> None:
        running = self.begun and not self.safe
        fault = self._plausibility.fault(topic, stamp_ns, row, self._rows, running=running)
        self._implausible.discard(topic)
        if fault is not None:
            self._implausible.add(topic)
            raise InputError(fault)

    def hears(self, topics: Collection[str], now_ns: int) -> bool:
        """Return whether plausible messages of these topics came, not too old to compute on."""
        came = set(self._came) - self._implausible
        return set(topics) <= came and not self._too_old(topics, now_ns)

    def refuse(self, now_ns: int, reason: str) -> None:
        """Take note of an unusable message; in a run it leads to the safe state."""
        self.refused = (self.refused[0] + 1, reason)
        self.alarm(now_ns, reason)

    def alarm(self, now_ns: int, reason: str) -> None:
        """Go to the safe state, or have it gone to, once the run has begun."""
        if not self.begun:
            return
        if self._guard is not None:
            self._guard.trip(now_ns, reason)
        else:
            self._on_fault(reason)

    @property
    def begun(self) -> bool:
        """Whether the run has begun."""
        return self._start_ns is not None or self._computed_ns is not None

    @property
    def computed(self) -> bool:
        """Whether the stage has computed anything yet."""
        return self._computed_ns is not None

    def reset(self, now_ns: int) -> str | None:
        """Leave the safe state; return why not in one line while an input is not fresh."""
        read = [name for name in self._delays if name != CLOCK]
        blind = [name for name in read if not self.hears([name], now_ns)]
        if blind:
            return f"reset refused: no fresh {', '.join(blind)}"
        return None if self._guard is None else self._guard.reset(now_ns)

    def tick(self, now_ns: int) -> None:
        """Do what is due without a message: to be called once in every period."""
        if self._start_ns is not None and now_ns >= self._start_ns:
            self._rows.setdefault(CLOCK, _NO_ROW)
        if not self._triggered and self._trigger in self._rows:
            self._compute(now_ns, now_ns)
        if self._guard is not None:
            self._look_at_clock(self._guard, now_ns)
            # Before anything was commanded nobody misses an input that comes and goes.
            known = self._came if self._computed_ns is not None else ()
            ages = {name: self._age(name, now_ns) for name in known}
            self._stamp = now_ns
            # Who has no input of now has nothing to say: the drives hold by themselves. A stale one
            # is answered by nothing, so that its torques cannot be late.
            late = self._is_late(self._guard, now_ns, self._interval_ns)
            silent = late and self._age(self._trigger, now_ns) <= self._stale_ns
            send = _send_nothing if silent else self._send
            believed = self._rows
            if self._implausible:
                # Nobody holds a winch by a state that cannot be true.
                believed = {k: row for k, row in self._rows.items() if k not in self._implausible}
            self._guard.watch(now_ns, ages, send, believed)
        if now_ns >= self._status_due:
            self._status_due = now_ns + 1_000_000_000 // DIAGNOSTICS_RATE
            self._publish_status(now_ns, self._status(now_ns))

    def _compute(self, stamp_ns: int, now_ns: int) -> None:
        if any(name not in self._rows for name in self._inputs):
            return
        if self._guard is not None:
            self._look_at_clock(self._guard, now_ns)
            if self._is_late(self._guard, now_ns):
                return
        elif self._too_old(self._inputs, now_ns):
            self.stale += 1
            return
        self._stamp = stamp_ns
        try:
            self._stage.step(now_ns, self._rows, self._send)
        except ControllerError as err:
            self.alarm(now_ns, str(err))
            return
        behind = now_ns - stamp_ns - self._delays[self._trigger]
        self._worst_ns = max(self._worst_ns, behind)
        since = self._period_ns if self._computed_ns is None else stamp_ns - self._computed_ns
        self._computed_ns = stamp_ns
        self.late += (behind > self._period_ns) + max(0, round(since / self._period_ns) - 1)

    def _is_late(self, guard: Guard, now_ns: int, more_ns: int = 0) -> bool:
        """Return whether the input that is answered is too old, and trip the guard if it is.

        `more_ns` is allowed beside until the next one comes [ns].
        """
        stamp = self._admissions[self._trigger].stamp_ns if self._trigger != CLOCK else None
        if self._lateness_ns is None or self._computed_ns is None or stamp is None:
            return False
        allowed = self._lateness_ns + (more_ns if self._triggered else self._interval_ns)
        reason = too_busy(f"{self._stage.node} answers {self._trigger} of", now_ns - stamp, allowed)
        if reason is not None:
            guard.trip(now_ns, reason)
        return reason is not None

    def _look_at_clock(self, guard: Guard, now_ns: int) -> None:
        """Trip after a standstill of the node itself: others have taken over meanwhile."""
        still = now_ns - self._awake_ns
        if self._computed_ns is not None and still > self._stale_ns:
            old, allowed = -(-still // 1_000_000), self._stale_ns * 1e-6
            guard.trip(now_ns, f"stood still for {old} ms, allowed: {allowed:g} ms")
        self._awake_ns = now_ns

    def _send(self, topic: str, row: Array) -> None:
        # A safe torque has the time at which it was made, one after a reset that of a measurement.
        stamp = self._sent[topic] = max(self._stamp, self._sent.get(topic, -1) + 1)
        self._publish[topic](stamp, stamp, row)

    @property
    def _came(self) -> list[str]:
        """The topics of which a message came."""
        return [name for name, each in self._admissions.items() if each.stamp_ns is not None]

    def _age(self, topic: str, now_ns: int) -> int:
        stamp = self._admissions[topic].stamp_ns
        # The time itself, which has no stamp here, is never old.
        return 0 if stamp is None else max(0, now_ns - stamp - self._delays[topic])

    def _too_old(self, inputs: Collection[str], now_ns: int) -> str:
        """Return which of the inputs are too old to compute on."""
        return ", ".join(name for name in inputs if self._age(name, now_ns) > self._limits[name])

    def _status(self, now_ns: int) -> Status:
        level, name, message, values = self._stage.status()
        missing = [name for name in self._inputs if name not in self._rows]
        old = "" if missing else self._too_old(self._inputs, now_ns)
        values = {
            **values,
            "deadlines_missed": str(self.late),
            "stale_inputs": str(self.stale),
            "refused": str(self.refused[0]),
            "worst_latency_ms": f"{self._worst_ns * 1e-6:.3f}",
        }
        self._worst_ns = 0
        if level < Level.ERROR and (missing or old):
            level = Level.STALE
            message = f"waits for {', '.join(missing)}" if missing else f"stale input: {old}"
        elif level == Level.OK and self.refused[0]:
            level, message = Level.WARN, f"refused: {self.refused[1]}"
        return Status(level, name, message, values)


class WallTrajectory:
    """The wave trajectory in real time: references at its own rate from a common start."""

    def __init__(
        self,
        stage: Stage,
        schedule: Schedule,
        publish: Mapping[str, Publish],
        publish_status: Callable[[int, Status], None],
    ) -> None:
        """Take the stage and where its messages go."""
        self._stage = stage
        self._period_ns = schedule.nodes[stage.node].divider * schedule.period_ns
        self._publish, self._publish_status = publish, publish_status
        self._start_ns: int | None = None
        self._stamp = self._step = 0
        self._status_due = 0
        self._worst_ns = 0
        self.late = 0

    def start(self, start_ns: int) -> None:
        """Begin the motions at an instant [ns] on the ROS clock; once begun they go on."""
        if self._start_ns is None:
            self._start_ns = start_ns

    def tick(self, now_ns: int) -> None:
        """Send what is due by now."""
        if self._start_ns is not None and now_ns >= self._start_ns:
            step = (now_ns - self._start_ns) // self._period_ns
            if step >= self._step:
                self._stamp = self._start_ns + step * self._period_ns
                self._worst_ns = max(self._worst_ns, now_ns - self._stamp)
                self.late += step - self._step
                self._step = step + 1
                self._stage.step(step * self._period_ns, {}, self._send)
        if now_ns >= self._status_due:
            self._status_due = now_ns + 1_000_000_000 // DIAGNOSTICS_RATE
            self._publish_status(now_ns, self._status())

    def _send(self, topic: str, row: Array) -> None:
        self._publish[topic](self._stamp, self._stamp, row)

    def _status(self) -> Status:
        level, name, message, values = self._stage.status()
        values = {
            **values,
            "deadlines_missed": str(self.late),
            "worst_latency_ms": f"{self._worst_ns * 1e-6:.3f}",
        }
        self._worst_ns = 0
        if self._start_ns is None:
            message = "waits for the start"
        return Status(level, name, message, values)
