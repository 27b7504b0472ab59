"""From messages as they come to a recording in order: nothing missing, nothing twice.

The schedule says which messages make a plant step whole. Only whole steps are written, so that the
recording does not depend on the order in which the network delivers. A message that is not the next
one of its topic, or not one at all, is refused and counted.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Collection

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.diagnostics import decode_diagnostics, encode_diagnostics, hardware_id_of
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording.channel_buffer import ChannelBuffer
from cspm_msgs_py.recording.writer import BLOCK_NS, RecordingWriter
from cspm_msgs_py.schedule import PLANT, Schedule
from cspm_msgs_py.stepping.lockstep import RECORDED_EVERY, RECORDER_WINDOW, Sequence, check_end
from cspm_msgs_py.topics import DIAGNOSTICS, Topic
from cspm_msgs_py.wire import WireReader

Array = NDArray[np.float64]
# Of a block's last steps some messages may be underway, which is no reason to wait for another.
_ACKNOWLEDGED = RECORDED_EVERY // 2


class _Inlet:
    """One topic: the stamps that it must bring, and what waits to be written."""

    def __init__(self, topic: Topic, channel: ChannelBuffer, schedule: Schedule) -> None:
        self.sequence = Sequence(topic.name, schedule)
        self._delay_ns = schedule.topics[topic.name].delay * schedule.period_ns
        reader = WireReader(topic)
        self._decode, self._decode_block = reader.decode, reader.decode_block
        self._append, self._row_bytes = channel.append_rows, 8 * topic.width
        self._stamps: list[int] = []
        self._rows = bytearray()

    def take(self, payload: bytes, number: int | None) -> None:
        """Keep a message.

        Raises:
            InputError: it is unusable, or not the next one.
            CspmError: two senders send the topic.
        """
        # What is unusable must not take the place of the message that it pretends to be.
        stamp, row = self._decode(payload)
        self.sequence.take(stamp, number)
        self._stamps.append(stamp)
        self._rows += row.tobytes()

    def take_block(self, payloads: list[bytes], numbers: list[int | None]) -> bool:
        """Keep messages if each is intact and the next one; else keep none and return False."""
        decoded = self._decode_block(payloads)
        if decoded is None or not self.sequence.take_block(decoded[0], numbers):
            return False
        self._stamps += decoded[0]
        self._rows += decoded[1].tobytes()
        return True

    def take_rows(self, rows: Array) -> None:
        """Keep the rows of messages that are the next ones, shape (n, width)."""
        first, step, _ = self.sequence.due
        self.sequence.advance(len(rows))
        self._stamps += range(first, first + len(rows) * step, step)
        self._rows += rows.tobytes()

    def write(self, end_ns: int) -> None:
        """Write what came before `end_ns`, all of which has to be of one block of log time."""
        count = bisect_left(self._stamps, end_ns - self._delay_ns)
        if count:
            stamps, size = self._stamps[:count], count * self._row_bytes
            logs = [stamp + self._delay_ns for stamp in stamps]
            self._append(logs, stamps, bytes(self._rows[:size]))
            del self._stamps[:count], self._rows[:size]


class TopicReceiver:
    """Takes several of a topic's messages at once.

    What is not as it should be is found by looking at one after the other.
    """

    def __init__(
        self,
        inlet: _Inlet,
        take: Callable[[bytes, int, int | None], None],
        count: Callable[[int], None],
    ) -> None:
        """Take the topic's inlet, what takes a single message, and what counts those of a block."""
        self._inlet, self._take, self._count = inlet, take, count

    @property
    def due(self) -> tuple[int, int, int]:
        """The next message's stamp, from it to the one after [ns], and its sender's number."""
        return self._inlet.sequence.due

    def receive_rows(self, rows: Array) -> None:
        """Take the rows of messages that are due, shape (n, width), and have been looked at."""
        self._inlet.take_rows(rows)
        self._count(len(rows))

    def receive_other(self, payload: bytes, number: int | None) -> None:
        """Take a message that is not due, or not as it should be: bytes, sender's number.

        Raises:
            CspmError: two senders send the topic.
        """
        self._take(payload, 0, number)

    def receive(self, payloads: list[bytes], numbers: list[int | None]) -> None:
        """Take messages of which nothing is known: bytes, senders' numbers.

        Raises:
            CspmError: two senders send the topic.
        """
        if self._inlet.take_block(payloads, numbers):
            self._count(len(payloads))
            return
        for payload, number in zip(payloads, numbers, strict=True):
            self.receive_other(payload, number)


class LockstepRecorder:
    """Gathers a lockstep run.

    Attributes:
        completed: the last plant step of which everything came, −1 at the start.
        done: whether all of an ended run is there and written.
        refused: how many messages were unusable, and why the last was.
    """

    def __init__(
        self,
        schedule: Schedule,
        topics: dict[str, Topic],
        writer: RecordingWriter,
        acknowledge: Callable[[int], None],
        complain: Callable[[str, str], None] = lambda _topic, _reason: None,
        reporting: Collection[str] = (),
        silent: Collection[str] = (),
    ) -> None:
        """Take what is to come, where it goes, and whom to report progress to.

        `complain` gets topic and reason of each message that is refused. The nodes in `reporting`
        send their statuses themselves, and nothing else on `/diagnostics`; of `silent` ones no
        status is waited for.
        """
        self._schedule = schedule
        self._writer = writer
        self._acknowledge, self._complain = acknowledge, complain
        self._inlets = {
            name: _Inlet(topics[name], writer.channel(name), schedule) for name in schedule.topics
        }
        self._order = (PLANT, *schedule.nodes)
        self._next_status = {PLANT: 0} | {
            node: -(-plan.first // plan.status_divider) * plan.status_divider
            for node, plan in schedule.nodes.items()
            if node not in silent
        }
        self._reports = dict.fromkeys(reporting, 0)
        self._numbered = self._reports.keys() >= self._next_status.keys()
        self._statuses: list[tuple[int, int, bytes]] = []
        self._written = 0
        self._target = _ACKNOWLEDGED - 1
        self._left = 1
        self._last: int | None = None
        self.completed = -1
        self.done = False
        self.refused: tuple[int, str] = (0, "")

    def receive(self, topic: str) -> Callable[[bytes, int, int | None], None]:
        """Return what takes a topic's messages: bytes, time of reception, sender's number.

        It raises `CspmError` where two senders send the topic.
        """
        keep = self._inlets[topic].take

        def take(payload: bytes, _: int, number: int | None = None) -> None:
            try:
                keep(payload, number)
            except InputError as err:
                self._refuse(topic, str(err))
                return
            self._count(1)

        return take

    def receiver(self, topic: str) -> TopicReceiver:
        """Return what takes several of a topic's messages at once."""
        return TopicReceiver(self._inlets[topic], self.receive(topic), self._count)

    def _count(self, taken: int) -> None:
        self._left -= taken
        if self._left <= 0:
            self._advance()

    def receive_diagnostics(self, payload: bytes, _: int, number: int | None = None) -> None:
        """Take a message of `/diagnostics`; `number` is its sender's, None where not known."""
        if number is not None and self._numbered and number - 1 not in self._reports.values():
            # Reported before it is decoded: whoever floods the topic sends more than can be
            # decoded.
            due = sorted({each + 1 for each in self._reports.values()})
            self._refuse(
                DIAGNOSTICS.name,
                f"{DIAGNOSTICS.name}: its sender's message {number}, allowed:"
                f" {', '.join(map(str, due))}; a second sender",
            )
            return
        try:
            stamp, [status] = decode_diagnostics(payload)
            node = status.name
            expected = self._next_status[node] * self._schedule.period_ns
        except (InputError, ValueError, KeyError):
            self._refuse(
                DIAGNOSTICS.name,
                f"{DIAGNOSTICS.name}: not one status of a node of this run, allowed: one",
            )
            return
        if stamp != expected:
            self._refuse(
                DIAGNOSTICS.name,
                f"{DIAGNOSTICS.name}: {node} at {stamp} ns, allowed: {expected} ns",
            )
            return
        if number is not None and node in self._reports:
            if number != self._reports[node] + 1:
                self._refuse(
                    DIAGNOSTICS.name,
                    f"{DIAGNOSTICS.name}: {node} at {stamp} ns is its sender's message {number},"
                    f" allowed: {self._reports[node] + 1}; a second sender",
                )
                return
            self._reports[node] = number
        self._next_status[node] += self._status_divider(node)
        # Between processes the middleware pads what it carries.
        canonical = encode_diagnostics(stamp, [status], hardware_id_of(payload))
        self._statuses.append((stamp, self._order.index(node), canonical))
        self._count(1)

    def end(self, last_step: int) -> None:
        """Note that the run ended with `last_step`; once that is whole, `done` is True.

        Raises:
            InputError: more is there already, or the plant cannot have been so far.
        """
        check_end(last_step, self.completed, self.completed + RECORDER_WINDOW + 2)
        self._last = last_step
        self._target = min(self._target, last_step)
        self._advance()

    def missing(self) -> list[str]:
        """Return what the earliest incomplete step lacks."""
        # What came since the last acknowledgement counts as well.
        completed = self._completed()
        late = [n for n, i in self._inlets.items() if i.sequence.complete == completed]
        silent = [n for n, step in self._next_status.items() if step == completed + 1]
        return late + [f"{DIAGNOSTICS.name} of {node}" for node in silent]

    def write_whole(self) -> None:
        """Write all whole steps; for a run that ends without saying so."""
        self._write(self._completed() + 1)

    def _refuse(self, topic: str, reason: str) -> None:
        self.refused = (self.refused[0] + 1, reason)
        self._complain(topic, reason)

    def _status_divider(self, node: str) -> int:
        if node == PLANT:
            return self._schedule.plant_status_divider
        return self._schedule.nodes[node].status_divider

    def _completed(self) -> int:
        rows = min(inlet.sequence.complete for inlet in self._inlets.values())
        return min(rows, min(self._next_status.values()) - 1)

    def _advance(self) -> None:
        """Write and acknowledge what is whole; count what is missing for the next time."""
        self.completed = self._completed()
        if self._last is not None and self.completed >= self._last and not self.done:
            self._write(self._last + 1)
            self.done = True
        if self.completed >= self._target:
            self._write(self.completed + 1)
            self._acknowledge(self.completed)
            self._target = self.completed + _ACKNOWLEDGED
            if self._last is not None:
                self._target = max(self.completed + 1, min(self._target, self._last))
        # Early messages of later steps count as well; then this is reached early and counts anew.
        self._left = max(
            1,
            sum(
                -(-(self._target - inlet.sequence.complete) // self._schedule.topics[name].divider)
                for name, inlet in self._inlets.items()
                if inlet.sequence.complete < self._target
            ),
        )

    def _write(self, end_step: int) -> None:
        """Write everything before `end_step`, all topics in the contract's order."""
        period_ns = self._schedule.period_ns
        while self._written < end_step:
            # All of a block has to be there before anything of the next one.
            next_block_ns = (self._written * period_ns // BLOCK_NS + 1) * BLOCK_NS
            self._written = min(end_step, -(-next_block_ns // period_ns))
            self._write_before(self._written * period_ns)

    def _write_before(self, end_ns: int) -> None:
        for inlet in self._inlets.values():
            inlet.write(end_ns)
        due = sorted(entry for entry in self._statuses if entry[0] < end_ns)
        self._statuses = [entry for entry in self._statuses if entry[0] >= end_ns]
        for stamp, _, payload in due:
            self._writer.append_payload(DIAGNOSTICS.name, stamp, payload)
