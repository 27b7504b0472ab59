"""How far from the design pose gains that stay fixed keep all loops stable together."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from cspm_control.analysis.pose_grid import Grid
from cspm_control.analysis.workspace_limits import limits
from cspm_msgs_py.scenario import ClosedLoop, MotionControl, Scenario
from cspm_msgs_py.testbed import Testbed
from cspm_run.stability.loop_growth import loop_growth

# Values of a grid that are tried: every so-manieth.
COARSE = 4


def stable_limits(
    scenario: Scenario, testbed: Testbed, grid: Grid, pose: Sequence[float]
) -> dict[str, float | None]:
    """Return the last value of each DOF up to which the loops are stable [m, rad].

    As `workspace_limits.limits`: each DOF alone, from zero on. None for all where the loops cannot
    be followed, see `loop_growth`.

    Args:
        scenario: with all gains, which stay what they are.
        testbed: the machine.
        grid: whose values are tried, every fourth.
        pose: of the bar; its other DOFs stay.
    """

    def holds(line: Grid) -> NDArray[np.bool_]:
        stable = np.zeros(line.size, dtype=np.bool_)
        for i, (x, y, z, pitch, yaw) in enumerate(product(*line)):
            stable[i] = _is_stable(scenario, testbed, (x, y, z, float(pose[3]), pitch, yaw))
            if not stable[i]:
                break
        return stable

    return limits(holds, grid.every(COARSE), pose)


def _is_stable(scenario: Scenario, testbed: Testbed, pose: tuple[float, ...]) -> bool:
    """Return whether the loops are known to be stable with the bar at rest at a pose."""
    control = scenario.control
    if not isinstance(control, ClosedLoop) or not isinstance(control.motion, MotionControl):
        return False
    there = tuple(float(value) for value in pose)
    motion = control.motion.model_copy(update={"design_pose": there})
    moved = control.model_copy(update={"motion": motion})
    found = loop_growth(scenario.model_copy(update={"control": moved}), testbed)
    return found is not None and not found.unstable
