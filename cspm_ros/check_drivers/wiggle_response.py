"""What a wiggle of each winch shows: order, sign and unit of torques, tensions, angles and poses.

A winch that is wound in differs from the same winch paid out. Each load cell must show the
differences of its own winch's torque, and each cable's length between the measured poses those of
its own winch's angle.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from cspm_model.kinematics import geometry
from cspm_msgs_py.errors import SingularityError
from cspm_msgs_py.testbed import Testbed
from cspm_ros.check_drivers.driver_geometry import pose_of
from cspm_ros.check_drivers.driver_machine import (
    BAR_POSE,
    FRAME_POSE,
    LENGTH_TOLERANCE,
    TENSION,
    TORQUE_TOLERANCE,
    WINCHES,
)
from cspm_ros.check_drivers.driver_observation import Array, Finding
from cspm_ros.check_drivers.driver_relation import (
    ANGLE_UNITS,
    CLEAR,
    LENGTH_UNITS,
    TENSION_UNITS,
    Verdict,
    grouped,
    relate,
    verdict_on,
)
from cspm_ros.check_drivers.winch_wiggle import Plateau
from cspm_sim.parameters import plant_parameters

TORQUES = "torques"
UNANSWERED = "does not answer the wiggle: is the angle in another unit, or is the drive braked?"
# What noise a mean over a plateau may keep where no test-bed says it.
TENSION_NOISE, LENGTH_NOISE = 0.01, 2e-5  # N, m
# By topic, and `TORQUES` for what was commanded: the mean row over a plateau.
Means = Mapping[str, Array]
# From a cable's name, what was given it, what was found, all names and all that was given.
Judge = Callable[[str, Array, Array, Sequence[str], Array], Verdict]


def judge_wiggle(testbed: Testbed, plateaus: Mapping[Plateau, Means]) -> list[Finding]:
    """Judge what was measured while each winch was wound in and paid out.

    Args:
        testbed: the machine.
        plateaus: both of each winch.
    """
    radii = np.array([cable.wound_radius for cable in testbed.cables])
    names = testbed.cable_names
    shown = [(plateaus[Plateau(i, 1.0)], plateaus[Plateau(i, -1.0)]) for i in range(len(names))]
    findings = []
    if all(TENSION in each for pair in shown for each in pair):
        pulled = _differences(shown, TORQUES) / radii
        verdicts = _by_cable(names, pulled, _differences(shown, TENSION), _tension_verdict)
        findings += grouped(TENSION, "wiggle", verdicts)
    needed = {WINCHES, BAR_POSE} | ({FRAME_POSE} if testbed.winch_frame is not None else set())
    if testbed.bar is not None and all(needed <= each.keys() for pair in shown for each in pair):
        findings += _judge_lengths(testbed, shown, radii)
    return findings


def _differences(shown: Sequence[tuple[Means, Means]], topic: str) -> Array:
    """Return what differs between wound in and paid out, a row per winch that was wiggled."""
    return np.array([wound[topic] - paid[topic] for wound, paid in shown])


def _by_cable(names: Sequence[str], given: Array, found: Array, judge: Judge) -> dict[str, Verdict]:
    return {
        name: judge(name, given[:, i], found[:, i], names, given) for i, name in enumerate(names)
    }


def _tension_verdict(
    name: str, given: Array, found: Array, names: Sequence[str], all_given: Array
) -> Verdict:
    what = "the tension of its winch's torque in the wiggle"
    relation = relate(given, found, TENSION_NOISE, TENSION_NOISE)
    hint = _other(name, found, names, all_given)
    ok, text = verdict_on(relation, TENSION_UNITS, what, hint, TORQUE_TOLERANCE)
    return (False, UNANSWERED) if ok is None else (ok, text)


def _other(name: str, found: Array, names: Sequence[str], all_given: Array) -> str:
    """Return whose differences these are in truth, as a hint; empty where they are nobody's."""
    size = float(np.linalg.norm(found))
    if not size:
        return ": it does not change"
    match = found @ all_given / (size * np.maximum(np.linalg.norm(all_given, axis=0), 1e-300))
    best = int(np.argmax(np.abs(match)))
    return f": that of {names[best]}, are they swapped?" if names[best] != name else ""


def _judge_lengths(
    testbed: Testbed, shown: Sequence[tuple[Means, Means]], radii: Array
) -> list[Finding]:
    try:
        cables = plant_parameters(testbed).cables
        lengths = np.array([[_lengths(cables, each) for each in pair] for pair in shown])
    except SingularityError as err:
        return [Finding(BAR_POSE, "wiggle", False, f"impossible pose: {err}")]
    count = len(radii)
    unwound = -radii * _differences(shown, WINCHES)[:, :count]
    moved = lengths[:, 0] - lengths[:, 1]
    if float(np.sqrt(np.mean(moved**2))) <= CLEAR * LENGTH_NOISE:
        text = "cannot decide from the wiggle: the bar did not move, is it clamped?"
        return [Finding(BAR_POSE, "wiggle", None, text)]
    verdicts = _by_cable(testbed.cable_names, unwound, moved, _length_verdict)
    return grouped(BAR_POSE, "wiggle", verdicts)


def _length_verdict(
    name: str, unwound: Array, moved: Array, names: Sequence[str], all_unwound: Array
) -> Verdict:
    what = "the length that its winch unwound in the wiggle"
    relation = relate(unwound, moved, LENGTH_NOISE, LENGTH_NOISE)
    units = {1.0 / factor: text for factor, text in ANGLE_UNITS.items()} | LENGTH_UNITS
    other = _other(name, moved, names, all_unwound) or ": nobody's"
    hint = f"{other} or are poses turned or mirrored?"
    return verdict_on(relation, units, what, hint, LENGTH_TOLERANCE)


def _lengths(cables: Array, means: Means) -> Array:
    frame = pose_of(means[FRAME_POSE]) if FRAME_POSE in means else np.zeros(6)
    return geometry(cables, pose_of(means[BAR_POSE]), frame).lengths
