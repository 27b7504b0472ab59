"""What a run leaves uncontrolled, and what its reference needs of its machine."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_control.analysis.reference_demand import (
    ReferenceDemand,
    first_unmet,
    reference_demand,
)
from cspm_control.stages.make import governed, wanted_tension_limits
from cspm_model.motion import Motion
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import ClosedLoop
from cspm_msgs_py.schedule import BAR_REFERENCE, FRAME_REFERENCE
from cspm_run.bundle import Bundle
from cspm_run.controlled_dofs import left_free
from cspm_run.motions import REFERENCE_POSES, motions_of, reference_poses

# A fortieth of the fastest wave's period; no more instants than these, so that it takes moments.
SPACING = 0.02
MOST = 3000
# A motion whose last speed is less than this share of its largest ends at rest; one slower than
# this [m/s, rad/s] is none.
NO_SPEED, LEAST_SPEED = 0.01, 1e-6


def free_of(bundle: Bundle) -> list[str]:
    """Return a line per kind of coordinate that a resolved run leaves free, and why."""
    scenario, testbed = bundle.scenario, bundle.testbed.testbed
    if not isinstance(scenario.control, ClosedLoop) or testbed.bar is None:
        return []
    with bundle.unpacked() as folder:
        poses = reference_poses(scenario, testbed, folder)
    return left_free(scenario.control, testbed, poses)


def demanded(bundle: Bundle) -> tuple[NDArray[np.float64], ReferenceDemand]:
    """Return tension limits (n, 2) [N] and what the reference needs.

    Raises:
        InputError: no bar follows a reference.
    """
    scenario, testbed = bundle.scenario, bundle.testbed.testbed
    if not isinstance(scenario.control, ClosedLoop) or testbed.bar is None:
        raise InputError(
            f"{scenario.name}: no bar follows a reference, allowed: control.mode closed_loop and a"
            " test-bed with a bar"
        )
    limits, motions = _given(bundle)
    duration = scenario.duration
    found = reference_demand(
        governed(scenario, testbed, limits),
        motions[BAR_REFERENCE],
        motions[FRAME_REFERENCE],
        duration,
        max(SPACING, duration / MOST),
    )
    return limits, found


def unmet_line(bundle: Bundle) -> str | None:
    """Return a line on where the reference asks for what no tensions give; None where nowhere."""
    scenario, testbed = bundle.scenario, bundle.testbed.testbed
    if not isinstance(scenario.control, ClosedLoop) or testbed.bar is None:
        return None
    limits, motions = _given(bundle)
    first = first_unmet(
        governed(scenario, testbed, limits),
        motions[BAR_REFERENCE],
        motions[FRAME_REFERENCE],
        scenario.duration,
        REFERENCE_POSES,
    )
    if first is None:
        return None
    return (
        f"reference infeasible within the tension limits, as at {first:.4g} s;"
        " cspm analyze reference shows where"
    )


def stopping_lines(bundle: Bundle) -> list[str]:
    """Return a line per body whose motion ends before the run, though the body still moves."""
    scenario, testbed = bundle.scenario, bundle.testbed.testbed
    with bundle.unpacked() as folder:
        motions = motions_of(scenario, testbed, folder)
    named = {"winch_frame": motions[FRAME_REFERENCE], "target": motions.get(BAR_REFERENCE)}
    return [
        f"{name}.motion ends at {motion.duration:.4g} s with {left} and stands still from there"
        " on, which is a jerk; end it with rows at rest"
        for name, motion in named.items()
        if motion is not None
        and motion.duration < scenario.duration
        and (left := _speed_left(motion)) is not None
    ]


def _speed_left(motion: Motion) -> str | None:
    """Return the speed at a motion's end, of the DOF whose share of its largest is largest."""
    if motion.periodic:
        return None
    speeds = np.abs(motion.knots[:, 6:12])
    shares = speeds[-1] / np.maximum(speeds.max(axis=0), LEAST_SPEED)
    most = int(np.argmax(shares))
    if shares[most] < NO_SPEED:
        return None
    return f"{speeds[-1, most]:.3g} {'m/s' if most < 3 else 'rad/s'} in {DOFS[most]}"


def _given(bundle: Bundle) -> tuple[NDArray[np.float64], dict[str, Motion]]:
    """Return tension limits (n, 2) [N] and the motions."""
    assert isinstance(bundle.scenario.control, ClosedLoop)
    testbed = bundle.testbed.testbed
    with bundle.unpacked() as folder:
        motions = motions_of(bundle.scenario, testbed, folder)
    return wanted_tension_limits(bundle.scenario.control, testbed), motions
