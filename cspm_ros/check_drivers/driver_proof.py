"""What drivers have to prove before a run on hardware: a wiggle of each winch."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import Rates
from cspm_msgs_py.scenario_keys.drive import TENSION_DRIVE
from cspm_msgs_py.schedule import RATE_OF_SENSOR
from cspm_msgs_py.stepping.safe_state import Winches
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.wire import WireReader
from cspm_ros.check_drivers.driver_machine import TENSION, WINCHES
from cspm_ros.check_drivers.driver_statics import refuse_faults
from cspm_ros.check_drivers.wiggle_response import TORQUES, judge_wiggle
from cspm_ros.check_drivers.winch_wiggle import FEWEST_ROWS, WAYS, Plateau, WinchWiggle

Array = NDArray[np.float64]
# Rows whose mean says what the drives hold at the beginning.
_ROWS = 50
SILENT_NS = 2_000_000_000
REMEDY = "signs, order, units and axes as in the test-bed; nothing was controlled yet"


class DriverProof:
    """Hears drivers, wiggles each winch, and then holds the machine where it is.

    Attributes:
        passed: whether nothing was found to be wrong.
    """

    def __init__(self, testbed: Testbed, rates: Rates, needed: Collection[str], drive: str) -> None:
        """Take what is to be proved.

        Args:
            testbed: the machine.
            rates: of its sensors.
            needed: the measured topics to hear.
            drive: what the drives take.
        """
        self._slowest_hz = min(float(getattr(rates, RATE_OF_SENSOR[name])) for name in needed)
        self._testbed, self.topics, self._drive = testbed, tuple(needed), drive
        cables = testbed.cables
        self._radii = np.array([each.wound_radius for each in cables])
        self._readers = {name: WireReader(testbed.topics[name]) for name in needed}
        self._rows: dict[str, deque[Array]] = defaultdict(lambda: deque(maxlen=_ROWS))
        # A command answers both what turns and what pulls.
        self._stamps_ns = dict.fromkeys({TENSION, WINCHES} & set(needed), -1)
        self._answered_ns = self._heard_ns = -1
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
        if topic in self._stamps_ns:
            self._stamps_ns[topic] = stamp_ns
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

    def command(self, now_ns: int) -> tuple[int, Array] | None:
        """Return stamp [ns] and torques (n,) [N·m], or tensions [N], to command now.

        None while nothing is to be commanded: too little came yet, or nothing new.

        Raises:
            InputError: the drivers do not fit the machine, in one line.
        """
        stamp_ns = min(self._stamps_ns.values())
        heard = min(len(self._rows[name]) for name in self._stamps_ns)
        if heard < _ROWS or stamp_ns <= self._answered_ns:
            self._check_silence(now_ns)
            return None
        self._heard_ns = now_ns
        if self._wiggle is None:
            self._wiggle = WinchWiggle(self._testbed, self._held(), self._slowest_hz)
        self._answered_ns = stamp_ns
        count, row = len(self._testbed.cables), self._rows[WINCHES][-1]
        torque = self._wiggle.torque(now_ns, Winches(row[:count], row[count : 2 * count]))
        if self._wiggle.measuring is not None:
            self._keep(self._wiggle.measuring, TORQUES, torque)
        if self._wiggle.done and not self.passed:
            self._judge()
        if self._drive == TENSION_DRIVE:
            return stamp_ns, np.maximum(0.0, torque / self._radii)
        return stamp_ns, torque

    def _check_silence(self, now_ns: int) -> None:
        """Refuse drives that fall silent once they are wiggled."""
        if self.under_way and not self.passed and now_ns - self._heard_ns > SILENT_NS:
            names = " and ".join(sorted(self._stamps_ns))
            raise InputError(
                f"drivers: wiggle: nothing new of {names} for {SILENT_NS * 1e-9:g} s, allowed: both"
                " all the time; did a drive trip?"
            )

    def _held(self) -> Array:
        """Return the tensions (n,) [N] that the drives hold."""
        if TENSION in self.topics:
            held: Array = np.mean(self._rows[TENSION], axis=0)
            return held
        count = len(self._testbed.cables)
        torques: Array = np.mean(self._rows[WINCHES], axis=0)[2 * count :] / self._radii
        return torques

    def _keep(self, plateau: Plateau, topic: str, row: Array) -> None:
        self._plateaus.setdefault(plateau, defaultdict(list))[topic].append(row)

    def _judge(self) -> None:
        for plateau, kept in self._plateaus.items():
            silent = [name for name in self.topics if len(kept[name]) < FEWEST_ROWS]
            if silent:
                name = self._testbed.cable_names[plateau.winch]
                raise InputError(
                    f"drivers: wiggle: too few messages of {silent[0]} while {name} was held,"
                    f" allowed: {FEWEST_ROWS} in its time; a lower rate than rates has, or a gap?"
                )
        means = {
            plateau: {topic: np.mean(rows, axis=0) for topic, rows in kept.items()}
            for plateau, kept in self._plateaus.items()
        }
        refuse_faults(judge_wiggle(self._testbed, means), REMEDY)
        self.passed = True
