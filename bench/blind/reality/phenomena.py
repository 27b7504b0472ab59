"""All that may be concealed in a recording."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from bench.blind.reality import (
    air,
    alterations,
    drive,
    faults,
    frame,
    friction,
    payload,
    rope,
    shaft,
)
from bench.blind.reality.heavy_rope import THREAD, HeavyRope
from bench.blind.reality.phenomenon import BAR, CAPTURE, FRAME, Phenomenon
from bench.blind.reality.sensors import Fault
from cspm_msgs_py.testbed import Testbed
from cspm_sim.mujoco.influence import Influence

Array = NDArray[np.float64]
Make = Callable[[Array, Testbed, np.random.Generator], Influence]

POSES = ("/bar/pose", "/winch_frame/pose")
RIPPLE_ORDER = 6.0
STRIBECK_SPEED = 1.5  # [rad/s]
LOOSENING_ONSET = 12.0  # [s]


def shaft_radii(machine: Testbed) -> Array:
    """Return the length wound per motor angle, (n,) [m/rad]."""
    return np.array([c.wound_radius for c in machine.cables])


def _ratios(machine: Testbed) -> Array:
    return np.array([c.gear_ratio for c in machine.cables])


def _plain(build: Callable[[Array], Influence]) -> Make:
    return lambda amounts, machine, generator: build(amounts)


def _on_radii(build: Callable[[Array, Array], Influence]) -> Make:
    return lambda amounts, machine, generator: build(amounts, shaft_radii(machine))


def _phase(generator: np.random.Generator) -> float:
    return float(generator.uniform(0.0, 2.0 * np.pi))


def _cell(build: Callable[[Array], Fault]) -> Callable[[Array], Mapping[str, Fault]]:
    return lambda amounts: {"/cables/tension": build(amounts)}


_WINCHES = (
    Phenomenon(
        "bristles", "winch_coulomb_friction", "winch", "torque",
        unit=1e-3, influence=_plain(friction.coulomb),
    ),
    Phenomenon(
        "breakaway", "winch_stribeck_friction", "winch", "coulomb_torque", unit=1e-3,
        influence=lambda a, m, g: friction.stribeck(0.8 * a, a, STRIBECK_SPEED),
    ),
    Phenomenon(
        "loaded bristles", "winch_load_friction", "winch", "coefficient",
        unit=1e-2, influence=_on_radii(friction.load_dependent),
    ),
    Phenomenon(
        "grease", "winch_viscous_friction", "winch", "coefficient",
        unit=1e-4, influence=_plain(shaft.GreaseDrag), column=lambda scene: -scene.speeds,
    ),
    Phenomenon(
        "cogging", "winch_torque_ripple", "winch", "amplitude", unit=1e-3,
        influence=lambda a, m, g: shaft.Cogging(a, RIPPLE_ORDER, _phase(g)),
    ),
    Phenomenon(
        "drive zero", "winch_torque_offset", "winch", "torque",
        unit=1e-3, influence=_plain(shaft.TorqueOffset), signed=True,
    ),
    Phenomenon(
        "drive scale", "winch_torque_gain", "winch", "gain",
        unit=1e-2, influence=_plain(shaft.TorqueGain), base=1.0, signed=True,
    ),
    Phenomenon(
        "slow drive", "winch_torque_lag", "winch", None,
        unit=1e-3, drive=drive.SlowDrive,
    ),
    Phenomenon(
        "runout", "winch_drum_eccentricity", "winch", "eccentricity", unit=1e-4,
        influence=lambda a, m, g: shaft.DrumRunout(a, _ratios(m), _phase(g)),
    ),
    Phenomenon(
        "eddy currents", None, "winch", None, unit=1e-3,
        influence=_plain(shaft.EddyCurrentDrag), driver="speed",
    ),
)  # fmt: skip

_CABLES = (
    Phenomenon(
        "internal friction", "cable_hysteresis", "cable", "force",
        unit=0.1, influence=_plain(rope.MaxwellSlip),
    ),
    Phenomenon(
        "slow elongation", "cable_creep", "cable", "compliance",
        unit=1e-5, influence=_plain(rope.Creep),
    ),
    Phenomenon(
        "capstan", "pulley_friction", "cable", None,
        unit=1e-2, influence=_on_radii(friction.CapstanFriction),
    ),
    Phenomenon(
        "drag on ropes", "cable_transverse_damping", "cable", "coefficient",
        unit=0.1, influence=_plain(rope.SegmentDrag),
    ),
    Phenomenon(
        "drag on strings", "cable_transverse_damping", "cable", "coefficient", unit=0.1,
        influence=lambda a, m, g: HeavyRope(np.where(a > 0.0, THREAD, 0.0), a, 0.0),
    ),
    Phenomenon(
        "hanging rope", "cable_sag", "cable", "linear_density", unit=5e-3,
        influence=lambda a, m, g: HeavyRope(a, np.zeros(len(a)), m.gravity),
    ),
    Phenomenon(
        "slip on the drum", None, "winch", None,
        unit=1e-3, influence=_on_radii(rope.DrumSlip), driver="time",
    ),
    Phenomenon(
        "loosening anchor", None, "cable", None, unit=1e-3,
        influence=lambda a, m, g: rope.LooseningAnchor(a, LOOSENING_ONSET), driver="time",
    ),
)  # fmt: skip

_BODIES = (
    Phenomenon(
        "air", "bar_quadratic_drag", "bar", "sway", at=BAR, unit=1.0,
        influence=lambda a, m, g: air.StripDrag(
            float(a[0]), m.bar.dimensions[0] if m.bar else 0.0
        ),
    ),
    Phenomenon(
        "wind", "bar_constant_wrench", "bar", "sway", at=BAR, unit=0.1,
        influence=lambda a, m, g: air.Wind(float(a[0]), g), signed=True,
    ),
    Phenomenon(
        "vibration", None, "bar", None, at=BAR, unit=0.1,
        influence=lambda a, m, g: air.OutsideVibration(float(a[0])), driver="frequency",
    ),
    Phenomenon(
        "strapped load", "payload_swing", "bar", "mass", at=BAR, unit=0.1,
        influence=lambda a, m, g: payload.StrappedLoad(float(a[0]), m.gravity),
    ),
    Phenomenon(
        "yielding frame", "frame_flexibility", "frame", "compliance", at=FRAME, unit=1e-5,
        influence=lambda a, m, g: frame.YieldingFrame(float(a[0])),
    ),
)  # fmt: skip

_SENSORS = (
    Phenomenon(
        "cell zero", "tension_bias", "sensor", "bias",
        unit=0.1, faults=_cell(faults.CellOffset), signed=True,
    ),
    Phenomenon(
        "cell scale", "tension_gain", "sensor", "gain",
        unit=1e-2, faults=_cell(faults.CellGain), base=1.0, signed=True,
    ),
    Phenomenon(
        "warming cell", None, "sensor", None,
        unit=0.1, faults=_cell(faults.CellWarming), driver="time",
    ),
    Phenomenon(
        "encoder counts", "encoder_scale", "sensor", "scale", unit=1e-3, base=1.0, signed=True,
        faults=lambda a: {"/winches/state": faults.EncoderCounts(a)},
    ),
    Phenomenon(
        "late tracker", "pose_delay", "sensor", "delay", at=CAPTURE, unit=1e-3,
        faults=lambda a: {topic: faults.FilteredDelay(float(a[0])) for topic in POSES},
    ),
    Phenomenon(
        "fast clock", "clock_skew", "sensor", "skew", at=CAPTURE, unit=1e-5, signed=True,
        clocks=lambda a: dict.fromkeys(POSES, float(a[0])),
    ),
    Phenomenon(
        "shifted markers", "pose_offset", "sensor", "sway", at=BAR, unit=1e-4, signed=True,
        faults=lambda a: {"/bar/pose": faults.MarkerShift(float(a[0]))},
    ),
)  # fmt: skip

_NUMBERS = (
    Phenomenon(
        "mass", "bar_mass", "bar", "mass", at=BAR, unit=0.1,
        alter=alterations.heavier, signed=True,
    ),
    Phenomenon(
        "inertia of the bar", "bar_inertia", "bar", "iyy", at=BAR, unit=0.01,
        alter=alterations.harder_to_turn,
    ),
    Phenomenon(
        "centre of mass", "bar_com", "bar", "x", at=BAR, unit=1e-3,
        alter=alterations.off_centre, signed=True,
    ),
    Phenomenon(
        "stiffness", "cable_stiffness", "cable", "scale", unit=0.1, base=1.0,
        alter=alterations.stiffer, signed=True,
    ),
    Phenomenon(
        "damper", "cable_axial_damping", "cable", "scale", unit=0.1, base=1.0,
        alter=alterations.damped, signed=True,
    ),
    Phenomenon(
        "inertia", "winch_inertia", "winch", "inertia", unit=1e-5,
        alter=alterations.more_inert,
    ),
    Phenomenon(
        "radius", "winch_drum_radius", "winch", "radius", unit=1e-4,
        alter=alterations.wider, signed=True,
    ),
)  # fmt: skip

PHENOMENA: Mapping[str, Phenomenon] = {
    each.name: each for each in (*_WINCHES, *_CABLES, *_BODIES, *_SENSORS, *_NUMBERS)
}
