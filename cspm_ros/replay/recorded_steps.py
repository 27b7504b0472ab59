"""A recorded run in lockstep, step by step, held against the schedule."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.schedule import Schedule
from cspm_msgs_py.stepping.lockstep import Sequence
from cspm_msgs_py.topics import Topic
from cspm_msgs_py.wire import WireReader
from cspm_ros.replay.player import Instant


def recorded_steps(
    found: Iterable[Instant], schedule: Schedule, topics: Mapping[str, Topic], source: str
) -> Iterator[Instant]:
    """Yield the instants of a recording, each the whole of a plant step, from step 0 on.

    A last instant that was cut short is left out.

    Args:
        found: the instants of the recording.
        schedule: of the run that was recorded.
        topics: of its test-bed, by name.
        source: the recording, for errors.

    Raises:
        InputError: messages that a run in lockstep would not have, or that are missing.
    """
    checks = {name: _Check(topics[name], schedule) for name in schedule.topics}
    cut: InputError | None = None
    for step, instant in enumerate(found):
        if cut is not None:
            raise cut
        if instant.log_ns != step * schedule.period_ns:
            raise InputError(
                f"{source}: messages logged at {instant.log_ns} ns, allowed: one instant every"
                f" {schedule.period_ns} ns, as a run in lockstep leaves them"
            )
        for message in instant.messages:
            if message.topic in checks:
                checks[message.topic].take(message.payload, source)
        missing = [name for name, check in checks.items() if check.sequence.complete < step]
        if missing:
            cut = InputError(
                f"{source}: no {', '.join(missing)} at {instant.log_ns * 1e-9:.6f} s, allowed: all"
                " that the scenario's rates require"
            )
            continue
        yield instant


class _Check:
    """One topic's messages: what they are, and that none is missing."""

    def __init__(self, topic: Topic, schedule: Schedule) -> None:
        self._decode = WireReader(topic).decode
        self.sequence = Sequence(topic.name, schedule)

    def take(self, payload: bytes, source: str) -> None:
        try:
            stamp, _ = self._decode(payload)
            self.sequence.take(stamp)
        except InputError as err:
            raise InputError(f"{source}: {err}") from None
