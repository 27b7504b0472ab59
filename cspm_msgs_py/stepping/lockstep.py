"""One node's part in the lockstep handshake: it computes when what the schedule names is there.

No node reads a clock. A node computes step k once the messages with exactly the stamps that it
needs at k have come, in whatever order; so neither the machine's speed nor the network's changes
what is computed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.diagnostics import Status
from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.schedule import Schedule
from cspm_msgs_py.stepping.stage import Stage

Array = NDArray[np.float64]
Publish = Callable[[int, int, Array], None]
# The plant runs ahead of what was acknowledged by fewer steps than messages are kept underway.
WINDOW = 8
ACKNOWLEDGE_EVERY = 4
# The recorder works in blocks, and nobody computes from what it does. At 1 kHz 48 ms may be
# unwritten, which with the 0.15 s of the writer is less than the 0.2 s that a recording may lose.
RECORDER_WINDOW = 48
RECORDED_EVERY = 24


class Sequence:
    """The stamps of one topic in the order in which they must come: none twice, none left out.

    Attributes:
        complete: the last plant step through which every message of the topic has come.
    """

    def __init__(self, topic: str, schedule: Schedule) -> None:
        self._topic = topic
        self._period_ns = schedule.period_ns
        self._timing = timing = schedule.topics[topic]
        self._next_ns = (timing.first - timing.delay) * schedule.period_ns
        self._doubled = -1
        # The number that the sender gives its next message; it counts from one.
        self.next_number = 1
        self.complete = timing.first - 1

    def take(self, stamp_ns: int, number: int | None = None) -> None:
        """Note a message.

        Args:
            stamp_ns: its stamp [ns].
            number: that its sender gave it, None where the middleware gives none. Others may send
                the very stamp that is due, but not as their message of that number.

        Raises:
            InputError: it is not the next one.
            CspmError: it cannot be distinguished from the one that was taken in its place.
        """
        if stamp_ns != self._next_ns or (number is not None and number != self.next_number):
            self._refuse(stamp_ns, number)
        self.advance(1)

    def take_block(self, stamps_ns: list[int], numbers: list[int | None]) -> bool:
        """Note messages that are the next ones, all of them; else note none and return False."""
        count, step = len(stamps_ns), self._timing.divider * self._period_ns
        due = range(self._next_ns, self._next_ns + count * step, step)
        known = range(self.next_number, self.next_number + count)
        if stamps_ns != list(due) or numbers not in (list(known), [None] * count):
            return False
        self.advance(count)
        return True

    @property
    def due(self) -> tuple[int, int, int]:
        """The next message's stamp, from it to the one after [ns], and its sender's number."""
        return self._next_ns, self._timing.divider * self._period_ns, self.next_number

    def advance(self, count: int) -> None:
        """Note so many messages that are the next ones."""
        self._next_ns += count * self._timing.divider * self._period_ns
        self.complete += count * self._timing.divider
        self.next_number += count

    def _refuse(self, stamp_ns: int, number: int | None) -> None:
        stamp, period_ns = f"{stamp_ns * 1e-9:.6f} s", self._timing.divider * self._period_ns
        behind, rest = divmod(self._next_ns - stamp_ns, period_ns)
        if not behind and not rest:
            raise InputError(
                f"{self._topic}: stamp {stamp} is its sender's message {number}, allowed:"
                f" {self.next_number}; a second sender"
            )
        if behind > 0 and not rest and number == self.next_number - behind:
            # A sender's messages keep their order: if a stranger's was taken in its place, the
            # genuine one comes before the next is taken; later only if strangers' followed.
            before, self._doubled = self._doubled, number
            if behind == 1 or number == before + 1:
                raise CspmError(
                    f"{self._topic}: two senders sent their message {number} with the stamp"
                    f" {stamp}, allowed: one sender (ROS_DOMAIN_ID keeps runs apart)"
                )
        why = (
            "came already: a restarted clock or a second sender"
            if stamp_ns < self._next_ns
            else "is early: messages lost or a second sender"
        )
        raise InputError(
            f"{self._topic}: stamp {stamp} {why}, allowed: {self._next_ns * 1e-9:.6f} s"
        )


def check_end(last_step: int, earliest: int, latest: int) -> None:
    """Refuse the end of a run that cannot be this one.

    Raises:
        InputError: `last_step` is before `earliest` or after `latest`.
    """
    if not earliest <= last_step <= latest:
        raise InputError(
            f"the last step is {last_step}, allowed: {earliest} to {latest}; another run's end"
        )


class Acknowledgement:
    """When a node reports to the plant how far it is: every few steps, and at the last.

    Attributes:
        last: the run's last step, once it is known.
    """

    def __init__(self) -> None:
        self._reported = -1
        self.last: int | None = None

    def due(self, reached: int) -> bool:
        """Return whether to report that all is there through step `reached`."""
        at_last = self.last is not None and self._reported < self.last <= reached
        if not at_last and reached < self._reported + ACKNOWLEDGE_EVERY:
            return False
        self._reported = reached
        return True


class Follower:
    """Steps a stage by its schedule.

    Attributes:
        completed: the last plant step through which nothing is left to compute, −1 at the start.
        now_ns: the instant computed last [ns].
    """

    def __init__(
        self,
        stage: Stage,
        schedule: Schedule,
        publish: Mapping[str, Publish],
        publish_status: Callable[[int, Status], None],
    ) -> None:
        """Take the stage, the run's schedule, and where its messages go."""
        self._stage = stage
        self._schedule = schedule
        self._plan = schedule.nodes[stage.node]
        self._publish = publish
        self._publish_status = publish_status
        self._pending: dict[str, dict[int, Array]] = {
            name: {} for name in (*self._plan.inputs, *self._plan.held)
        }
        self._sequences = {name: Sequence(name, schedule) for name in self._pending}
        # How far the plant may be from here, in either direction.
        coarsest = max(schedule.topics[name].divider for name in self._pending)
        self._ahead = (WINDOW + 2) * coarsest
        self._step = self._plan.first
        self.now_ns = 0
        self._needs = schedule.needs(stage.node, self._step)
        self.completed = self._step - 1

    def receive(self, topic: str, stamp_ns: int, row: Array, number: int | None = None) -> None:
        """Take a message, and compute every step for which all is there.

        `number` is its sender's, None where that is not known.

        Raises:
            InputError: it is not the topic's next message.
            CspmError: two senders send the topic.
        """
        self._sequences[topic].take(stamp_ns, number)
        self._pending[topic][stamp_ns] = row
        while self._is_ready():
            self._compute()

    @property
    def reached(self) -> int:
        """The last plant step through which every message came and nothing is left to compute.

        A node that computes seldom has to report this: what it has not read yet may be overwritten.
        """
        return min(self.completed, *(each.complete for each in self._sequences.values()))

    def check_end(self, last_step: int) -> None:
        """Check that the run can have ended with `last_step`.

        Raises:
            InputError: the plant cannot have been there.
        """
        # Before the first step the plant may be stopped at any.
        begun = self._step > self._plan.first
        earliest = self.reached - self._ahead if begun else -1
        check_end(last_step, earliest, max(self._plan.first, self.reached) + self._ahead)

    def waiting(self) -> str:
        """Return what the next step waits for."""
        missing = [
            f"{name} of {stamp * 1e-9:.3f} s"
            for name, stamp in self._needs.items()
            if stamp not in self._pending[name]
        ]
        return f"{self._stage.node} waits for {', '.join(missing)}"

    def _is_ready(self) -> bool:
        pending = self._pending
        for name, stamp in self._needs.items():  # noqa: SIM110 - `all` takes twice as long
            if stamp not in pending[name]:
                return False
        return True

    def _compute(self) -> None:
        plan, pending = self._plan, self._pending
        self.now_ns = self._step * self._schedule.period_ns
        inputs = {name: pending[name][stamp] for name, stamp in self._needs.items()}
        self._stage.step(self.now_ns, inputs, self._send)
        if self._step % plan.status_divider == 0:
            self._publish_status(self.now_ns, self._stage.status())
        self._step += plan.divider
        self._needs = self._schedule.needs(self._stage.node, self._step)
        self.completed = self._step - 1
        for name, oldest in self._needs.items():
            rows = pending[name]
            # They came in order.
            while rows and (stamp := next(iter(rows))) < oldest:
                del rows[stamp]

    def _send(self, topic: str, row: Array) -> None:
        self._publish[topic](self.now_ns, self.now_ns, row)
