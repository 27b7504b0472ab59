"""What drivers have to prove before a run on hardware: a wiggle of each winch."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.stepping.safe_state import Winches
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.wire import WireReader
from cspm_ros.check_drivers.driver_machine import TENSION, WINCHES
from cspm_ros.check_drivers.driver_statics import refuse_faults
from cspm_ros.check_drivers.wiggle_response import TORQUES, judge_wiggle
from cspm_ros.check_drivers.winch_wiggle import WAYS, Plateau, WinchWiggle

Array = NDArray[np.float64]
# Rows whose mean says what the drives hold at the beginning.
_ROWS = 50
REMEDY = "signs, order, units and axes as in the test-bed; nothing was controlled yet"


class DriverProof:
    """Hears drivers, wiggles each winch, and then holds the machine where it is.

    Attributes:
        passed: whether nothing was found to be wrong.
    """

    def __init__(self, testbed: Testbed, needed: Collection[str]) -> None:
        """Take the machine, and the measured topics to hear."""
        self._testbed, self.topics = testbed, tuple(needed)
        self._readers = {name: WireReader(testbed.topics[name]) for name in needed}
        self._rows: dict[str, deque[Array]] = defaultdict(lambda: deque(maxlen=_ROWS))
        self._answers = TENSION if TENSION in self.topics else WINCHES
        self._stamp_ns = self._answered_ns = -1
        self._wiggle: WinchWiggle | None = None
        self._plateaus: dict[Plateau, dict[str, list[Array]]] = {}
        self.passed = False
        self._warm_up()

    def _warm_up(self) -> None:
        """Judge something, so that nothing is loaded while winches wait for commands."""
        upright = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
        rows = {name: np.zeros(self._testbed.topics[name].width) for name in self.topics}
        rows |= {name: upright for name in rows if name.endswith("/pose")}
        rows[TORQUES] = np.zeros(len(self._testbed.cables))
        places = [Plateau(i, way) for i in range(len(self._testbed.cables)) for way in WAYS]
        judge_wiggle(self._testbed, dict.fromkeys(places, rows))

    def hear(self, topic: str, payload: bytes) -> None:
        """Take a message of a measured topic, as it came."""
        try:
            stamp_ns, row = self._readers[topic].decode(payload)
        except InputError:
            # The nodes say what is wrong with it.
            return
        self._rows[topic].append(row)
        if topic == self._answers:
            self._stamp_ns = stamp_ns
        if self._wiggle is not None and self._wiggle.measuring is not None:
            self._keep(self._wiggle.measuring, topic, row)

    @property
    def under_way(self) -> bool:
        """Whether it commands winches: from its first command on."""
        return self._wiggle is not None

    def restart(self) -> None:
        """Forget what came while something else was missing; what was wiggled stays so."""
        if self._wiggle is None:
            self._rows.clear()

    def torque(self, now_ns: int) -> tuple[int, Array] | None:
        """Return stamp [ns] and torques (n,) [N·m] to command now.

        None while nothing is to be commanded: too little came yet, or nothing new.

        Raises:
            InputError: the drivers do not fit the machine, in one line.
        """
        heard = min(len(self._rows[name]) for name in (WINCHES, self._answers))
        if heard < _ROWS or self._stamp_ns == self._answered_ns:
            return None
        if self._wiggle is None:
            self._wiggle = WinchWiggle(self._testbed, self._held())
        self._answered_ns = self._stamp_ns
        count, row = len(self._testbed.cables), self._rows[WINCHES][-1]
        torque = self._wiggle.torque(now_ns, Winches(row[:count], row[count : 2 * count]))
        if self._wiggle.measuring is not None:
            self._keep(self._wiggle.measuring, TORQUES, torque)
        if self._wiggle.done and not self.passed:
            self._judge()
        return self._stamp_ns, torque

    def _held(self) -> Array:
        """Return the tensions (n,) [N] that the drives hold."""
        if TENSION in self.topics:
            held: Array = np.mean(self._rows[TENSION], axis=0)
            return held
        count = len(self._testbed.cables)
        radii = np.array([each.drum_radius / each.gear_ratio for each in self._testbed.cables])
        torques: Array = np.mean(self._rows[WINCHES], axis=0)[2 * count :] / radii
        return torques

    def _keep(self, plateau: Plateau, topic: str, row: Array) -> None:
        self._plateaus.setdefault(plateau, defaultdict(list))[topic].append(row)

    def _judge(self) -> None:
        means = {
            plateau: {topic: np.mean(rows, axis=0) for topic, rows in kept.items()}
            for plateau, kept in self._plateaus.items()
        }
        refuse_faults(judge_wiggle(self._testbed, means), REMEDY)
        self.passed = True
