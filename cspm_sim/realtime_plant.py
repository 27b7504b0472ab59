"""The simulated plant in real time: it keeps step with the wall, whatever comes in time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.diagnostics import Level, Status
from cspm_msgs_py.errors import DivergenceError, InputError
from cspm_msgs_py.schedule import TORQUE_COMMAND, Schedule
from cspm_msgs_py.stepping.admission import Admission
from cspm_msgs_py.stepping.delay_histogram import DelayHistogram
from cspm_msgs_py.stepping.drive_link import DriveLink
from cspm_msgs_py.stepping.lateness import too_busy
from cspm_msgs_py.stepping.publisher_binding import PublisherBinding
from cspm_sim.simulator import Simulator
from cspm_sim.watchdog import Watchdog

Array = NDArray[np.float64]

# A step that is late is made up for, one more at each call, so that messages get their turn.
_MOST_STEPS_AT_ONCE = 2


class RealtimePlant:
    """Publishes state k at the instant k, and goes on to k + 1 one period later.

    Command k counts where it comes within that period: then the plant does what it does in
    lockstep. Otherwise it holds what it has, and counts a deadline missed.

    Attributes:
        failure: what ended the run, in one line, if anything did.
        missed: steps for which no torque command came in time.
        late: steps made more than a period too late.
        delays: from the state that a torque command was computed for to its arrival.
        refused: how many messages were unusable, and why the last was.
    """

    def __init__(
        self,
        simulator: Simulator,
        schedule: Schedule,
        steps: int,
        watchdog: Watchdog,
        publish_status: Callable[[int, Status], None],
        *,
        binding: PublisherBinding | None = None,
        lateness_ns: int | None = None,
        on_fault: Callable[[str], None] = lambda _: None,
        link: DriveLink | None = None,
    ) -> None:
        """Take the plant, how many steps to make, and what looks after its drives.

        Args:
            simulator: the plant with its sensors.
            schedule: of the run.
            steps: how many plant steps to make.
            watchdog: what looks after the drives.
            publish_status: where diagnostics go.
            binding: whose torque commands count; None: anybody's.
            lateness_ns: how old the state may be that a command answers [ns]; None: any age.
            on_fault: called with why the drives went to their safe state by a message.
            link: to the controller inside the drives; None: torques come as messages.
        """
        self._simulator = simulator
        self._schedule = schedule
        self._steps = steps
        self._watchdog = watchdog
        self._publish_status = publish_status
        self._admission = Admission(TORQUE_COMMAND, binding)
        self._lateness_ns, self._on_fault = lateness_ns, on_fault
        self._torque_timing = schedule.topics.get(TORQUE_COMMAND)
        self._start_ns: int | None = None
        self._link = link
        self._step = -1
        self._commanded = self._safe = False
        self.failure: str | None = None
        self.missed = self.late = 0
        self.delays = DelayHistogram()
        self.refused = (0, "")

    @property
    def step(self) -> int:
        """The last step whose state was published, −1 before the first."""
        return self._step

    @property
    def ended(self) -> bool:
        """Whether all steps are made, or the plant failed."""
        return self.failure is not None or self._step >= self._steps

    def start(self, start_ns: int) -> None:
        """Begin at an instant [ns] on the ROS clock."""
        self._start_ns = start_ns

    def now_ns(self, wall_ns: int) -> int:
        """Return the time that the drives live in [ns]: the plant's where they are part of it.

        A plant that is late makes up for it, and its drives with it.
        """
        if self._link is None or self._start_ns is None or self._step < 0:
            return wall_ns
        return self._start_ns + self._step * self._schedule.period_ns

    def receive_torque(
        self, stamp_ns: int, torque: Array, now_ns: int, gid: bytes | None = None
    ) -> None:
        """Take a torque command.

        Raises:
            InputError: it is another publisher's, its stamp is one that cannot be, or it comes
                too late.
        """
        fault = self._admission.fault(stamp_ns, now_ns, gid, safe=self._watchdog.safe)
        if fault is None and self._start_ns is not None and self._lateness_ns is not None:
            what = f"{TORQUE_COMMAND} answers a state of"
            fault = too_busy(what, now_ns - stamp_ns, self._lateness_ns)
        if fault is not None:
            raise InputError(fault)
        self._watchdog.command(now_ns, torque, stamp_ns)
        self._simulator.torque = torque
        if self._start_ns is not None:
            self._note_command(stamp_ns - self._start_ns, now_ns - stamp_ns)

    def _note_command(self, state_ns: int, delay_ns: int) -> None:
        """Note a command for a state at so many ns since the start, so much later."""
        period = self._schedule.period_ns
        # In the safe state torques answer no measurement, and have a time of their own.
        if state_ns >= 0 and state_ns % period == 0:
            self.delays.add(delay_ns)
        if state_ns > (self._step - 0.5) * period:
            self._commanded = True

    def refuse(self, now_ns: int, reason: str) -> None:
        """Take note of an unusable message; once the run has begun it trips the watchdog."""
        self.refused = (self.refused[0] + 1, reason)
        if self._start_ns is not None:
            self._watchdog.trip(now_ns, reason)
            self._on_fault(reason)

    def receive_brake(self, wanted: bool) -> None:
        """Set or release the brakes."""
        self._watchdog.brake(wanted)

    def receive_safe(self, safe: bool) -> None:
        """Hold by itself while the force controller is in its safe state."""
        self._watchdog.hold(safe)

    def tick(self, now_ns: int) -> None:
        """Make the steps that are due; to be called at least once in every period."""
        if self._start_ns is None or now_ns < self._start_ns or self.ended:
            return
        due = (now_ns - self._start_ns) // self._schedule.period_ns
        for _ in range(min(_MOST_STEPS_AT_ONCE, due - self._step)):
            if self._step >= 0 and not self._advance(now_ns):
                return
            self._step += 1
            self.late += due > self._step
            if self._step < self._steps:
                self._observe(now_ns)

    def _advance(self, now_ns: int) -> bool:
        timing, simulator = self._torque_timing, self._simulator
        if timing is not None and timing.latest(self._step) == self._step:
            self.missed += not self._commanded
            self._commanded = False
        safe = self._watchdog.torque(self.now_ns(now_ns))
        if safe is not None:
            simulator.torque = safe
            if self._watchdog.safe and not self._safe:
                # Or controllers would go on as if they were obeyed.
                self._on_fault(self._watchdog.reason)
        self._safe = self._watchdog.safe
        try:
            simulator.advance()
        except DivergenceError as err:
            events = "; ".join(simulator.history()) or "nothing unusual"
            self.failure = f"{err}; before it: {events}"
        return self.failure is None

    def _observe(self, now_ns: int) -> None:
        self._simulator.observe()
        if self._step % self._schedule.plant_status_divider == 0:
            level, name, message, values = self._simulator.status()
            values = {
                **values,
                "deadlines_missed": str(self.missed),
                "late_steps": str(self.late),
                "refused": str(self.refused[0]),
                "torque_delays": str(self.delays),
            }
            if self.refused[0] and level == Level.OK:
                level, message = Level.WARN, f"refused: {self.refused[1]}"
            elif self.missed and level == Level.OK:
                level, message = Level.WARN, "torque commands came too late"
            self._publish_status(now_ns, Status(level, name, message, values))
            self._publish_status(now_ns, self._watchdog.status())
        if self._link is not None:
            self._link.run()
