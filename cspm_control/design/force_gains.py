"""Force controllers by the thesis's procedure, section 7-2, one loop at a time."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cspm_control.design.drive_limited import DriveLimit, drive_limited_gains
from cspm_control.design.gains import (
    BANDWIDTH_RATIO,
    GAIN_MARGIN,
    LARGEST_FORCE_BANDWIDTH,
    MOTION_BANDWIDTH,
    PHASE_MARGIN,
    force_loop,
    tension_plant,
)
from cspm_control.design.margins import (
    ComplexArray,
    GridResponse,
    Margins,
    loop_frequencies,
    margins,
)
from cspm_model.kernels.cable import RADIUS
from cspm_model.kernels.machine import PlantParameters
from cspm_model.linearisation import StateSpace
from cspm_msgs_py.control_spec.force import FORCE_BANDWIDTH, PiGains
from cspm_msgs_py.control_spec.per_cable import values_per_cable
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]

BANDWIDTH_KEY = "control.force.bandwidth"

# The force loop's integral frequency is the largest that keeps the open loop's phase 60° away from
# −180° at every frequency, and at most this share of the bandwidth, where it costs 3° of phase. A
# steel cable, whose resonance is little damped, keeps 30°, the least that is usual: Åström,
# Hägglund, Advanced PID Control (2006), section 4.6.
LEAST_PHASE_MARGIN = np.radians(30.0)
LARGEST_INTEGRAL_SHARE = 1.0 / 20.0
# A force loop below its cable's resonance is as much slower than the motion as one above is faster.
SLOW_FORCE_BANDWIDTH = MOTION_BANDWIDTH / BANDWIDTH_RATIO
DRIVE_LIMIT = DriveLimit(LEAST_PHASE_MARGIN, GAIN_MARGIN, FORCE_BANDWIDTH, SLOW_FORCE_BANDWIDTH)


def design_force_gains(
    testbed: Testbed,
    parameters: PlantParameters,
    design_pose: ArrayLike,
    bandwidth: float | dict[str, float],
    dead_time: float = 0.0,
) -> dict[str, PiGains]:
    """Return the PI per cable whose closed loop has −3 dB at its bandwidth, section 7-2.

    A cable so stiff that its loop would come near −180° at the default bandwidth has what its drive
    allows, see `drive_limited`.

    Args:
        testbed: the machine.
        parameters: its kernel parameters.
        design_pose: the bar's pose x y z φ θ ψ with the winch frame at the origin.
        bandwidth: one for all cables, or by name or kind of cable [rad/s]; a cable that is not
            named has the default.
        dead_time: what sampling and sensors delay a drive-limited loop by [s].

    Raises:
        InputError: the machine has no bar or no such cable, a bandwidth is above the thesis's
            limit, or a cable's loop would come near −180°.
        ConvergenceError: the bar cannot hang at the design pose.
    """
    names = testbed.cable_names
    bandwidths = values_per_cable(bandwidth, names, FORCE_BANDWIDTH, BANDWIDTH_KEY)
    for name, wanted in zip(names, bandwidths, strict=True):
        if not 0.0 < wanted <= LARGEST_FORCE_BANDWIDTH:
            whose = f" of {name}" if isinstance(bandwidth, dict) else ""
            raise InputError(
                f"{BANDWIDTH_KEY}: {wanted:g} rad/s{whose}, allowed: above 0 and at most"
                f" {LARGEST_FORCE_BANDWIDTH:g} rad/s"
            )
    model = tension_plant(testbed, parameters, design_pose)
    plants = {wanted: _grid_response(model, wanted) for wanted in set(bandwidths)}
    found = {}
    for i, name in enumerate(names):
        plant, grid = plants[bandwidths[i]]
        try:
            found[name] = _design_force_loop(name, i, plant, grid, bandwidths[i])
        except InputError:
            if bandwidths[i] != FORCE_BANDWIDTH:
                raise
            delayed = plant.response(grid)[:, i, i] * np.exp(-1j * grid * dead_time)
            radius = float(parameters.cables[i, RADIUS])
            found[name] = drive_limited_gains(name, grid, delayed, radius, DRIVE_LIMIT)
    return found


def _grid_response(model: StateSpace, bandwidth: float) -> tuple[GridResponse, Array]:
    """Return a plant's response about a bandwidth [rad/s], and the frequencies of its grid."""
    frequencies = loop_frequencies(model, bandwidth)
    return GridResponse(model, frequencies), frequencies


def _design_force_loop(
    name: str, i: int, plant: GridResponse, frequencies: Array, bandwidth: float
) -> PiGains:
    """Return the PI of cable `i` for a bandwidth [rad/s]; see `design_force_gains`."""
    response = plant.response(frequencies)[:, i, i]
    integral = _integral_frequency(name, frequencies, response, bandwidth)
    at_bandwidth = plant.response(bandwidth)[0, i, i]
    shape = (1.0 + integral / (1j * bandwidth)) * at_bandwidth
    # The root Kp > 0 of 2·|Kp·g|² = |1 + Kp·g|².
    kp = (shape.real + np.hypot(shape.real, np.abs(shape))) / np.abs(shape) ** 2
    gains = PiGains(kp=float(kp), integral_frequency=integral)
    _check_force(name, bandwidth, margins(force_loop(plant, i, gains), frequencies))
    return gains


def _integral_frequency(
    name: str, frequencies: Array, response: ComplexArray, bandwidth: float
) -> float:
    phase, largest = np.unwrap(np.angle(response)), LARGEST_INTEGRAL_SHARE * bandwidth
    for margin in (PHASE_MARGIN, LEAST_PHASE_MARGIN):
        room = phase + np.pi - margin
        if room.min() > 0.0:
            lag = room < 0.5 * np.pi  # elsewhere any integral frequency will do
            return float(np.min(frequencies[lag] * np.tan(room[lag]), initial=largest))
    worst = int(phase.argmin())
    raise InputError(
        f"control.force: {name}'s tension falls {-np.degrees(phase[worst]):.0f}° behind its torque"
        f" at {frequencies[worst]:.4g} rad/s at any bandwidth, allowed: less than"
        f" {np.degrees(np.pi - LEAST_PHASE_MARGIN):.0f}°; without {BANDWIDTH_KEY} its loop has what"
        " the drive allows"
    )


def _check_force(name: str, bandwidth: float, found: Margins) -> None:
    if abs(found.bandwidth - bandwidth) > 1e-3 * bandwidth:
        raise InputError(
            f"{BANDWIDTH_KEY}: at {bandwidth:g} rad/s the loop of {name} already falls"
            f" below −3 dB at {found.bandwidth:.4g} rad/s, allowed: a bandwidth above the"
            " resonances of the cables"
        )
