"""A winch frame that is beside where its sensor says."""

import numpy as np

from cspm_model.kinematics import rotation
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.testbed import Testbed
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
    """Move all exits: the frame's own pose remains what its sensor measures."""
    pose = [values[dof] for dof in DOFS]
    for i, cable in enumerate(testbed.cables):
        if cable.exit is not None:
            moved = np.array(pose[:3]) + rotation(pose) @ np.array(cable.exit)
            testbed = altered_cable(testbed, i, exit=moved.tolist())
    return testbed


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
        confounded_with=("pose_offset", "frame_flexibility", "cable_exit_offset"),
        separating_experiment="hold the bar at several poses, then turn the winch frame and repeat",
        reference="thesis (2-2): exits p_a + R_a·a",
    ),
)
