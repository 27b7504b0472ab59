"""A motion capture that measures another frame than the body's own."""

import numpy as np

from cspm_model.kinematics import rotation
from cspm_msgs_py.dofs import DOFS
from cspm_sim.effects.effect import (
    Array,
    Block,
    Channel,
    Description,
    Effect,
    EffectParameter,
    Elements,
    Physics,
    Regression,
    Sense,
    Signature,
)
from cspm_sim.effects.signals import PoseSignal


def _reading(values: Array, element: int, parameters: Array) -> Array:
    turned = rotation(values) @ rotation(parameters)
    read = np.empty(6)
    read[:3] = values[:3] + rotation(values) @ parameters[:3]
    pitch = np.arcsin(np.clip(-turned[2, 0], -1.0, 1.0))
    roll, yaw = np.arctan2(turned[2, 1], turned[2, 2]), np.arctan2(turned[1, 0], turned[0, 0])
    read[3:] = (roll, pitch, yaw)
    return read


def _columns(signals: Array) -> Array:
    """Return the first order of the offset."""
    from scipy.spatial.transform import Rotation

    angles = signals[:, PoseSignal.POSE + 3 : PoseSignal.POSE + 6]
    (sine, _, _), (cosine, level, _) = np.sin(angles).T, np.cos(angles).T
    steep = np.tan(angles[:, 1])
    out = np.zeros((len(signals), 6, 6))
    out[:, :3, :3] = Rotation.from_euler("ZYX", angles[:, ::-1]).as_matrix()
    # From ω in body axes to Euler rates.
    out[:, 3, 3], out[:, 3, 4], out[:, 3, 5] = 1.0, sine * steep, cosine * steep
    out[:, 4, 4], out[:, 4, 5] = cosine, -sine
    out[:, 5, 4], out[:, 5, 5] = sine / level, cosine / level
    return out


EFFECT = Effect(
    id="pose_offset",
    block=Block.SENSOR,
    parameters=tuple(
        EffectParameter(dof, "m" if i < 3 else "rad", -1.0, 1.0, usual=1e-3)
        for i, dof in enumerate(DOFS)
    ),
    elements=Elements.BODIES,
    physics=Physics(sense=Sense(("/{}/pose",), _reading)),
    signature=Signature(regression=Regression(Channel.READING, _columns)),
    description=Description(
        noun="an offset",
        equation="measured pose = pose, followed by the offset in the body's own axes",
        shows="cable length residuals in the pattern of one displacement that turns with the body",
        confounded_with=("frame_pose_offset", "bar_com", "cable_attachment_offset"),
        separating_experiment="turn the body about two axes: the offset turns with it",
        reference="marker frame against body frame, thesis (2-3), (2-4)",
    ),
)
