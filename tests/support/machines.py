"""Machines that several tests use, as plain data and as test-beds."""

import copy
from pathlib import Path

import numpy as np

from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.yaml_file import validate

ROOT = Path(__file__).resolve().parents[2]
THESIS = ROOT / "scenarios" / "testbeds" / "thesis.yaml"

EXPONENTIAL = {
    "law": "exponential",
    "a": 7000.0,
    "b": 1.05,
    "c": 0.005,
    "d": -0.14,
    "youngs_modulus": 8.721e9,
    "diameter": 1.0e-3,
    "floor_tension": 0.05,
}
LINEAR = {"law": "linear", "youngs_modulus": 2.0e9, "diameter": 1.0e-3, "floor_tension": 0.05}
WINCH = {"drum_radius": 0.025, "rotor_inertia": 2.4e-4, "torque_limit": 2.0}


def cable(name, exit_point, attachment, stiffness=EXPONENTIAL, **changes):
    return {
        "name": name,
        "exit": list(exit_point),
        "attachment": list(attachment),
        "offset_length": 0.3,
        "stiffness": dict(stiffness),
        "damping": {"constant": 20.0, "slope": 1.5},
        **WINCH,
        "tension_limits": [0.0, 60.0],
        **changes,
    }


def rig_content():
    """One winch, one cable to a fixed point, no bar."""
    return {"name": "rig", "cables": [cable("only", (0, 0, 0), (0, 0, 2.1))]}


def point_content():
    """A small ball on three cables that meet in its centre; no winch frame."""
    exits = [(1.0, 0.0, -0.3), (-0.6, 0.8, -0.3), (-0.5, -0.9, -0.2)]
    return {
        "name": "point",
        "bar": {
            "mass": 2.0,
            "inertia": {"ixx": 0.01, "iyy": 0.01, "izz": 0.01},
            "dimensions": [0.1, 0.1, 0.1],
        },
        "cables": [cable(f"c{i}", point, (0, 0, 0)) for i, point in enumerate(exits)],
    }


def general_content(stiffness=EXPONENTIAL):
    """Eight cables of no symmetry, full inertia, centre of mass beside the origin, two gears."""
    exits = [
        (0.9, 0.8, -0.4),
        (0.85, -0.9, -0.45),
        (-0.95, 0.75, -0.38),
        (-0.8, -0.85, -0.5),
        (0.7, 0.6, -0.3),
        (0.75, -0.65, -0.42),
        (-0.7, 0.7, -0.41),
        (-0.72, -0.6, -0.36),
    ]
    attachments = [
        (0.4, 0.15, -0.05),
        (0.38, -0.2, -0.08),
        (-0.41, 0.18, 0.06),
        (-0.36, -0.16, -0.04),
        (0.2, -0.15, 0.1),
        (0.22, 0.17, 0.08),
        (-0.25, -0.14, 0.12),
        (-0.21, 0.19, -0.1),
    ]
    return {
        "name": "general",
        "bar": {
            "mass": 5.0,
            "inertia": {
                "ixx": 0.08,
                "iyy": 0.31,
                "izz": 0.35,
                "ixy": 0.015,
                "ixz": -0.02,
                "iyz": 0.01,
            },
            "com": [0.03, -0.02, 0.05],
            "dimensions": [1.0, 0.4, 0.2],
        },
        "winch_frame": {},
        "cables": [
            cable(f"c{i}", start, end, stiffness, gear_ratio=1.0 + 2.0 * (i % 2))
            for i, (start, end) in enumerate(zip(exits, attachments, strict=True))
        ],
    }


def pulley_content():
    """The general machine with pulleys on half of its cables and several parts of three."""
    content = general_content()
    for i, (radius, axis) in enumerate(
        [(0.03, (0, 0, -1)), (0.02, (0.4, 0.2, -2)), (0.05, (1, 0, 0)), (0.04, (0.1, -0.3, 0.9))]
    ):
        content["cables"][2 * i]["pulley"] = {"radius": radius, "axis": list(axis)}
    for i, parts in ((0, 2), (1, 3), (3, 2)):
        content["cables"][i]["parts"] = parts
    return content


def stop(body, place, **more):
    """A stop of a route."""
    return {"on": body, "at": list(place), **more}


def routed(cable, *stops, **first):
    """A cable with a route from its exit; its attachment and the rest are stops."""
    rest = {key: value for key, value in cable.items() if key not in ("exit", "attachment")}
    return {**rest, "route": [stop("frame", cable["exit"], **first), *stops]}


def route_content():
    """The general machine with blocks, tackles and pulleys in a row on five cables."""
    content = general_content()
    cables = content["cables"]
    ends = [cable["attachment"] for cable in cables]
    up, down = {"radius": 0.03, "axis": [0.1, 0, -1]}, {"radius": 0.02, "axis": [0, 0.2, 1]}
    cables[0] = routed(cables[0], stop("bar", ends[0]), stop("frame", (0.6, 0.9, -0.35)))
    cables[1] = routed(
        cables[1], stop("bar", ends[1], radius=0.05), stop("frame", (0.6, -0.7, -0.4)), **up
    )
    cables[2] = routed(
        cables[2],
        stop("bar", ends[2], radius=0.04),
        stop("frame", (-0.7, 0.9, -0.3), radius=0.06),
        stop("bar", (-0.3, 0.1, 0.0)),
    )
    cables[3] = routed(
        cables[3], stop("frame", (-0.6, -0.5, -0.4), radius=0.05), stop("bar", ends[3]), **down
    )
    cables[4] = routed(
        cables[4],
        stop("bar", ends[4], radius=0.03),
        stop("bar", (-0.1, -0.2, 0.05), radius=0.05),
        stop("frame", (-0.2, -0.8, -0.3)),
    )
    return content


def entry(effect, elements=(), **parameters):
    """One entry of a machine's `effects`."""
    return {"effect": effect, "elements": list(elements), "parameters": parameters}


def build(content):
    """Check a machine that is written as plain data."""
    return validate(Testbed, content, "test.yaml")


def changed(content, path, value):
    """Return a copy with the value at a key path such as `bar.com` or `cables.0.exit` replaced."""
    content = copy.deepcopy(content)
    node = content
    *parents, last = [int(key) if key.isdigit() else key for key in path.split(".")]
    for key in parents:
        node = node[key]
    node[last] = value
    return content


def with_bar(testbed, **changes):
    """Return a machine with some of its bar's values replaced."""
    return testbed.model_copy(update={"bar": testbed.bar.model_copy(update=changes)})


def random_poses(count, seed, centre=(0.0, 0.0, 2.0), reach=0.3, angle=0.4):
    rng = np.random.default_rng(seed)
    poses = rng.uniform(-1.0, 1.0, (count, 6)) * np.repeat([reach, angle], 3)
    poses[:, :3] += centre
    return poses
