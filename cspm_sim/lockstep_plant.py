"""The simulated plant's part in the lockstep handshake: it advances when command k is there."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.diagnostics import Status
from cspm_msgs_py.errors import DivergenceError, InputError
from cspm_msgs_py.graph import window_of
from cspm_msgs_py.schedule import TORQUE_COMMAND, Schedule
from cspm_msgs_py.stepping.lockstep import Sequence
from cspm_sim.simulator import Simulator

Array = NDArray[np.float64]


class LockstepPlant:
    """Publishes state k, waits for the torques of step k where some are due, and advances.

    Attributes:
        failure: what ended the run, in one line, if anything did.
        last_step: the last step whose state was published, −1 before the first.
    """

    def __init__(
        self,
        simulator: Simulator,
        schedule: Schedule,
        steps: int,
        followers: Iterable[str],
        publish_status: Callable[[int, Status], None],
        observed: Callable[[], None] = lambda: None,
    ) -> None:
        """Take the plant, how many steps to make, and whose progress to wait for.

        `observed` is called once all that belongs to a state was published.
        """
        self._simulator = simulator
        self._schedule = schedule
        self._steps = steps
        self._publish_status = publish_status
        self._torque_timing = schedule.topics.get(TORQUE_COMMAND)
        self._torques = Sequence(TORQUE_COMMAND, schedule) if self._torque_timing else None
        self._early: dict[int, Array] = {}
        self._progress = {name: schedule.idle_through(name) for name in followers}
        self._windows = {name: window_of(name) for name in self._progress}
        self._slowest = min(self._progress.values(), default=-1)
        self._furthest = self._allowed()
        # Where a topic's next message is not due yet, nothing is left to come until then.
        self._most_ahead = max(each.first + each.divider for each in schedule.topics.values())
        self._stopping = self._pumping = False
        self._observed = observed
        self.failure: str | None = None
        self.last_step = -1

    @property
    def ended(self) -> bool:
        """Whether the last step is done: all its commands came and the plant stopped."""
        return self._stopping and not self._owes_torque()

    @property
    def finished(self) -> bool:
        """Whether moreover everybody has all of it."""
        return self.ended and (not self._progress or self._slowest >= self.last_step)

    def start(self) -> None:
        """Publish the first state."""
        self._pumping = True
        self._observe()
        self._pumping = False
        self.pump()

    def stop(self) -> None:
        """End the run after the step underway."""
        self._stopping = True

    def receive_torque(self, stamp_ns: int, torque: Array, number: int | None = None) -> None:
        """Take a torque command; `number` is its sender's, None where that is not known.

        Raises:
            InputError: it is not the one that is due.
            CspmError: two senders send torque commands.
        """
        if self._torques is not None:
            self._torques.take(stamp_ns, number)
            # It may come before the step that it is for.
            self._early[stamp_ns // self._schedule.period_ns] = torque
            self.pump()

    def receive_progress(self, node: str, step: int) -> None:
        """Note that `node` has all of the steps up to `step`.

        Raises:
            InputError: the node cannot be so far.
        """
        if step > self.last_step + self._most_ahead:
            raise InputError(
                f"{node} at step {step}, allowed: at most {self.last_step + self._most_ahead}"
            )
        if node in self._progress:
            self._progress[node] = max(step, self._progress[node])
            self._slowest = min(self._progress.values())
            self._furthest = self._allowed()
            self.pump()

    def pump(self) -> None:
        """Advance as far as commands and acknowledgements allow."""
        if self._pumping:
            # A command of the drives' own came while a state was observed.
            return
        self._pumping = True
        try:
            self._pump()
        finally:
            self._pumping = False

    def _pump(self) -> None:
        while not self._stopping and self.last_step >= 0 and self._may_advance():
            self._simulator.torque = self._early.pop(self.last_step, self._simulator.torque)
            try:
                self._simulator.advance()
            except DivergenceError as err:
                events = "; ".join(self._simulator.history()) or "nothing unusual"
                self.failure = f"{err}; before it: {events}"
                self._stopping = True
                return
            if self.last_step + 1 == self._steps:
                self._stopping = True
                return
            self._observe()

    def waiting(self) -> str:
        """Return what the next step waits for."""
        if self._owes_torque():
            return f"plant waits for {TORQUE_COMMAND} of {self._now():.3f} s"
        windows = self._windows
        late = [n for n, step in self._progress.items() if step + windows[n] < self.last_step]
        if self._stopping:
            late = [n for n, step in self._progress.items() if step < self.last_step]
        return f"plant waits for {', '.join(late)} at {self._now():.3f} s"

    def _now(self) -> float:
        return self.last_step * self._schedule.period_ns * 1e-9

    def _owes_torque(self) -> bool:
        timing = self._torque_timing
        if self._torques is None or timing is None or timing.latest(self.last_step) is None:
            return False
        return self._torques.complete < self.last_step

    def _may_advance(self) -> bool:
        behind = bool(self._progress) and self._furthest < self.last_step
        return not behind and not self._owes_torque()

    def _allowed(self) -> int:
        """Return the last step from which those who are waited for let the plant advance."""
        return min((step + self._windows[n] for n, step in self._progress.items()), default=-1)

    def _observe(self) -> None:
        simulator = self._simulator
        self.last_step = simulator.plant.steps
        simulator.observe()
        if self.last_step % self._schedule.plant_status_divider == 0:
            self._publish_status(simulator.now_ns, simulator.status())
        self._observed()
