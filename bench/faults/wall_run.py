"""A run in real time on a clock of its own, whose torque commands take their time or get lost."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cspm_control.safety import GuardedStage
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.schedule import CLOCK, FORCE_CONTROLLER, TORQUE_COMMAND, WAVE_TRAJECTORY
from cspm_msgs_py.stepping.sample_and_hold import SampleAndHold, WallTrajectory
from cspm_msgs_py.stepping.stage import Stage
from cspm_ros.margins.lateness import lateness_ns
from cspm_run.assembly import assemble
from cspm_run.bundle import Bundle
from cspm_run.plant_guard import make_watchdog
from cspm_sim.realtime_plant import RealtimePlant
from cspm_sim.simulator import Simulator

Array = NDArray[np.float64]
START = 1_800_000_000_000_000_000  # ns
STALE_S = 0.05
LOST = None


def at_once(_: int) -> int | None:
    """Return no delay."""
    return 0


class WallRun:
    """Plant and controllers as in real time.

    Attributes:
        way: says of each command's stamp [ns] how long it takes [ns], or `LOST`.
        dog: looks after the drives.
        force: the force controller's part.
    """

    def __init__(self, folder: Path, bundle: Bundle) -> None:
        """Begin at rest; `folder` has what the scenario's motions read."""
        self.parts = assemble(bundle.scenario, bundle.testbed.testbed, folder)
        self.schedule, self.lateness = self.parts.schedule, lateness_ns(bundle)
        self.period, self.steps = self.schedule.period_ns, 0
        self.way: Callable[[int], int | None] = at_once
        self.now = START
        self._under_way: deque[tuple[str, int, Array]] = deque()
        self._late: list[tuple[int, int, Array]] = []
        self._flags: deque[tuple[int, bool]] = deque()
        self._delay: int | None = 0
        self.oldest = None if self.lateness is None else self.lateness + self.period
        self.dog = make_watchdog(bundle.scenario, self.parts.plant, self.oldest)
        self.plant = self._plant()
        self.nodes: dict[str, SampleAndHold] = {}
        for stage in self.parts.stages:
            self._connect(stage)
        self.force = self.nodes[FORCE_CONTROLLER]
        self.plant.start(START)

    def _plant(self) -> RealtimePlant:
        outputs = {name for plan in self.schedule.nodes.values() for name in plan.outputs}
        measured = [n for n in self.schedule.topics if n != CLOCK and n not in outputs]
        publish = {name: partial(self._measure, name) for name in measured}
        simulator = Simulator(
            self.parts.plant, self.parts.sensors, publish, period_ns=self.period, controlled=True
        )
        return RealtimePlant(
            simulator,
            self.schedule,
            10**9,
            self.dog,
            lambda *_: None,
            lateness_ns=self.lateness,
            on_fault=self._alarm,
        )

    def _connect(self, stage: Stage) -> None:
        outputs = self.schedule.nodes[stage.node].outputs
        publish = {name: partial(self._send, name) for name in outputs}
        if stage.node == WAVE_TRAJECTORY:
            self._waves = WallTrajectory(stage, self.schedule, publish, lambda *_: None)
            self._waves.start(START)
            return
        guard = stage if isinstance(stage, GuardedStage) else None
        self.nodes[stage.node] = SampleAndHold(
            stage,
            self.schedule,
            STALE_S,
            publish,
            lambda *_: None,
            guard,
            lateness_ns=self.lateness if guard else None,
            on_fault=self._alarm,
        )

    def _alarm(self, reason: str) -> None:
        self.force.alarm(self.now, reason)

    def _measure(self, name: str, _: int, stamp: int, row: Array) -> None:
        self._send(name, 0, START + stamp, row)

    def _send(self, name: str, _: int, stamp: int, row: Array) -> None:
        """Let a message come to all before what they make of it comes to any."""
        self._under_way.append((name, stamp, row.copy()))
        if len(self._under_way) > 1:
            return
        while self._under_way:
            name, stamp, row = self._under_way[0]
            for node, part in self.nodes.items():
                plan = self.schedule.nodes[node]
                if name in (*plan.inputs, *plan.held):
                    part.receive(name, stamp, row, self.now)
            if name == TORQUE_COMMAND:
                self._command(stamp, row)
            self._under_way.popleft()
        self._obey()

    def _command(self, stamp: int, row: Array) -> None:
        self._delay = self.way(stamp)
        if self._delay is not LOST:
            # None overtakes another.
            before = self._late[-1][0] if self._late else 0
            self._late.append((max(before, self.now + self._delay), stamp, row))

    def _obey(self) -> None:
        for message in [each for each in self._late if each[0] <= self.now]:
            self._late.remove(message)
            try:
                self.plant.receive_torque(message[1], message[2], message[0])
            except InputError as err:
                self.plant.refuse(message[0], str(err))

    def _tell_safe(self) -> None:
        """Let the plant hear of the force controller's safe state, as late as of its torques."""
        if self._delay is not LOST:
            self._flags.append((self.now + self._delay, self.force.safe))
        while self._flags and self._flags[0][0] <= self.now:
            self.plant.receive_safe(self._flags.popleft()[1])

    def go(self, count: int) -> tuple[Array, Array]:
        """Make steps; return the bar's positions (count, 3) [m] and the tensions on the way [N]."""
        places, tensions = [], []
        for _ in range(count):
            self.now = START + self.steps * self.period
            self._obey()
            self._waves.tick(self.now)
            self.plant.tick(self.now)
            for node in self.nodes.values():
                node.tick(self.now)
                node.note_safe(self.force.safe)
            self._tell_safe()
            self.steps += 1
            places.append(self.parts.plant.bar_state[:3].copy())
            tensions.append(self.parts.plant.tensions.copy())
        return np.array(places), np.array(tensions)

    def until_safe(self, most: int) -> int:
        """Step until the drives are in their safe state; return after how many steps.

        Raises:
            RuntimeError: they are not, after so many.
        """
        for count in range(1, most + 1):
            self.go(1)
            if self.dog.safe:
                return count
        raise RuntimeError(self.plant.failure or f"no safe state in {most} steps")

    def take_up(self) -> None:
        """Let commands come in time again, and leave the safe state.

        Raises:
            RuntimeError: a part does not leave it.
        """
        self.way, self._late = at_once, []
        self._flags.clear()
        self._delay = 0
        self.go(2)
        refusals = [self.force.reset(self.now)]
        self.go(2)
        refusals.append(self.dog.reset())
        self.go(2)
        if any(refusals) or self.dog.safe or self.force.safe:
            raise RuntimeError(f"no way out of the safe state: {refusals}")
