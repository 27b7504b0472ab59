"""What a recording may conceal: physics, a sensor's fault, or another number than the file's."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.blind.reality.sensors import Fault
from cspm_msgs_py.testbed import Testbed
from cspm_sim.mujoco.influence import Drive, Influence, Scene

Array = NDArray[np.float64]

CABLES, BAR, FRAME, CAPTURE = "cables", "bar", "winch_frame", "motion capture"


@dataclass(frozen=True)
class Phenomenon:
    """One thing that a recording may conceal, in an amount per cable, or one for the bar.

    Exactly one of `influence`, `drive`, `faults`, `clocks`, `alter` is there.

    Attributes:
        name: of its own.
        effect: the catalogue's id for it; None: the catalogue does not have it.
        block: where it is.
        parameter: the catalogue's parameter that the amount is; None where the forms differ too
            much for a comparison.
        column: torque on the shafts (n,) [N·m] that a unit of the parameter gives in the
            catalogue's form; None: the amount is the parameter.
        at: what the amount is per: `CABLES`, or one for `BAR`, `FRAME`, or both bodies' `CAPTURE`.
        unit: an amount of usual size, for what is not quite in proportion to it.
        influence: from amounts (n,) or (1,), machine and noise to the physics.
        drive: from amounts to what lies between command and torque.
        faults: from amounts to what it does to sensors, by topic.
        clocks: from amounts to how much faster than time sensors' clocks run, by topic.
        alter: from test-bed and amounts to the machine as it is.
        base: the parameter's value where the amount is 0.
        signed: whether the amount may be negative as well.
        driver: of what signal it is a function, as a diagnosis calls it, where the catalogue does
            not have it and one signal determines it; None: no such thing.
    """

    name: str
    effect: str | None
    block: str
    parameter: str | None
    column: Callable[[Scene], Array] | None = None
    at: str = CABLES
    unit: float = 1.0
    influence: Callable[[Array, Testbed, np.random.Generator], Influence] | None = None
    drive: Callable[[Array], Drive] | None = None
    faults: Callable[[Array], Mapping[str, Fault]] | None = None
    clocks: Callable[[Array], Mapping[str, float]] | None = None
    alter: Callable[[Testbed, Array], Testbed] | None = None
    base: float = 0.0
    signed: bool = False
    driver: str | None = None

    @property
    def kind(self) -> str:
        """What a diagnosis should call it: `parameter`, `effect` or `unknown`."""
        if self.effect is None:
            return "unknown"
        return "parameter" if self.alter is not None else "effect"
