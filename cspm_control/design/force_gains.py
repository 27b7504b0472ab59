"""Force controllers by the thesis's procedure, section 7-2, one loop at a time."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cspm_control.design.drive_limited import DriveLimit, fast_gains, slow_gains
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
DRIVE_LIMIT = DriveLimit(
    LEAST_PHASE_MARGIN, GAIN_MARGIN, FORCE_BANDWIDTH, SLOW_FORCE_BANDWIDTH, BANDWIDTH_RATIO
)


def design_force_gains(
    testbed: Testbed,
    parameters: PlantParameters,
    design_pose: ArrayLike,
    bandwidth: float | dict[str, float],
    dead_time: float = 0.0,
    *,
    slow: bool = False,
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
        slow: keep the loops whose bandwidth is the default below the resonances.

    Raises:
        InputError: the machine has no bar or no such cable, a bandwidth is above the thesis's
            limit, or a cable's loop would come near −180°.
        ConvergenceError: the bar cannot hang at the design pose.
    """
    names = testbed.cable_names
    bandwidths = _bandwidths(names, bandwidth)
    model = tension_plant(testbed, parameters, design_pose)
    plants = {each: _grid_response(model, each) for each in set(bandwidths)}
    found = {}
    for i, name in enumerate(names):
        plant, grid = plants[bandwidths[i]]
        try:
            found[name] = _design_force_loop(name, i, plant, grid, bandwidths[i])
        except InputError:
            if bandwidths[i] != FORCE_BANDWIDTH:
                raise
    left = {name: i for i, name in enumerate(names) if bandwidths[i] == FORCE_BANDWIDTH}
    if not left or (len(found) == len(names) and not slow):
        return found
    plant, grid = plants[FORCE_BANDWIDTH]
    response = plant.response(grid) * np.exp(-1j * grid * dead_time)[:, None, None]
    limited = None
    if not slow:
        limited = _fast(model, grid, response, parameters.cables[:, RADIUS], left, found)
    if limited is None:
        limited = {n: slow_gains(grid, response[:, i, i], DRIVE_LIMIT) for n, i in left.items()}
    return {name: limited.get(name) or found[name] for name in names}


def _bandwidths(names: tuple[str, ...], bandwidth: float | dict[str, float]) -> list[float]:
    """Return the bandwidth of each cable [rad/s].

    Raises:
        InputError: one is above the thesis's limit.
    """
    found = values_per_cable(bandwidth, names, FORCE_BANDWIDTH, BANDWIDTH_KEY)
    for name, wanted in zip(names, found, strict=True):
        if not 0.0 < wanted <= LARGEST_FORCE_BANDWIDTH:
            whose = f" of {name}" if isinstance(bandwidth, dict) else ""
            raise InputError(
                f"{BANDWIDTH_KEY}: {wanted:g} rad/s{whose}, allowed: above 0 and at most"
                f" {LARGEST_FORCE_BANDWIDTH:g} rad/s"
            )
    return list(found)


def _fast(
    model: StateSpace,
    frequencies: Array,
    response: ComplexArray,
    radii: Array,
    left: dict[str, int],
    found: dict[str, PiGains],
) -> dict[str, PiGains] | None:
    """Return gains above the resonances; None where a cable has none.

    One slow loop slows the motion: then no loop is fast that nobody asked to be.

    Args:
        model: from torques to tensions.
        frequencies: rising (m,) [rad/s].
        response: of all torques to all tensions there, delayed, (m, n, n).
        radii: cable wound per radian of each motor, (n,) [m].
        left: the cables whose bandwidth nobody asked for, by number.
        found: the gains of those that it suits.
    """
    resonance = float(np.abs(np.linalg.eigvals(model.A)).max())
    gains = {}
    for name, i in left.items():
        own = found.get(name) or fast_gains(
            frequencies, response[:, i, i], float(radii[i]), resonance, DRIVE_LIMIT
        )
        if own is None:
            return None
        gains[name] = own
    return gains


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
