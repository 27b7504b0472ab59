"""Machines drawn at random: a body of 0.1 to 500 kg on 3 to 9 cables."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_model.linearisation import operating_point
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import CspmError
from cspm_msgs_py.testbed import parse_testbed

Array = NDArray[np.float64]

GRAVITY = 9.81
# E [Pa] and the stress [Pa] at the highest tension of ropes that are sold: polyamide, aramid,
# high-modulus polyethylene, steel.
ROPES = ((2.0e9, 1.0e8), (7.0e10, 4.0e8), (9.0e10, 4.0e8), (1.0e11, 3.0e8), (2.0e11, 3.0e8))
THINNEST = 0.6e-3
DURATION, PERIOD = 4.0, 6.0


class DrawnMachine(NamedTuple):
    """A machine and a scenario that names no gain: the files' contents, and its size [m]."""

    testbed: dict[str, Any]
    scenario: dict[str, Any]
    size: float

    def save(self, folder: Path) -> Path:
        """Write both files, and return the path of the scenario's."""
        name = self.testbed["name"]
        (folder / f"{name}_testbed.yaml").write_text(json.dumps(self.testbed), encoding="utf-8")
        path = folder / f"{name}.yaml"
        path.write_text(json.dumps(self.scenario), encoding="utf-8")
        return path


def drawn_machine(seed: int) -> DrawnMachine:
    """Return the machine of a seed: geometry, gears, ropes, pulleys and parts are all drawn.

    It is drawn again until its cables hold the body in the middle.
    """
    rng = np.random.default_rng(seed)
    while True:
        drawn = _drawn(rng, f"drawn_{seed}")
        testbed = parse_testbed(json.dumps(drawn.testbed), "drawn").testbed
        try:
            operating_point(testbed, nominal_parameters(testbed), np.zeros(6))
            return drawn
        except CspmError:
            continue


def _drawn(rng: np.random.Generator, name: str) -> DrawnMachine:
    count = int(rng.integers(3, 10))
    size, mass = float(rng.uniform(1.0, 6.0)), float(np.exp(rng.uniform(np.log(0.1), np.log(500))))
    height, platform = size * float(rng.uniform(0.7, 1.5)), size * float(rng.uniform(0.08, 0.2))
    if count < 6 or rng.random() < 0.2:
        platform = 0.0
    exits, ends = _geometry(rng, count, size, height, platform)
    share = mass * GRAVITY / min(count, 4)
    own = _winch(rng, mass, share, count, size)
    friction = {"torque": 0.01 * own["torque_limit"]}
    testbed = {
        "name": name,
        "bar": _body(mass, max(platform, 0.05 * size)),
        "cables": [
            {"name": f"c{i + 1}", "exit": list(exit_), "attachment": list(end), **own}
            for i, (exit_, end) in enumerate(zip(exits.tolist(), ends.tolist(), strict=True))
        ],
        "sensors": _sensors(share, own),
        "effects": [{"effect": "winch_coulomb_friction", "parameters": friction}],
    }
    return DrawnMachine(testbed, _scenario(name, size, rng), size)


def _geometry(
    rng: np.random.Generator, count: int, size: float, height: float, platform: float
) -> tuple[Array, Array]:
    """Return exits and attachments (count, 3) [m]; of seven cables or more some may pull down."""
    turned = 2.0 * np.pi * np.arange(count) / count + rng.uniform(-0.15, 0.15, count)
    out = size * rng.uniform(0.85, 1.0, count)
    down = np.zeros(count, dtype=bool)
    if count >= 7 and rng.random() < 0.5:
        down[rng.permutation(count)[: count - 4]] = True
    levels = np.where(down, height, -height)
    exits = np.stack([out * np.cos(turned), out * np.sin(turned), levels], axis=1)
    # Neighbours cross, so that the body cannot turn freely.
    crossed = turned + rng.uniform(0.6, 1.0, count) * np.where(np.arange(count) % 2, 1.0, -1.0)
    ends = platform * np.stack(
        [np.cos(crossed), np.sin(crossed), 0.3 * rng.uniform(-1.0, 1.0, count)], axis=1
    )
    return exits.round(4), ends.round(4)


def _winch(
    rng: np.random.Generator, mass: float, share: float, count: int, size: float
) -> dict[str, Any]:
    """Return what all cables of a machine have in common."""
    gear, drum = float(rng.uniform(1.0, 20.0)), float(rng.uniform(0.01, 0.06))
    parts = int(rng.choice([1, 1, 1, 2, 3, 4]))
    highest = 6.0 * share / parts
    modulus, stress = ROPES[int(rng.integers(len(ROPES)))]
    diameter = max(THINNEST, float(np.sqrt(4.0 / np.pi * highest / stress)))
    reflected = mass / count * float(rng.uniform(0.1, 3.0))
    stiffness = modulus * np.pi / 4.0 * diameter**2 / size
    damping = 2.0 * float(rng.uniform(0.02, 0.1)) * np.sqrt(stiffness * mass / count)
    found = {
        "offset_length": 0.2 * size,
        "stiffness": {
            "law": "linear",
            "youngs_modulus": modulus,
            "diameter": diameter,
            "floor_tension": 0.01 * share,
        },
        "damping": {"constant": float(damping)},
        "drum_radius": drum,
        "gear_ratio": gear,
        "rotor_inertia": reflected * (drum / gear / parts) ** 2,
        "torque_limit": 1.2 * highest * drum / gear,
        "tension_limits": [0.05 * share / parts, highest],
        "parts": parts,
    }
    if rng.random() < 0.4:
        found["pulley"] = {"radius": float(rng.uniform(0.01, 0.03)) * size, "axis": [0, 0, -1]}
    return found


def _body(mass: float, half: float) -> dict[str, Any]:
    moment = mass * half**2 / 3.0
    inertia = {"ixx": moment, "iyy": moment, "izz": 1.5 * moment}
    return {"mass": mass, "inertia": inertia, "dimensions": [2.0 * half] * 3}


def _sensors(share: float, own: dict[str, Any]) -> dict[str, Any]:
    """Return sensors that are as good for their range as those of the thesis."""
    return {
        "/bar/pose": {"noise": [1e-4, 2e-4], "resolution": [0.0, 0.0], "rate": 100},
        "/winches/state": {
            "noise": [0.0, 0.01, 2e-4 * own["torque_limit"]],
            "resolution": [1.5e-3, 0.0, 0.0],
            "rate": 1000,
        },
        "/cables/tension": {"noise": 1e-3 * share, "resolution": 0.0, "rate": 1000},
    }


def _scenario(name: str, size: float, rng: np.random.Generator) -> dict[str, Any]:
    """Return a circle within the middle tenth of the machine."""
    middle = [0.0] * 6
    return {
        "name": name,
        "testbed": f"{name}_testbed.yaml",
        "duration": DURATION,
        "target": {
            "mean_pose": middle,
            "motion": {
                "type": "circle",
                "radius": round(size * float(rng.uniform(0.0, 0.1)), 4),
                "period": PERIOD,
            },
        },
        "control": {"mode": "closed_loop", "motion": {"law": "pid", "design_pose": middle}},
    }
