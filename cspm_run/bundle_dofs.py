"""What a run leaves uncontrolled."""

from __future__ import annotations

from cspm_msgs_py.scenario import ClosedLoop
from cspm_run.bundle import Bundle
from cspm_run.controlled_dofs import left_free
from cspm_run.motions import reference_poses


def free_of(bundle: Bundle) -> list[str]:
    """Return a line per kind of coordinate that a resolved run leaves free, and why."""
    scenario, testbed = bundle.scenario, bundle.testbed.testbed
    if not isinstance(scenario.control, ClosedLoop) or testbed.bar is None:
        return []
    with bundle.unpacked() as folder:
        poses = reference_poses(scenario, testbed, folder)
    return left_free(scenario.control, testbed, poses)
