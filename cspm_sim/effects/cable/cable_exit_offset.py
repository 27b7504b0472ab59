"""A cable's exit point beside the place that the test-bed file says."""

from functools import partial

from cspm_msgs_py.testbed import Testbed
from cspm_sim.effects.alteration import altered_cable
from cspm_sim.effects.effect import (
    Block,
    Channel,
    Description,
    Effect,
    Physics,
    Regression,
    Signature,
    Values,
)
from cspm_sim.effects.signals import CableSignal, EndSignal
from cspm_sim.effects.survey import (
    healthy,
    pulling_columns,
    shifted,
    survey_parameters,
    wrench_columns,
)

_LENGTH = slice(CableSignal.LENGTH_BY_EXIT, CableSignal.LENGTH_BY_EXIT + 3)
_WRENCH = slice(EndSignal.WRENCH_BY_EXIT, EndSignal.WRENCH_BY_EXIT + 18)


def _alter(testbed: Testbed, element: int, values: Values) -> Testbed:
    place = testbed.cables[element].exit
    if place is None:
        return testbed
    return altered_cable(testbed, element, exit=shifted(place, values))


EFFECT = Effect(
    id="cable_exit_offset",
    block=Block.CABLE,
    parameters=survey_parameters("exit", "winch_frame_ned"),
    physics=Physics(alter=_alter),
    signature=Signature(
        regression=Regression(Channel.TENSION, partial(pulling_columns, at=_LENGTH)),
        partners=(Regression(Channel.WRENCH, partial(wrench_columns, at=_WRENCH)),),
        negligible=healthy("xyz"),
    ),
    description=Description(
        noun="exit point",
        equation="exit point = exit + (x, y, z) in winch_frame_ned",
        shows=(
            "tension residual of one cable follows its direction, so the poses of bar and frame"
        ),
        confounded_with=(
            "frame_pose_offset",
            "cable_attachment_offset",
            "cable_stiffness",
            "pulley_radius",
        ),
        separating_experiment=(
            "move the bar through the workspace along all axes, translations and rotations apart"
        ),
        reference="thesis (2-2); tolerances of a survey: docs/reference/accuracies.md",
    ),
)
