"""The player's node in lockstep: a recording in the place of the plant and of absent nodes."""

from __future__ import annotations

import time
from collections.abc import Mapping
from functools import partial

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.bag import BagStream
from cspm_msgs_py.diagnostics import decode_diagnostics
from cspm_msgs_py.graph import PLAYER, RECORDER, graph_of
from cspm_msgs_py.ros.contract_node import ContractNode
from cspm_msgs_py.ros.rendezvous import PlantSide
from cspm_msgs_py.stepping.lockstep import RECORDER_WINDOW, WINDOW, Sequence
from cspm_msgs_py.topics import DIAGNOSTICS
from cspm_msgs_py.wire import WireReader
from cspm_ros.replay.bag_selection import Selection
from cspm_ros.replay.player import Instant, Player, instants
from cspm_ros.replay.player_node import PLAY_EVERY_S, Controls
from cspm_ros.replay.recorded_steps import recorded_steps
from cspm_ros.replay.reproduction import Reproduction
from cspm_ros.runtime.lockstep_nodes import LockstepRun

Array = NDArray[np.float64]

_LOOK_EVERY_S = 0.02


class LockstepPlayerNode:
    """Plays what the nodes of the run do not send, in step with them, and compares what they send.

    Attributes:
        controls: the player and its services.
        started: whether all nodes of the run are connected.
        last_step: the last plant step played, −1 before the first.
        reproductions: by topic, how what was received compares with what was recorded.
        span_ns: first and last log time to be played [ns].
    """

    def __init__(
        self,
        node: ContractNode,
        bag: BagStream,
        run: LockstepRun,
        rate: float,
        *,
        paused: bool = False,
        duration_s: float | None = None,
    ) -> None:
        """Connect the player.

        Args:
            node: the ROS node.
            bag: the recording of a run in lockstep.
            run: what was recorded, and the nodes that take part now, `player` among them.
            rate: recorded time per wall time; 0 as fast as the nodes are.
            paused: whether to begin paused.
            duration_s: recorded time to play [s]; None all of it.

        Raises:
            InputError: the recording is none of a run in lockstep.
        """
        self._node, self._schedule = node, run.schedule
        self._present = frozenset(run.members)
        topics = run.bundle.testbed.testbed.topics
        edges = graph_of(self._schedule, run.members)
        self._publish = {
            name: node.raw_publisher(topics[name], edge.readers)
            for name, edge in edges.items()
            if PLAYER in edge.senders
        }
        read = [name for name, edge in edges.items() if PLAYER in edge.readers]
        self.reproductions = {name: Reproduction(topics[name]) for name in read}
        self._sequences = {name: Sequence(name, self._schedule) for name in read}
        self._decode = {name: WireReader(topics[name]).decode for name in read}
        for name in read:
            node.subscribe_numbered_rows(
                topics[name], partial(self._take, name), partial(self._refuse, name)
            )
        run.claim(node)
        others = [name for name in run.members if name != PLAYER]
        self._others = PlantSide(node, self._schedule.period_ns, others, self._note_progress)
        self._recorded = -1 if RECORDER in others else None
        self.started, self._reported_end = False, False
        self.last_step = -1
        self.refused = (0, "")
        selection = Selection(duration_s=duration_s)
        self.span_ns = selection.span_ns(bag)
        found = instants(bag.messages(_present(bag, self._schedule.topics)), self.span_ns[1])
        steps = recorded_steps(found, self._schedule, topics, str(bag.path))
        player = Player(steps, self._play, bag.start_ns, rate, paused=paused, ready=self._ready)
        self.controls = Controls(node, player)
        node.every(PLAY_EVERY_S, self._pump)
        self._timer = node.every(_LOOK_EVERY_S, self._start)

    @property
    def finished(self) -> bool:
        """Whether the run is over and everybody has all of it."""
        return self._reported_end and self._slowest() >= self.last_step

    @property
    def progress(self) -> int:
        """How far the run is, for those who watch whether it moves."""
        return self.last_step + sum(each.compared for each in self.reproductions.values())

    @property
    def waits_for_time(self) -> bool:
        """Whether pause or rate, and not another node, keeps it from going on."""
        player = self.controls.player
        return self.started and not player.finished and not player.blocked

    def stop(self) -> None:
        """End the run with the last step played."""
        self.controls.player.end()
        self._pump()

    def waiting(self) -> str:
        """Return what the run waits for."""
        if not self.started:
            return f"player waits for {', '.join(self._others.unmatched())}"
        late = [
            f"{name} after {max(0, each.complete) * self._schedule.period_ns * 1e-9:.3f} s"
            for name, each in self._sequences.items()
            if each.complete == self._slowest()
        ]
        late += [RECORDER] * (self._recorded == self._slowest())
        why = f" ({self.refused[0]} messages refused: {self.refused[1]})" if self.refused[0] else ""
        return f"player waits for {', '.join(late)}{why}"

    def _start(self) -> None:
        if not self._others.unmatched():
            self._timer.cancel()
            self.started = True
            self.controls.player.begin(time.monotonic())
            self._pump()

    def _pump(self) -> None:
        """Go on as far as time and the other nodes allow."""
        self.controls.advance()
        if self.controls.player.finished and not self._reported_end:
            self._reported_end = True
            self._others.tell_end(self.last_step)

    def _slowest(self) -> int:
        """Return the step through which everything has come back."""
        found = [each.complete for each in self._sequences.values()]
        found += [] if self._recorded is None else [self._recorded]
        return min(found, default=self.last_step)

    def _ready(self) -> bool:
        found = [each.complete + WINDOW for each in self._sequences.values()]
        found += [] if self._recorded is None else [self._recorded + RECORDER_WINDOW]
        return min(found, default=self.last_step) >= self.last_step

    def _play(self, instant: Instant) -> None:
        self.last_step += 1
        for _, topic, payload in instant.messages:
            if topic in self.reproductions:
                self.reproductions[topic].expect(*self._decode[topic](payload))
            elif topic != DIAGNOSTICS.name or self._speaks_for_absent(payload):
                self._publish[topic](payload)

    def _speaks_for_absent(self, payload: bytes) -> bool:
        names = {status.name for status in decode_diagnostics(payload).statuses}
        return self._present.isdisjoint(names)

    def _take(self, topic: str, stamp_ns: int, row: Array, number: int | None) -> None:
        self._sequences[topic].take(stamp_ns, number)
        self.reproductions[topic].take(stamp_ns, row)
        self._pump()

    def _note_progress(self, name: str, step: int) -> None:
        if self._recorded is not None and name == RECORDER:
            self._recorded = max(step, self._recorded)
            self._pump()

    def _refuse(self, topic: str, reason: str) -> None:
        self.refused = (self.refused[0] + 1, reason)
        self._node.complain(topic, reason)


def _present(bag: BagStream, wanted: Mapping[str, object]) -> list[str]:
    """Return the topics to read; what is missing among them is reported once it is missed."""
    return [name for name in (*wanted, DIAGNOSTICS.name) if name in bag.topics]
