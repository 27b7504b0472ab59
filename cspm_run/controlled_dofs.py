"""Which of the bar's coordinates are controlled: found from the machine, or as a scenario says."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_control.design.gains import MOTION_BANDWIDTH
from cspm_model.parameters import nominal_parameters
from cspm_model.spanned_axes import LEAST_SHARE, share_of, spanned_axes, structures_at
from cspm_msgs_py.dofs import DOFS, Dof
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import ClosedLoop, ComputedWrenchControl, FeedbackControl, Scenario
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]
Poses = tuple[Array, Array]

# Bandwidth [rad/s] of a DOF under computed wrench of which the scenario says nothing.
USUAL_BANDWIDTH = 20.0


def with_controlled_dofs(scenario: Scenario, testbed: Testbed, poses: Poses) -> ClosedLoop:
    """Return the closed loop with its DOFs and the axes of its wrench written out.

    Args:
        scenario: in closed loop.
        testbed: a machine with a bar.
        poses: of bar and winch frame along the reference, (k, 6) each.

    Raises:
        InputError: a DOF is to be controlled that the cables do not give.
    """
    control = scenario.control
    assert isinstance(control, ClosedLoop)
    motion = control.motion
    structures = structures_at(nominal_parameters(testbed), *poses)
    wanted = [DOFS.index(dof) for dof in motion.dofs or ()]
    axes = spanned_axes(structures, wanted)
    lacking = [axis for axis in wanted if axis not in axes]
    if lacking:
        possible = ", ".join(DOFS[axis] for axis in spanned_axes(structures))
        raise InputError(
            f"control.motion.dofs: {DOFS[lacking[0]]}, {_why(structures, lacking[0], axes)},"
            f" allowed on {testbed.name} along this reference: {possible}"
        )
    dofs = tuple(dof for i, dof in enumerate(DOFS) if i in (wanted or axes))
    changes: dict[str, object] = {"dofs": dofs}
    if isinstance(motion, ComputedWrenchControl):
        changes["bandwidth"] = {dof: motion.bandwidth.get(dof, USUAL_BANDWIDTH) for dof in dofs}
    elif isinstance(motion, FeedbackControl):
        changes["bandwidth"] = {dof: motion.bandwidth.get(dof, MOTION_BANDWIDTH) for dof in dofs}
    how = control.tension_distribution
    return control.model_copy(
        update={
            "motion": motion.model_copy(update=changes),
            "tension_distribution": how.model_copy(update={"axes": _names(axes)}),
        }
    )


def controlled_dofs(scenario: Scenario) -> tuple[Dof, ...]:
    """Return the DOFs in which a resolved scenario has its bar follow the reference."""
    control = scenario.control
    return control.motion.controlled if isinstance(control, ClosedLoop) else ()


def left_free(control: ClosedLoop, testbed: Testbed, poses: Poses) -> list[str]:
    """Return a line per kind of coordinate that a resolved closed loop leaves free, and why.

    `poses` are as above.
    """
    structures = structures_at(nominal_parameters(testbed), *poses)
    axes = [DOFS.index(dof) for dof in control.tension_distribution.axes or DOFS]
    reasons: dict[str, list[str]] = {}
    for axis, dof in enumerate(DOFS):
        if axis not in axes:
            reasons.setdefault(_why(structures, axis, axes), []).append(dof)
    lines = [f"not controllable: {', '.join(dofs)}: {why}" for why, dofs in reasons.items()]
    left = [dof for dof in _names(axes) if dof not in control.motion.controlled]
    if left:
        lines.append(f"left free: {', '.join(left)}: controllable, but not in control.motion.dofs")
    return lines


def _why(structures: Array, axis: int, axes: Sequence[int]) -> str:
    """Return why an axis is not among those that the cables give."""
    if share_of(structures, axis, ()) < LEAST_SHARE:
        return "somewhere along the reference no cable gives a force or moment there"
    count = len(axes)
    return f"the cables span {count} of 6 directions, and what they give there follows from those"


def _names(axes: Sequence[int]) -> tuple[Dof, ...]:
    return tuple(DOFS[axis] for axis in axes)
