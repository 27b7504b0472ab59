"""The motions of a scenario: those that are prescribed, and the poses along them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cspm_control.waves.build import build_motion, check_attitude
from cspm_control.waves.operation import operated
from cspm_model.motion import Motion
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import ClosedLoop, Scenario
from cspm_msgs_py.scenario_keys.bodies import Body
from cspm_msgs_py.schedule import BAR_REFERENCE, FRAME_REFERENCE, TARGET_REFERENCE
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]

# How many poses along the reference are looked at: less than a second apart in the longest run.
REFERENCE_POSES = 301
FARTHEST = 3.0
"""How far from its winches a bar is to go, in sizes of the machine. Cables reach no farther than
one; with mm for m it is some hundred."""


def motions_of(scenario: Scenario, testbed: Testbed, folder: Path) -> dict[str, Motion]:
    """Return the motions of winch frame, moving or not, bar and target, by reference topic.

    The bar's is what it would be if the target were known exactly, operation included.
    """
    bar = scenario.target.model_copy(update={"mean_pose": scenario.bar_mean_pose})
    bodies: dict[str, Body] = {"/winch_frame/reference": scenario.winch_frame}
    if testbed.bar:
        bodies |= {BAR_REFERENCE: bar, TARGET_REFERENCE: scenario.target}
    motions = {
        name: build_motion(
            body.motion,
            body.mean_pose,
            seed=scenario.seed,
            duration=scenario.duration,
            gravity=testbed.gravity,
            folder=folder,
        )
        for name, body in bodies.items()
    }
    if scenario.operation and BAR_REFERENCE in motions:
        motions[BAR_REFERENCE] = operated(
            motions[BAR_REFERENCE], scenario.operation, scenario.duration
        )
        check_attitude(motions[BAR_REFERENCE])
    if testbed.bar and isinstance(scenario.control, ClosedLoop):
        _check_reach(motions, scenario, testbed)
    if testbed.winch_frame is None and motions["/winch_frame/reference"].knots.any():
        raise InputError("winch_frame: this test-bed has none, allowed: no motion and no mean pose")
    return motions


def _check_reach(motions: dict[str, Motion], scenario: Scenario, testbed: Testbed) -> None:
    """Check that the bar is to go where its cables could be.

    Raises:
        InputError: it is to be farther from its winches than three times the machine's size.
    """
    assert isinstance(scenario.control, ClosedLoop)
    points = [cable.exit for cable in testbed.cables if cable.exit is not None]
    box = np.array([*points, scenario.control.motion.design_pose[:3]])
    size, centre = float(np.linalg.norm(np.ptp(box, axis=0))), box.mean(axis=0)
    times = np.linspace(0.0, scenario.duration, REFERENCE_POSES)
    bar, frame = (
        np.array([motions[name].at(time)[:3] for time in times])
        for name in (BAR_REFERENCE, FRAME_REFERENCE)
    )
    apart = np.linalg.norm(bar - frame - centre, axis=1)
    if apart.max() > FARTHEST * size:
        at = int(np.argmax(apart))
        raise InputError(
            f"motions of target and winch_frame: the bar is to be {apart[at]:.4g} m from its"
            f" winches at {times[at]:.4g} s, allowed: {FARTHEST * size:.4g} m, three times the"
            " machine's size; positions are in m, were they mm?"
        )


def reference_poses(
    scenario: Scenario, testbed: Testbed, folder: Path | None
) -> tuple[Array, Array]:
    """Return poses of bar and winch frame along the reference and at the design pose, (k, 6) each.

    Without a `folder` for the motions' files those of the mean pose and the design pose.
    """
    assert isinstance(scenario.control, ClosedLoop)
    bars = [np.array(scenario.bar_mean_pose), np.array(scenario.control.motion.design_pose)]
    frames = [np.array(scenario.winch_frame.mean_pose), np.zeros(6)]
    if folder is not None:
        motions = motions_of(scenario, testbed, folder)
        times = np.linspace(0.0, scenario.duration, REFERENCE_POSES)
        bars += [motions[BAR_REFERENCE].at(time)[:6].copy() for time in times]
        frames += [motions[FRAME_REFERENCE].at(time)[:6].copy() for time in times]
    return np.array(bars), np.array(frames)
