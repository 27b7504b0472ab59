"""A machine with all that it conceals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.blind.reality.late import Late, LateFault
from bench.blind.reality.phenomena import PHENOMENA
from bench.blind.reality.sensors import QUALITIES, REAL, Fault, Quality
from cspm_msgs_py.testbed import Testbed
from cspm_sim.mujoco.influence import Drive, Influence

Array = NDArray[np.float64]


class Reality(NamedTuple):
    """A machine as it is.

    Attributes:
        testbed: with the numbers that it has.
        influences: physics beside the test-bed's.
        drive: what lies between command and torque; None: nothing.
        faults: of its sensors, by topic.
        clocks: by how much faster than time sensors' clocks run, by topic.
        quality: of its sensors.
    """

    testbed: Testbed
    influences: tuple[Influence, ...]
    drive: Drive | None
    faults: Mapping[str, tuple[Fault, ...]]
    clocks: Mapping[str, float]
    quality: Quality


def conceal(
    testbed: Testbed,
    amounts: Mapping[str, Sequence[float]],
    onset: float,
    seed: int,
    sensors: str = REAL,
) -> Reality:
    """Return the machine in which phenomena act.

    Args:
        testbed: the machine as it is believed to be.
        amounts: by phenomenon, per cable (n,), or the one for the bar.
        onset: when physics and faults begin [s]; numbers of the machine, drives and clocks have
            none.
        seed: of phases and gusts.
        sensors: one of `QUALITIES`.
    """
    generator = np.random.default_rng([seed, 3])
    influences: list[Influence] = []
    drive: Drive | None = None
    faults: dict[str, tuple[Fault, ...]] = {}
    clocks: dict[str, float] = {}
    for name, values in amounts.items():
        phenomenon, amount = PHENOMENA[name], np.array(values, dtype=float)
        if phenomenon.alter is not None:
            testbed = phenomenon.alter(testbed, amount)
        if phenomenon.influence is not None:
            influence = phenomenon.influence(amount, testbed, generator)
            influences.append(Late(influence, onset) if onset else influence)
        if phenomenon.drive is not None:
            drive = phenomenon.drive(amount)
        if phenomenon.clocks is not None:
            clocks |= phenomenon.clocks(amount)
        if phenomenon.faults is not None:
            for topic, fault in phenomenon.faults(amount).items():
                added = LateFault(fault, onset) if onset else fault
                faults[topic] = (*faults.get(topic, ()), added)
    return Reality(testbed, tuple(influences), drive, faults, clocks, QUALITIES[sensors])
