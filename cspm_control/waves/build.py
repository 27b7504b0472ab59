"""From a scenario's `motion:` to a body's motion."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from pathlib import Path

import numpy as np

from cspm_control.waves.curves import curve_sines, listed_sines, sine_knots
from cspm_control.waves.motion_file import motion_knots, read_motion
from cspm_control.waves.moves import move_knots
from cspm_control.waves.realisation import knot_count, start_from_rest, synthesise
from cspm_control.waves.sea import Array, Complex, WaveSet, draw_waves, wave_number
from cspm_control.waves.small_body import small_body_response
from cspm_control.waves.spectrum import jonswap
from cspm_control.waves.vessel import read_vessel
from cspm_control.waves.waypoints import waypoint_knots
from cspm_model.motion import Motion
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.motion_spec import (
    FileMotion,
    JonswapMotion,
    MotionSpec,
    MovesMotion,
    Sea,
    StillMotion,
    VesselMotion,
)
from cspm_msgs_py.scenario_keys.curves import (
    CircleMotion,
    HelixMotion,
    LemniscateMotion,
    LineMotion,
    SinesMotion,
    WaypointsMotion,
)

UNEXCITED = 1e-6  # response below this share of the waves cannot honestly be scaled up


def build_motion(
    spec: MotionSpec,
    mean_pose: Sequence[float],
    *,
    seed: int,
    duration: float,
    gravity: float,
    folder: Path,
) -> Motion:
    """Return the motion that `spec` describes, about `mean_pose`.

    Args:
        spec: the scenario's `motion:`.
        mean_pose: x y z φ θ ψ in world_ned [m, rad]; added coordinate by coordinate.
        seed: of the sea; bodies with the same seed are in the same waves.
        duration: how long the scenario lasts [s]; bounds a motion that cannot repeat.
        gravity: [m/s²].
        folder: where relative paths start.

    Raises:
        InputError: a file is unusable, or the motion is not possible.
    """
    mean = np.array(mean_pose, dtype=np.float64)
    match spec:
        case StillMotion():
            motion = Motion.still(mean)
        case FileMotion():
            rows = read_motion(folder / spec.path)
            motion = _about(mean, *motion_knots(rows, spec.rate))
        case MovesMotion():
            motion = _about(mean, *move_knots(spec.moves))
        case WaypointsMotion():
            motion = _about(mean, *waypoint_knots(spec))
        case SinesMotion():
            motion = _about(mean, *sine_knots(listed_sines(spec), spec.ramp, duration))
        case LineMotion() | CircleMotion() | LemniscateMotion() | HelixMotion():
            motion = _about(mean, *sine_knots(curve_sines(spec), spec.ramp, duration))
        case JonswapMotion():
            motion = _sea_motion(spec, mean, *_small_body(spec, mean[5], seed, gravity), duration)
        case VesselMotion():
            motion = _sea_motion(
                spec, mean, *_vessel(spec, mean[5], seed, gravity, folder), duration
            )
    check_attitude(motion)
    return motion


def sea_of(spec: Sea, seed: int) -> WaveSet:
    """Return the waves of the sea that `spec` describes."""
    return draw_waves(spec.band, spec.period, spec.heading, spec.spreading, seed)


def wave_amplitudes(spec: Sea, waves: WaveSet, significant_wave_height: float) -> Array:
    """Return √(2 S(f)/period) of each wave, shape (n,) [m]."""
    density = jonswap(
        waves.frequency, significant_wave_height, spec.peak_period, spec.peak_enhancement
    )
    return np.sqrt(2.0 * density / waves.period)


def _small_body(
    spec: JonswapMotion, mean_yaw: float, seed: int, gravity: float
) -> tuple[Array, float]:
    """Return one period of the scaled response of a small body, and the knots' spacing."""
    waves = sea_of(spec, seed)
    elevation = wave_amplitudes(spec, waves, 1.0)
    # A ship is too long to follow the slope of the band's shortest waves. With the peak's wave
    # number for all of them, its angles have the same spectrum as the elevation.
    peak = np.array([2.0 * pi / spec.peak_period])
    number = np.repeat(wave_number(peak, gravity), len(waves.direction))
    response = small_body_response(waves.direction, number, mean_yaw)
    phasor = waves.phasor(spec.position, gravity)
    count = knot_count(spec.period, waves.frequency[-1], max(spec.amplitudes))
    knots = synthesise(
        (elevation * phasor)[:, None] * response, waves.harmonic, waves.period, count
    )
    reach = np.array([elevation.sum()] * 3 + [(elevation * number).sum()] * 3)
    _scale(knots, spec.amplitudes, reach)
    return knots, spec.period / count


def _scale(knots: Array, amplitudes: Sequence[float], reach: Array) -> None:
    for dof, wanted in enumerate(amplitudes):
        peak = np.abs(knots[:, dof]).max()
        if wanted > 0.0 and peak < UNEXCITED * reach[dof]:
            raise InputError(
                f"motion.amplitudes: the waves do not excite {DOFS[dof]}, allowed: 0, another"
                " heading or more spreading"
            )
        columns = knots[:, dof::6]
        columns[:] = columns / peak * wanted if wanted > 0.0 else 0.0


def _vessel(
    spec: VesselMotion, mean_yaw: float, seed: int, gravity: float, folder: Path
) -> tuple[Array, float]:
    """Return one period of the vessel's response, and the knots' spacing."""
    waves = sea_of(spec, seed)
    elevation = wave_amplitudes(spec, waves, spec.significant_wave_height)
    vessel = read_vessel(folder / spec.rao)
    relative = waves.direction - mean_yaw
    response = vessel.at(waves.angular_frequency, relative, spec.scale)
    response[:, :2] = _turned(response[:, :2], mean_yaw)
    amplitude = (elevation * waves.phasor(spec.position, gravity))[:, None] * response
    bound = float(np.abs(amplitude).sum(axis=0).max())
    count = knot_count(spec.period, waves.frequency[-1], bound)
    return synthesise(amplitude, waves.harmonic, waves.period, count), spec.period / count


def _turned(horizontal: Complex, yaw: float) -> Complex:
    cosine, sine = np.cos(yaw), np.sin(yaw)
    return np.asarray(horizontal @ np.array([[cosine, sine], [-sine, cosine]]))


def _sea_motion(spec: Sea, mean: Array, knots: Array, spacing: float, duration: float) -> Motion:
    if spec.ramp == 0.0:
        return _about(mean, knots, spacing, periodic=True)
    return _about(mean, start_from_rest(knots, spacing, spec.ramp, duration), spacing)


def _about(mean: Array, knots: Array, spacing: float, periodic: bool = False) -> Motion:
    knots[:, :6] += mean
    return Motion(knots, spacing, periodic)


def check_attitude(motion: Motion) -> None:
    """Check that a motion's Euler angles stay where they are unique.

    Raises:
        InputError: roll or pitch reaches π/2 at a knot.
    """
    for column, name in ((3, "roll"), (4, "pitch")):
        largest = float(np.abs(motion.knots[:, column]).max())
        if largest >= pi / 2:
            raise InputError(
                f"motion: {name} reaches {largest:.3g} rad about the mean pose, allowed: less"
                " than π/2"
            )
