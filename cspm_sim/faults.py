"""What fails in a run: when it begins and ends, and what it does to messages and torques."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario_keys.faults import Fault, check_fault
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.topics import POSE

Array = NDArray[np.float64]
Message = tuple[int, Array]
"""Stamp [ns] and row."""
# Apart from the streams of the sensors' own noise.
_STREAM = 0xFA17
_PLACE = 3


@dataclass(eq=False)
class _Active:
    """A fault that has begun.

    Attributes:
        fault: what fails.
        end_ns: when it ends [ns].
        frozen: the message's row at which a sensor stays.
        waiting: messages of a late sensor: when each comes [ns], and the message.
    """

    fault: Fault
    end_ns: float
    frozen: Array | None = None
    waiting: deque[tuple[int, Message]] = field(default_factory=deque)


class Faults:
    """The faults of one run: those of its timetable, and those put in while it runs.

    All times are the plant's, since the start of the run.
    """

    def __init__(
        self,
        timetable: Sequence[Fault],
        testbed: Testbed,
        seed: int,
        *,
        realtime: bool,
        cuts: bool = True,
    ) -> None:
        """Take the timetable.

        Args:
            timetable: of the scenario.
            testbed: the machine.
            seed: of the run.
            realtime: whether messages may come late or not at all.
            cuts: whether the plant can cut cables.

        Raises:
            InputError: a fault that the machine cannot have.
        """
        self._testbed, self._realtime, self._cuts = testbed, realtime, cuts
        for i, fault in enumerate(timetable):
            self._check(fault, f"faults[{i}]")
        self._due = sorted(timetable, key=lambda fault: fault.at)
        self._active: list[_Active] = []
        self._generator = np.random.default_rng([seed, _STREAM])
        self._events: list[str] = []

    def put(self, fault: Fault, where: str) -> None:
        """Put a fault into the run at its next step; `where` names it in errors.

        Raises:
            InputError: a fault that the machine cannot have.
        """
        self._check(fault, where)
        self._due.insert(0, fault.model_copy(update={"at": 0.0}))

    def _check(self, fault: Fault, where: str) -> None:
        check_fault(fault, self._testbed, where, realtime=self._realtime)
        if fault.fault == "cable_cut" and not self._cuts:
            raise InputError(f"{where}: this plant cannot cut a cable, allowed: plant sim")

    def advance(self, now_ns: int) -> list[str]:
        """Begin and end what is due; return the names of cables that part now."""
        cut = []
        for active in [each for each in self._active if each.end_ns <= now_ns]:
            self._active.remove(active)
            self._events.append(f"ended at {now_ns * 1e-9:.3f} s: {active.fault}")
        while self._due and self._due[0].at * 1e9 <= now_ns:
            fault = self._due.pop(0)
            self._events.append(f"began at {now_ns * 1e-9:.3f} s: {fault}")
            if fault.fault == "cable_cut":
                cut.append(fault.on)
                continue
            lasts = math.inf if fault.lasts is None else round(fault.lasts * 1e9)
            self._active.append(_Active(fault, now_ns + lasts))
        return cut

    def sensed(self, topic: str, now_ns: int, message: Message | None) -> list[Message]:
        """Return what a sensor sends at an instant [ns] in place of its message, if it had one."""
        found = [] if message is None else [message]
        for active in self._active:
            if active.fault.on == topic:
                found = [made for each in found for made in self._one(active, now_ns, each)]
                while active.waiting and active.waiting[0][0] <= now_ns:
                    found.append(active.waiting.popleft()[1])
        return found

    def torque(self, torque: Array) -> Array:
        """Return what the winches turn a torque command (n,) [N·m] into."""
        names = self._testbed.cable_names
        for active in self._active:
            if active.fault.fault == "winch_weak" and active.fault.amount is not None:
                torque = torque.copy()
                torque[names.index(active.fault.on)] *= active.fault.amount
        return torque

    @property
    def brake(self) -> bool:
        """Whether the brakes are set by a fault."""
        return any(active.fault.fault == "brake" for active in self._active)

    def described(self) -> dict[str, str]:
        """Return which faults there are, and what began and ended since the last call."""
        found = {"faults": "; ".join(str(active.fault) for active in self._active)}
        found["fault_events"] = "; ".join(self._events)
        self._events.clear()
        return found

    def _one(self, active: _Active, now_ns: int, message: Message) -> list[Message]:
        stamp_ns, row = message
        kind, amount = active.fault.fault, active.fault.amount or 0.0
        if kind == "sensor_dropped":
            return []
        if kind == "sensor_late":
            active.waiting.append((now_ns + round(amount * 1e9), message))
            return []
        if kind == "sensor_frozen":
            active.frozen = row.copy() if active.frozen is None else active.frozen
            return [(stamp_ns, active.frozen)]
        changed = row.copy()
        # Of a pose the place: a quaternion with something added is none.
        part = changed[:_PLACE] if len(row) == len(POSE) and _is_pose(active.fault) else changed
        noise = self._generator.standard_normal(len(part)) if kind == "sensor_noisy" else 1.0
        part += amount * noise
        return [(stamp_ns, changed)]


def _is_pose(fault: Fault) -> bool:
    return fault.on.endswith("/pose")
