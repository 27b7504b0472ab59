"""A pulley at a cable's exit that the test-bed file does not have, or has smaller."""

from functools import partial

from cspm_model.pulley_slopes import UPWARDS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed
from cspm_sim.effects.alteration import altered_cable
from cspm_sim.effects.effect import (
    Block,
    Channel,
    Description,
    Effect,
    EffectParameter,
    Physics,
    Regression,
    Signature,
    Values,
)
from cspm_sim.effects.signals import CableSignal, EndSignal
from cspm_sim.effects.survey import pulling_columns, wrench_columns

_LENGTH = slice(CableSignal.LENGTH_BY_PULLEY, CableSignal.LENGTH_BY_PULLEY + 1)
_WRENCH = slice(EndSignal.WRENCH_BY_PULLEY, EndSignal.WRENCH_BY_PULLEY + 6)


def _alter(testbed: Testbed, element: int, values: Values) -> Testbed:
    cable = testbed.cables[element]
    if cable.exit is None or values["radius"] == 0.0:
        return testbed
    if cable.route or cable.parts > 1:
        kind = "a route" if cable.route else f"{cable.parts} parts"
        raise InputError(
            f"pulley_radius: {cable.name} has {kind}, allowed: cables of one part without a route"
        )
    before = cable.pulley
    pulley = {
        "radius": values["radius"] + (before.radius if before else 0.0),
        "axis": before.axis if before else UPWARDS,
    }
    return altered_cable(testbed, element, pulley=pulley)


EFFECT = Effect(
    id="pulley_radius",
    block=Block.CABLE,
    parameters=(
        EffectParameter("radius", "m", 0.0, 0.3, meaning="added to pulley.radius, or to 0"),
    ),
    physics=Physics(alter=_alter),
    signature=Signature(
        regression=Regression(Channel.TENSION, partial(pulling_columns, at=_LENGTH)),
        partners=(Regression(Channel.WRENCH, partial(wrench_columns, at=_WRENCH)),),
    ),
    description=Description(
        noun="pulley radius at the exit",
        equation=(
            "the cable winds around a pulley of radius pulley.radius + radius by the angle φ from"
            " pulley.axis, upwards without one, to its direction: ∂length/∂radius = φ − sin φ"
        ),
        shows="tension residual of one cable follows the angle between its direction and upwards",
        confounded_with=("cable_exit_offset", "frame_pose_offset"),
        separating_experiment=(
            "take the bar from far below the exits to their height: the cables' angles change"
        ),
        reference="Pott, Cable-Driven Parallel Robots, 2018, section 4.5",
    ),
)
