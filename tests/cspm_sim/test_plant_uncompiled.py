"""The kernels as plain Python: the same numbers, so that coverage and debuggers see them."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
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
SCRIPT = """
import json, sys
sys.path[:0] = ["tests/support", "tests/cspm_sim"]
from test_plant_uncompiled import trajectory
print(json.dumps(trajectory().tolist()))
"""


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


@pytest.mark.slow
def test_uncompiled_kernels_give_the_same_trajectory():
    run = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        cwd=Path(__file__).resolve().parents[2],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    plain, compiled = np.array(json.loads(run.stdout)), trajectory()
    assert compiled[-8:].min() == 0.0
    assert compiled[-8:].max() > 1.0
    assert plain == pytest.approx(compiled, rel=1e-9, abs=1e-10)
