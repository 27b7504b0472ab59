"""A trajectory of the plant, with compiled kernels or without."""

import numpy as np
from machines import build, general_content

from cspm_model.kernels.cable import RADIUS
from cspm_model.motion import Motion
from cspm_sim.plant import Plant

EFFECTS = [
    {"effect": "winch_viscous_friction", "parameters": {"coefficient": 0.002}},
    {"effect": "winch_coulomb_friction", "elements": ["c1"], "parameters": {"torque": 0.05}},
    {
        "effect": "bar_linear_damping",
        "parameters": {
            **dict.fromkeys(("surge", "sway", "heave"), 2.0),
            **dict.fromkeys(("roll", "pitch", "yaw"), 0.1),
        },
    },
]


def trajectory():
    """40 steps with a moving frame, effects, slack and taut cables, and a start with a kick."""
    knots = np.random.default_rng(2).normal(size=(4, 18)) * 0.002
    testbed = build({**general_content(), "effects": EFFECTS})
    pose = [0.01, 0.02, 2.0, 0.0, 0.03, -0.03]
    plant = Plant(
        testbed, Motion(np.vstack([0 * knots[:1], knots]), 0.01), 1_000_000, bar_pose=pose
    )
    plant.bar_state[6:] = [0.02, -0.02, 0.05, 0.1, -0.1, 0.1]
    plant.unstretched_lengths[3] += 0.1
    torque = plant.parameters.cables[:, RADIUS] * plant.tensions
    for _ in range(40):
        plant.step(torque)
    return np.concatenate([plant.state, plant.tensions])
