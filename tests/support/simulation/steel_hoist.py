"""A load on three geared winches with steel cable, whose resonance is little damped."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from cspm_msgs_py.testbed import Testbed, parse_testbed

MIDDLE = [0.0, 0.0, -0.9, 0.0, 0.0, 0.0]
MASS, DRUM, GEAR, ROTOR = 8.0, 0.03, 10.0, 8.0e-5


def hoist_content(diameter: float) -> dict[str, Any]:
    """Return the test-bed file's content, with cables of a diameter [m]."""
    corners = [1.5 * np.array([np.cos(a), np.sin(a)]) for a in 2.0 * np.pi / 3.0 * np.arange(3)]
    return {
        "name": "steel_hoist",
        "bar": {
            "mass": MASS,
            "inertia": {"ixx": 0.02, "iyy": 0.02, "izz": 0.02},
            "dimensions": [0.15, 0.15, 0.15],
        },
        "cables": [
            {
                "name": f"h{i + 1}",
                "exit": [float(x), float(y), -2.5],
                "attachment": [0.0, 0.0, 0.0],
                "offset_length": 0.5,
                "stiffness": {
                    "law": "linear",
                    "youngs_modulus": 6.0e10,
                    "diameter": diameter,
                    "floor_tension": 0.05,
                },
                "damping": {"constant": 80.0},
                "drum_radius": DRUM,
                "gear_ratio": GEAR,
                "rotor_inertia": ROTOR,
                "torque_limit": 2.0,
                "tension_limits": [3, 200],
            }
            for i, (x, y) in enumerate(corners)
        ],
        "sensors": {
            "/bar/pose": {"noise": [1e-4, 2e-4], "resolution": [0.0, 0.0], "rate": 100},
            "/winches/state": {
                "noise": [0.0, 0.01, 4.5e-4],
                "resolution": [1.5e-3, 0.0, 0.0],
                "rate": 1000,
            },
            "/cables/tension": {"noise": 0.1, "resolution": 0.0, "rate": 1000},
        },
        "effects": [{"effect": "winch_coulomb_friction", "parameters": {"torque": 0.015}}],
    }


def hoist(diameter: float) -> Testbed:
    """Return the machine with cables of a diameter [m]."""
    return parse_testbed(json.dumps(hoist_content(diameter)), "steel_hoist").testbed


def hoist_scenario() -> dict[str, Any]:
    """Return a scenario file's content: a circle, and nothing said of gains."""
    return {
        "name": "steel_hoist",
        "testbed": "steel_hoist.yaml",
        "duration": 4,
        "target": {
            "mean_pose": MIDDLE,
            "motion": {"type": "circle", "radius": 0.2, "period": 5},
        },
        "control": {"mode": "closed_loop", "motion": {"law": "pid", "design_pose": MIDDLE}},
    }
