"""Controller parity: whether the described controllers reproduce the recorded commands.

Each controller receives recorded inputs, those from preceding controllers included. A difference is
therefore its own: other gains, another version, or a replaced stage.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.recording.reader import Recording
from cspm_msgs_py.recording.rows import Rows
from cspm_msgs_py.scenario import ClosedLoop
from cspm_msgs_py.schedule import CLOCK, Schedule, schedule_of
from cspm_run.assembly import assemble_stage
from cspm_run.bundle import Bundle
from cspm_run.recorded_bundle import recorded_bundle

Array = NDArray[np.float64]

# Longest part of a recording whose commands are recomputed [s].
LONGEST_S = 10.0


class Parity(NamedTuple):
    """One controller's commands against the recorded ones.

    Attributes:
        node: the controller.
        topic: topic of its commands.
        compared: number of commands.
        different: number that differ in any bit, or are missing on one side.
        largest: largest difference, in the topic's units.
    """

    node: str
    topic: str
    compared: int
    different: int
    largest: float


def controller_parity(path: Path) -> tuple[Parity, ...]:
    """Return the parity of a recording's controllers, each stepped again with recorded inputs.

    At most ten seconds from the start are compared. Empty where the recording has no closed loop,
    or its messages are not those of a run in lockstep from the start.

    Args:
        path: the recording.
    """
    try:
        bundle = recorded_bundle(path)
        if not isinstance(bundle.scenario.control, ClosedLoop):
            return ()
        schedule = schedule_of(bundle.scenario, bundle.testbed.testbed)
        with Recording(path) as recording:
            needed = {
                name for plan in schedule.nodes.values() for name in (*plan.inputs, *plan.held)
            }
            needed |= {name for plan in schedule.nodes.values() for name in plan.outputs}
            found = recording.rows_of(needed - {CLOCK}, round(LONGEST_S * 1e9))
        recorded = {name: _by_step(rows, schedule, name) for name, rows in found.items()}
        return _stepped(bundle, schedule, recorded)
    except CspmError:
        return ()


def _by_step(rows: Rows, schedule: Schedule, name: str) -> dict[int, Array]:
    """Return the rows of the first seconds by their step.

    Raises:
        InputError: their stamps are not those of a run in lockstep.
    """
    timing, period = schedule.topics[name], schedule.period_ns
    last = round(LONGEST_S * 1e9) // period
    steps = np.arange(timing.first, last, timing.divider)[: len(rows.log_ns)]
    if not len(steps) or np.any(rows.log_ns[: len(steps)] != steps * period):
        raise InputError(f"{name}: allowed: messages in lockstep from the beginning")
    return dict(zip(steps.tolist(), rows.rows, strict=False))


def _stepped(
    bundle: Bundle, schedule: Schedule, recorded: Mapping[str, Mapping[int, Array]]
) -> tuple[Parity, ...]:
    with bundle.unpacked() as place:
        stages = {
            name: assemble_stage(name, bundle.scenario, bundle.testbed.testbed, place)
            for name in schedule.nodes
        }
    tallies = {
        (name, topic): _Tally() for name, plan in schedule.nodes.items() for topic in plan.outputs
    }
    sent_by = {topic for _, topic in tallies}
    known: dict[str, Array] = {}
    # Up to the first missing message.
    end = min(max(rows) + schedule.topics[name].divider for name, rows in recorded.items())
    for step in range(end):
        arrived = {name: rows[step] for name, rows in recorded.items() if step in rows}
        known.update({name: row for name, row in arrived.items() if name not in sent_by})
        for name, stage in stages.items():
            plan = schedule.nodes[name]
            if step < plan.first or step % plan.divider:
                continue
            sent: dict[str, Array] = {}
            stage.step(step * schedule.period_ns, known, sent.__setitem__)
            for topic in plan.outputs:
                tallies[name, topic].add(sent.get(topic), arrived.get(topic))
                if topic in arrived:
                    known[topic] = arrived[topic]
    return tuple(
        Parity(name, topic, each.compared, each.different, each.largest)
        for (name, topic), each in tallies.items()
    )


class _Tally:
    """Running counts of compared commands."""

    def __init__(self) -> None:
        self.compared = self.different = 0
        self.largest = 0.0

    def add(self, made: Array | None, recorded: Array | None) -> None:
        """Compare a controller's command with the recorded one; None where one is missing."""
        if made is None and recorded is None:
            return
        self.compared += 1
        if made is None or recorded is None:
            self.different += 1
        elif made.tobytes() != recorded.tobytes():
            self.different += 1
            self.largest = max(self.largest, float(np.abs(made - recorded).max()))
