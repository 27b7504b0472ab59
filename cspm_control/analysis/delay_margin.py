"""How much later than sampled the torques of the force loops may come."""

from __future__ import annotations

import math

from cspm_control.analysis.loops import sampled_force
from cspm_control.analysis.sampled_loops import sensor_delays, timing_of
from cspm_control.safe_state import FREQUENCY
from cspm_msgs_py.scenario import ClosedLoop, Scenario
from cspm_msgs_py.schedule import TENSION
from cspm_msgs_py.testbed import Testbed


def largest_age(scenario: Scenario, testbed: Testbed) -> float:
    """Return how old the tensions may be that a torque answers [s]; infinite where no loop minds.

    That is the load cells' delay and the least delay margin of the force loops, each the phase
    margin over the crossover as `cspm analyze design` finds them for sampled loops. Where the safe
    state is `hold`, its torques come the same way, and its own margin counts as well.

    Args:
        scenario: resolved, with a closed loop.
        testbed: the machine.

    Raises:
        InputError: rates that the analysis cannot follow.
        ConvergenceError: the bar cannot hang at the design pose.
    """
    assert isinstance(scenario.control, ClosedLoop)
    views = sampled_force(testbed, scenario.control, timing_of(scenario, testbed, 0.0))
    found = [each.margins for each in views.values() if each.margins.crossover > 0.0]
    least = min((each.phase_margin / each.crossover for each in found), default=math.inf)
    if scenario.safety.state == "hold":
        least = min(least, hold_margin())
    return sensor_delays(scenario, testbed).get(TENSION, 0.0) + max(0.0, least)


def hold_margin() -> float:
    """Return how much later the torques of `hold` may come [s].

    Of a mass on its critically damped spring |L| = 1 at u = √(2 + √5) times its frequency, with the
    phase margin atan 2u. Half of it is left to elastic cables and other winches.
    """
    crossover = math.sqrt(2.0 + math.sqrt(5.0))
    return 0.5 * math.atan(2.0 * crossover) / (crossover * FREQUENCY)
