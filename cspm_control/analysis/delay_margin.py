"""How much later than sampled the commands to the drives may come."""

from __future__ import annotations

import math
from collections.abc import Iterable

from cspm_control.analysis.loop_view import LoopView
from cspm_control.analysis.loops import pid_law, sampled_force, sampled_motion
from cspm_control.analysis.sampled_loops import sensor_delays, timing_of
from cspm_control.safe_state import FREQUENCY
from cspm_control.stages.make import controlled_axes
from cspm_msgs_py.scenario import ClosedLoop, Scenario
from cspm_msgs_py.scenario_keys.drive import TENSION_DRIVE
from cspm_msgs_py.schedule import BAR_POSE, TENSION
from cspm_msgs_py.testbed import Testbed


def largest_age(scenario: Scenario, testbed: Testbed) -> float:
    """Return how old the state may be that a command answers [s]; infinite where no loop minds.

    For torques that is the load cells' delay and the least delay margin of the force loops, each
    the phase margin over the crossover as `cspm analyze design` finds them for sampled loops. Where
    the safe state is `hold`, its torques come the same way, and its own margin counts as well.
    Drives that take tensions close those loops themselves: there it is the pose's delay and the
    least delay margin of the motion loops.

    Args:
        scenario: resolved, with a closed loop.
        testbed: the machine.

    Raises:
        InputError: rates that the analysis cannot follow, or motion controllers without loops.
        ConvergenceError: the bar cannot hang at the design pose.
    """
    control, timing = scenario.control, timing_of(scenario, testbed, 0.0)
    assert isinstance(control, ClosedLoop)
    delays = sensor_delays(scenario, testbed)
    if scenario.drive == TENSION_DRIVE:
        motion = sampled_motion(testbed, pid_law(control), timing, controlled_axes(control))
        return delays.get(BAR_POSE, 0.0) + _least_margin(motion.values())
    least = _least_margin(sampled_force(testbed, control, timing).values())
    if scenario.safety.state == "hold":
        least = min(least, hold_margin())
    return delays.get(TENSION, 0.0) + least


def _least_margin(views: Iterable[LoopView]) -> float:
    """Return the least delay margin of some loops [s], 0 where one is not stable."""
    found = [each.margins for each in views if each.margins.crossover > 0.0]
    least = min((each.phase_margin / each.crossover for each in found), default=math.inf)
    return max(0.0, least)


def hold_margin() -> float:
    """Return how much later the torques of `hold` may come [s].

    Of a mass on its critically damped spring |L| = 1 at u = √(2 + √5) times its frequency, with the
    phase margin atan 2u. Half of it is left to elastic cables and other winches.
    """
    crossover = math.sqrt(2.0 + math.sqrt(5.0))
    return 0.5 * math.atan(2.0 * crossover) / (crossover * FREQUENCY)
