"""A cable's attachment point beside the place that the test-bed file says."""

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

_LENGTH = slice(CableSignal.LENGTH_BY_ATTACHMENT, CableSignal.LENGTH_BY_ATTACHMENT + 3)
_WRENCH = slice(EndSignal.WRENCH_BY_ATTACHMENT, EndSignal.WRENCH_BY_ATTACHMENT + 18)


def _alter(testbed: Testbed, element: int, values: Values) -> Testbed:
    place = testbed.cables[element].attachment
    if place is None:
        return testbed
    return altered_cable(testbed, element, attachment=shifted(place, values))


EFFECT = Effect(
    id="cable_attachment_offset",
    block=Block.CABLE,
    parameters=survey_parameters("attachment", "bar_ned"),
    physics=Physics(alter=_alter),
    signature=Signature(
        regression=Regression(Channel.TENSION, partial(pulling_columns, at=_LENGTH)),
        partners=(Regression(Channel.WRENCH, partial(wrench_columns, at=_WRENCH)),),
        negligible=healthy("xyz"),
    ),
    description=Description(
        noun="attachment point",
        equation="attachment point = attachment + (x, y, z) in bar_ned",
        shows=(
            "tension residual of one cable follows its direction in the bar; a moment on the bar"
        ),
        confounded_with=("pose_offset", "cable_exit_offset", "bar_com"),
        separating_experiment="turn the bar about all axes at one place, then translate it",
        reference="thesis (2-2); tolerances of a survey: docs/reference/accuracies.md",
    ),
)
