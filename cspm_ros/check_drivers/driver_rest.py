"""Topics whose numbers are constant because the machine is at rest."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cspm_msgs_py.testbed import Testbed
from cspm_ros.check_drivers.driver_machine import BAR_POSE, FRAME_POSE, STRETCH, WINCHES
from cspm_ros.check_drivers.driver_observation import Finding, Heard

AT_REST = "constant, and no winch winds: the machine at rest, or is the sensor on?"


def constant_at_rest(testbed: Testbed, heard: Mapping[str, Heard]) -> frozenset[str]:
    """Return the topics of a machine at rest whose numbers are constant.

    At rest: no winch winds, and no body moves, by more than a cable stretches. Such topics serve to
    judge statics, which a sensor that stopped at another instant than the machine would not.

    Args:
        testbed: the machine.
        heard: what was heard, by topic, with finite numbers and increasing stamps.
    """
    winches = heard.get(WINCHES)
    angles = winches.part("position") if winches else None
    if angles is None:
        return frozenset()
    radii = np.array([cable.wound_radius for cable in testbed.cables])
    moved = [np.ptp(angles, axis=0) * radii]
    poses = [heard[name] for name in (BAR_POSE, FRAME_POSE) if name in heard]
    moved += [np.ptp(pose.values[:, :3], axis=0) for pose in poses]
    if np.concatenate(moved).max() > STRETCH:
        return frozenset()
    return frozenset(name for name, each in heard.items() if _constant(each))


def _constant(heard: Heard) -> bool:
    values = heard.values[:, heard.present]
    return bool((values == values[0]).all())


def said_at_rest(finding: Finding, resting: frozenset[str]) -> Finding:
    """Return the finding on a constant topic in the words of a machine at rest."""
    if finding.check != "changes" or finding.topic not in resting:
        return finding
    return Finding(finding.topic, finding.check, None, AT_REST)
