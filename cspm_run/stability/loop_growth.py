"""Whether a scenario's closed loops are stable about rest, as `cspm analyze design` has it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple

from cspm_control.analysis.loops import cascade_growth
from cspm_control.analysis.sampled_loops import LoopTiming, timing_of
from cspm_msgs_py.errors import CspmError
from cspm_msgs_py.scenario import ClosedLoop, MotionControl, Scenario
from cspm_msgs_py.scenario_keys.drive import TENSION_DRIVE
from cspm_msgs_py.schedule import FORCE_CONTROLLER, MOTION_CONTROLLER, TENSION_DISTRIBUTION
from cspm_msgs_py.testbed import Testbed

# Negative damping below this share of the critical one is not told from none: the model leaves out
# the air and the cables' transverse motion, which take more.
LEAST_DAMPING = 1e-3
# Machines and controllers whose growth is kept: runs that differ in their seeds share it.
_KEPT = 64


class Growth(NamedTuple):
    """How the slowest or growing motion changes with all loops closed.

    Attributes:
        rate: Re λ [1/s].
        frequency: Im λ [rad/s].
    """

    rate: float
    frequency: float

    @property
    def unstable(self) -> bool:
        """Whether it grows, by more than what the model leaves out may take."""
        return self.rate > LEAST_DAMPING * abs(complex(self.rate, self.frequency))


@dataclass(frozen=True)
class _Question:
    """What the growth depends on; equal where its text is."""

    text: str
    control: ClosedLoop = field(compare=False)
    timing: LoopTiming = field(compare=False)
    testbed: Testbed = field(compare=False)


def period_of_force(scenario: Scenario) -> float:
    """Return the period of the force controllers [s], by which torques are late in real time.

    Those of drives that close the loop themselves are not late.
    """
    return 0.0 if scenario.drive == TENSION_DRIVE else 1.0 / scenario.rates.force_controller


def loop_growth(scenario: Scenario, testbed: Testbed, computing: float = 0.0) -> Growth | None:
    """Return the growth about the design pose; None where the loops cannot be followed.

    Those of the user's own controllers and of other laws than `pid` cannot, nor those at a pose
    where the bar cannot hang.

    Args:
        scenario: with all gains.
        testbed: the machine.
        computing: from a measurement to its torque [s].
    """
    control = scenario.control
    if not isinstance(control, ClosedLoop) or testbed.bar is None:
        return None
    own = {MOTION_CONTROLLER, TENSION_DISTRIBUTION, FORCE_CONTROLLER} & set(scenario.controllers)
    if own or not isinstance(control.motion, MotionControl):
        return None
    try:
        timing = timing_of(scenario, testbed, computing)
        text = "\n".join([control.model_dump_json(), testbed.model_dump_json(), repr(timing)])
        return _growth(_Question(text, control, timing, testbed))
    except CspmError:
        return None


@lru_cache(maxsize=_KEPT)
def _growth(question: _Question) -> Growth:
    return Growth(*cascade_growth(question.testbed, question.control, question.timing))
