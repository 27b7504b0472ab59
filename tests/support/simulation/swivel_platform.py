"""A platform on three pairs of cables over swivelling pulleys, of two parts each.

Its loops, designed one by one, are not stable together: the cables turn as the platform does.
"""

from math import cos, pi, sin

from machines import build

MIDDLE = [0.0, 0.0, -0.9, 0.0, 0.0, 0.0]
NAMES = ("a1", "a2", "b1", "b2", "g1", "g2")


def platform_content():
    """The machine, as plain data."""
    turns = [2.0 * pi / 3.0 * pair for pair in range(3)]
    sides = [(turn, side) for turn in turns for side in (-1.0, 1.0)]
    return {
        "name": "platform",
        "bar": {
            "mass": 25.0,
            "inertia": {"ixx": 1.1, "iyy": 1.1, "izz": 1.9},
            "com": [0.0, 0.0, 0.03],
            "dimensions": [0.6, 0.6, 0.05],
        },
        "cables": [
            _cable(name, turn, side) for name, (turn, side) in zip(NAMES, sides, strict=True)
        ],
        "sensors": {
            "/bar/pose": {"noise": [1e-4, 2e-4], "resolution": [0.0, 0.0], "rate": 100},
            "/cables/tension": {"noise": 0.15, "resolution": 0.0375, "rate": 1000},
        },
    }


def platform():
    """The machine."""
    return build(platform_content())


def platform_scenario(**changes):
    """A scenario in which it goes around a circle."""
    return {
        "name": "around",
        "testbed": "platform.yaml",
        "duration": 5.0,
        "target": {
            "mean_pose": MIDDLE,
            "motion": {"type": "circle", "radius": 0.25, "period": 6.0},
        },
        "control": {"mode": "closed_loop", "motion": {"law": "pid", "design_pose": MIDDLE}},
        **changes,
    }


def _cable(name, turn, side):
    out, around = turn + side * 8.0 / 180.0 * pi, turn + side * 55.0 / 180.0 * pi
    return {
        "name": name,
        "exit": [1.8 * cos(out), 1.8 * sin(out), -3.0],
        "attachment": [0.4 * cos(around), 0.4 * sin(around), 0.0],
        "offset_length": 1.2,
        "stiffness": {
            "law": "linear",
            "youngs_modulus": 7.0e10,
            "diameter": 0.002,
            "floor_tension": 0.05,
        },
        "damping": {"constant": 120.0},
        "drum_radius": 0.04,
        "gear_ratio": 12.0,
        "rotor_inertia": 1.2e-4,
        "torque_limit": 3.0,
        "tension_limits": [2.0, 300.0],
        "pulley": {"radius": 0.035, "axis": [0, 0, -1]},
        "parts": 2,
    }
