"""The simulated machine behind drivers that are wrong, at the start of a run on hardware."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_control.safe_state import Hold
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.message import message_of
from cspm_msgs_py.ros_types import serialize
from cspm_msgs_py.scenario import Rates
from cspm_msgs_py.schedule import BAR_POSE, FRAME_POSE, TENSION, TORQUE_COMMAND, WINCH_STATE
from cspm_msgs_py.stepping.safe_state import Winches
from cspm_msgs_py.topics import Topic
from cspm_ros.check_drivers.driver_proof import DriverProof
from cspm_ros.check_drivers.driver_statics import DriverStatics
from cspm_run.assembly import assemble
from cspm_run.bundle import Bundle
from cspm_sim.simulator import Simulator

Array = NDArray[np.float64]
Change = Callable[[Array], Array]

MEASURED = (FRAME_POSE, BAR_POSE, WINCH_STATE, TENSION)
RATE = 200  # Hz, of all drivers
START_NS, PERIOD_NS = 1_700_000_000_000_000_000, 1_000_000_000 // RATE
# A drive without brakes misses the commands for so long, then it holds; it is watched so long [s].
WATCHDOG_S, WATCHED_S = 0.05, 1.0


@dataclass(frozen=True)
class WrongDrivers:
    """What drivers do otherwise than the contract.

    Attributes:
        rows: what is made of the numbers sent, or of the torque command obeyed, by topic.
        topics: as what they are described, by topic.
        late_ns: by how much stamps are behind [ns].
        every: one of so many messages is sent.
    """

    rows: Mapping[str, Change] = field(default_factory=dict)
    topics: Mapping[str, Callable[[Topic], Topic]] = field(default_factory=dict)
    late_ns: int = 0
    every: int = 1


class Outcome(NamedTuple):
    """How a start with some drivers went.

    Attributes:
        refusal: why the run did not begin, None if it may.
        farthest: largest way of a cable over its drum [m].
        astray: largest way of the bar [m].
        tautest: largest tension over its limit.
    """

    refusal: str | None
    farthest: float
    astray: float
    tautest: float


class DriverLab:
    """A machine at rest, whose drives hold it until a first command."""

    def __init__(self, bundle: Bundle, wrong: WrongDrivers) -> None:
        """Take the run that is to begin, and what is wrong."""
        self.testbed, self._wrong = bundle.testbed.testbed, wrong
        with bundle.unpacked() as place:
            parts = assemble(bundle.scenario, self.testbed, place)
        self.plant, self._per = parts.plant, bundle.scenario.rates.plant // RATE
        self._simulator = Simulator(
            parts.plant, parts.sensors, {}, period_ns=parts.period_ns, controlled=True
        )
        cables = self.testbed.cables
        self._radii = np.array([cable.wound_radius for cable in cables])
        self._limits = np.array([c.tension_limits[1] if c.tension_limits else 1.0 for c in cables])
        self._angles, self._bar = parts.plant.angles.copy(), parts.plant.bar_state[:3].copy()
        self._hold = Hold(self.testbed, parts.plant.tensions.copy(), 0.5)
        self._farthest = self._astray = self._tautest = 0.0
        self._simulator.observe()

    @property
    def rates(self) -> Rates:
        """What the scenario would expect of its sensors."""
        return Rates(winches=RATE, load_cells=RATE, motion_capture=RATE)

    def payloads(self, step: int) -> dict[str, bytes]:
        """Return what is sent at a step of the drivers, by topic."""
        if step % self._wrong.every:
            return {}
        stamp_ns, found = START_NS + step * PERIOD_NS - self._wrong.late_ns, {}
        for name in MEASURED:
            described = self._wrong.topics.get(name, lambda topic: topic)
            row = self._wrong.rows.get(name, np.copy)(self._simulator.measured[name])
            topic = described(self.testbed.topics[name])
            sent = np.ascontiguousarray(row[: topic.width])
            found[name] = serialize(message_of(topic, stamp_ns, sent))
        return found

    def obey(self, torque: Array | None) -> None:
        """Obey a torque for one period of the drivers; None: as before."""
        if torque is not None:
            self._simulator.torque = self._wrong.rows.get(TORQUE_COMMAND, np.copy)(torque)
        self._go_on()

    def stop(self, *, brakes: bool) -> None:
        """Set the brakes, or let the drives miss the commands, and then hold by themselves."""
        self._go_on()
        if brakes:
            self.plant.locked = True
        for _ in range(round(WATCHDOG_S * RATE)):
            self._go_on()
        self._hold.begin(self.plant.tensions.copy())
        for step in range(round(WATCHED_S * RATE)):
            winches = Winches(self.plant.angles, self.plant.speeds)
            self._simulator.torque = self._hold.torque(step * PERIOD_NS, winches)
            self._go_on()

    def outcome(self, refusal: str | None) -> Outcome:
        """Return how it went so far."""
        return Outcome(refusal, self._farthest, self._astray, self._tautest)

    def _go_on(self) -> None:
        for _ in range(self._per):
            self._simulator.advance()
            self._simulator.observe()
        wound = np.abs(self.plant.angles - self._angles) * self._radii
        self._farthest = max(self._farthest, float(wound.max()))
        way = float(np.linalg.norm(self.plant.bar_state[:3] - self._bar))
        self._astray = max(self._astray, way)
        self._tautest = max(self._tautest, float((self.plant.tensions / self._limits).max()))


def started(bundle: Bundle, wrong: WrongDrivers, *, brakes: bool = True) -> Outcome:
    """Let a run on hardware begin with some drivers, as its nodes do; return how it went.

    Args:
        bundle: the run.
        wrong: what is wrong with the drivers.
        brakes: whether the winches have any, which a refusal sets.
    """
    lab = DriverLab(bundle, wrong)
    statics = DriverStatics(lab.testbed, lab.rates, MEASURED)
    proof = DriverProof(lab.testbed, lab.rates, MEASURED, bundle.scenario.drive)
    step = 0
    try:
        while not proof.passed:
            now_ns, command = START_NS + step * PERIOD_NS, None
            for name, payload in lab.payloads(step).items():
                statics.hear(name, now_ns, payload)
                proof.hear(name, payload)
            if statics.passed or not statics.waits():
                command = proof.command(now_ns)
            lab.obey(None if command is None else command[1])
            step += 1
    except InputError as err:
        lab.stop(brakes=brakes)
        return lab.outcome(str(err))
    return lab.outcome(None)


def renamed(*order: int) -> Callable[[Topic], Topic]:
    """Return what describes a topic with these of its joints, in this order."""

    def described(topic: Topic) -> Topic:
        names = tuple(topic.joint_names[i] for i in order)
        fields = tuple(f"{part}/{name}" for part in topic.parts for name in names)
        return replace(topic, joint_names=names, fields=fields)

    return described
