"""A winch frame that is beside where its sensor says."""

from collections.abc import Sequence

import numpy as np

from cspm_model.kinematics import rotation
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.testbed import Cable, Testbed
from cspm_sim.effects.alteration import altered_cable
from cspm_sim.effects.effect import (
    Array,
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
from cspm_sim.effects.signals import FrameSignal
from cspm_sim.effects.survey import ACCURACY, healthy


def _alter(testbed: Testbed, element: int, values: Values) -> Testbed:
    """Move what is on the frame: its own pose remains what its sensor measures."""
    pose = np.array([values[dof] for dof in DOFS])
    for i, cable in enumerate(testbed.cables):
        if cable.exit is not None:
            testbed = altered_cable(testbed, i, **_moved(cable, pose))
    return testbed


def _moved(cable: Cable, pose: Array) -> dict[str, object]:
    """Return what of a cable goes with the frame: its exit, stops of its route, and pulley axes."""
    turn = rotation(pose)

    def there(place: Sequence[float]) -> list[float]:
        return [float(x) for x in pose[:3] + turn @ np.array(place)]

    def along(axis: Sequence[float]) -> list[float]:
        return [float(x) for x in turn @ np.array(axis)]

    changes: dict[str, object] = {"exit": there(cable.exit or ())}
    if cable.pulley:
        changes["pulley"] = {"radius": cable.pulley.radius, "axis": along(cable.pulley.axis)}
    if cable.route:
        changes["route"] = [
            {
                **stop.model_dump(),
                **({"at": there(stop.at)} if stop.on == "frame" else {}),
                **({"axis": along(stop.axis)} if stop.axis else {}),
            }
            for stop in cable.route
        ]
    return changes


def _columns(signals: Array) -> Array:
    """Return the first order of the offset."""
    place = signals[:, FrameSignal.EXIT : FrameSignal.EXIT + 3]
    turn = signals[:, FrameSignal.ROTATION : FrameSignal.ROTATION + 9].reshape(-1, 3, 3)
    direction = signals[:, FrameSignal.DIRECTION : FrameSignal.DIRECTION + 3]
    pull = np.einsum("kji,kj->ki", turn, direction) * -signals[:, FrameSignal.STIFFNESS, None]
    # u·(e × a) = e·(a × u)
    return np.hstack([pull, np.cross(place, pull)])[:, None]


EFFECT = Effect(
    id="frame_pose_offset",
    block=Block.FRAME,
    parameters=tuple(
        EffectParameter(dof, "m" if i < 3 else "rad", -1.0, 1.0, usual=ACCURACY)
        for i, dof in enumerate(DOFS)
    ),
    physics=Physics(alter=_alter),
    signature=Signature(regression=Regression(Channel.TENSION, _columns), negligible=healthy(DOFS)),
    description=Description(
        noun="place relative to its markers",
        equation=(
            "true pose of the winch frame = measured pose, followed by the offset in its own axes"
        ),
        shows=(
            "cable length residuals of all cables at once, in the pattern of one small displacement"
        ),
        confounded_with=(
            "pose_offset",
            "frame_flexibility",
            "cable_exit_offset",
            "pulley_radius",
        ),
        separating_experiment="hold the bar at several poses, then turn the winch frame and repeat",
        reference="thesis (2-2): exits p_a + R_a·a",
    ),
)
