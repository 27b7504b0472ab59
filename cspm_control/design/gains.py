"""Controller gains by the thesis's procedure (chapter 7), and the margins of their loops.

Both designs see the linear model with frozen cable directions of chapter 6, one loop at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple, TypeVar

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from cspm_model.kernels.machine import PlantParameters
from cspm_model.kinematics import RANK_TOLERANCE
from cspm_model.linearisation import (
    OperatingPoint,
    StateSpace,
    linear_model,
    motion_subsystem,
    operating_point,
    tension_subsystem,
)
from cspm_msgs_py.dofs import CONTROLLED_AXES, DOFS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import PidGains, PiGains
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Response = Callable[[Array], ComplexArray]
Dof = TypeVar("Dof", bound=str)

CONTROLLED_DOFS = tuple(DOFS[axis] for axis in CONTROLLED_AXES)

# Zeros of the PID, as shares of the crossover frequency: integral action below the first,
# derivative action above the second.
INTEGRAL_ZERO = 1.0 / 40.0
DERIVATIVE_ZERO = 1.0 / 3.0

# Requirements on the motion loops, section 7-1: the bandwidth is the fastest wave of table 1-3.
PHASE_MARGIN = np.radians(60.0)
GAIN_MARGIN = 6.0  # dB
LOW_FREQUENCY_GAIN = 20.0  # dB
MOTION_BANDWIDTH = 7.3  # rad/s
# Requirements on the force loops, section 7-2.
LARGEST_FORCE_BANDWIDTH = 1000.0  # rad/s
BANDWIDTH_RATIO = 10.0

# The force loop's integral frequency is the largest that keeps the open loop's phase 60° away from
# −180° at every frequency, and at most this share of the bandwidth, where it costs 3° of phase.
LOWEST_PHASE = -np.pi + PHASE_MARGIN
LARGEST_INTEGRAL_SHARE = 1.0 / 20.0

POINTS_PER_DECADE = 60
HALF_POWER = np.sqrt(0.5)


class Margins(NamedTuple):
    """How far a loop is from instability, and how fast it is.

    Attributes:
        crossover: highest frequency with |L| = 1 [rad/s]; 0 where |L| never reaches 1.
        phase_margin: least phase above −180° at any crossover [rad].
        gain_margin: how much the gain may rise [dB]; infinite without a −180° crossing.
        low_frequency_gain: how much the gain may fall [dB]: |L| at the −180° crossing below the
            crossover, infinite without one.
        bandwidth: where |L/(1+L)| first falls below −3 dB [rad/s].
    """

    crossover: float
    phase_margin: float
    gain_margin: float
    low_frequency_gain: float
    bandwidth: float


class GridResponse:
    """A plant whose frequency response on one grid is computed once, for all of its loops."""

    def __init__(self, plant: StateSpace, grid: Array) -> None:
        """Compute it at angular frequencies of shape (m,) [rad/s]."""
        self._plant, self._grid = plant, grid
        self._values = plant.response(grid)

    def response(self, frequencies: ArrayLike) -> ComplexArray:
        """Return G(jω) as `StateSpace.response` does."""
        return self._values if frequencies is self._grid else self._plant.response(frequencies)


def margins(loop: Response, frequencies: Array) -> Margins:
    """Return the margins of the open loop L(jω).

    Args:
        loop: L at angular frequencies (m,) [rad/s].
        frequencies: rising grid that brackets each crossing once; the crossings are then refined.
    """
    values = loop(frequencies)

    def crossings(measure: Callable[[ComplexArray], Array]) -> Array:
        above = measure(values) > 0.0
        places = np.flatnonzero(above[1:] != above[:-1])
        pairs = [(frequencies[i], frequencies[i + 1]) for i in places]
        return np.array([_refine(loop, measure, *pair) for pair in pairs])

    unit = crossings(lambda value: np.abs(value) - 1.0)
    real = crossings(np.imag)
    at_real = np.real(loop(real)) if len(real) else np.zeros(0)
    gains = 20.0 * np.log10(-at_real[at_real < 0.0])
    half = crossings(lambda value: np.abs(value / (1.0 + value)) - HALF_POWER)
    return Margins(
        crossover=float(unit.max(initial=0.0)),
        phase_margin=float(np.angle(-loop(unit)).min()) if len(unit) else np.inf,
        gain_margin=float((-gains[gains <= 0.0]).min(initial=np.inf)),
        low_frequency_gain=float(gains[gains > 0.0].min(initial=np.inf)),
        bandwidth=float(half.min(initial=np.inf)),
    )


def design_motion_gains(
    testbed: Testbed,
    parameters: PlantParameters,
    design_pose: ArrayLike,
    crossover: Mapping[Dof, float],
) -> dict[Dof, PidGains]:
    """Return the PID per DOF with |L| = 1 at its crossover and zeros in fixed ratio to it.

    Args:
        testbed: the machine.
        parameters: its kernel parameters.
        design_pose: the bar's pose x y z φ θ ψ with the winch frame at the origin.
        crossover: wanted crossover frequency per DOF [rad/s].

    Raises:
        InputError: the machine has no bar or cannot exert all controlled forces, a DOF is not
            controlled, or its loop misses a requirement of the thesis.
        ConvergenceError: the bar cannot hang at the design pose.
    """
    _check_dofs(crossover)
    plant = motion_plant(testbed, parameters, design_pose)
    gains = {}
    for dof, frequency in crossover.items():
        low, high = INTEGRAL_ZERO * frequency, DERIVATIVE_ZERO * frequency
        shape = PidGains(kp=low + high, ki=low * high, kd=1.0)
        at_crossover = motion_loop(plant, dof, shape)(np.array([frequency]))
        kd = 1.0 / float(np.abs(at_crossover[0]))
        gains[dof] = PidGains(kp=kd * shape.kp, ki=kd * shape.ki, kd=kd)
        loop = motion_loop(plant, dof, gains[dof])
        _check_motion(dof, frequency, margins(loop, loop_frequencies(plant, frequency)))
    return gains


def motion_margins(
    testbed: Testbed,
    parameters: PlantParameters,
    design_pose: ArrayLike,
    gains: Mapping[Dof, PidGains],
) -> dict[Dof, Margins]:
    """Return each motion loop's margins on the motion plant (6-2), without derivative filter.

    Raises:
        InputError: the machine has no bar or cannot exert all controlled forces, or a DOF is not
            controlled.
        ConvergenceError: the bar cannot hang at the design pose.
    """
    _check_dofs(gains)
    model = motion_plant(testbed, parameters, design_pose)
    frequencies = loop_frequencies(model, MOTION_BANDWIDTH)
    plant = GridResponse(model, frequencies)
    return {dof: margins(motion_loop(plant, dof, g), frequencies) for dof, g in gains.items()}


def design_force_gains(
    testbed: Testbed, parameters: PlantParameters, design_pose: ArrayLike, bandwidth: float
) -> dict[str, PiGains]:
    """Return the PI per cable whose closed loop has −3 dB at `bandwidth` [rad/s].

    Raises:
        InputError: the machine has no bar, the bandwidth is above the thesis's limit, or a cable's
            loop would come near −180°.
        ConvergenceError: the bar cannot hang at the design pose.
    """
    if not 0.0 < bandwidth <= LARGEST_FORCE_BANDWIDTH:
        raise InputError(
            f"control.force.bandwidth: {bandwidth:g} rad/s, allowed: above 0 and at most"
            f" {LARGEST_FORCE_BANDWIDTH:g} rad/s"
        )
    model = tension_plant(testbed, parameters, design_pose)
    frequencies = loop_frequencies(model, bandwidth)
    plant = GridResponse(model, frequencies)
    responses = plant.response(frequencies)
    at_bandwidth = plant.response(bandwidth)[0]
    gains = {}
    for i, name in enumerate(testbed.cable_names):
        integral = _integral_frequency(name, frequencies, responses[:, i, i], bandwidth)
        shape = (1.0 + integral / (1j * bandwidth)) * at_bandwidth[i, i]
        # The root Kp > 0 of 2·|Kp·g|² = |1 + Kp·g|².
        kp = (shape.real + np.hypot(shape.real, np.abs(shape))) / np.abs(shape) ** 2
        gains[name] = PiGains(kp=float(kp), integral_frequency=integral)
        _check_force(name, bandwidth, margins(force_loop(plant, i, gains[name]), frequencies))
    return gains


def force_margins(
    testbed: Testbed,
    parameters: PlantParameters,
    design_pose: ArrayLike,
    gains: Mapping[str, PiGains],
) -> dict[str, Margins]:
    """Return each force loop's margins on the tension plant (6-6), the other torques held.

    Raises:
        InputError: the machine has no bar, or no such cable.
        ConvergenceError: the bar cannot hang at the design pose.
    """
    names = testbed.cable_names
    unknown = [name for name in gains if name not in names]
    if unknown:
        raise InputError(f"control.force.gains: {unknown[0]}, allowed: {', '.join(names)}")
    model = tension_plant(testbed, parameters, design_pose)
    frequencies = loop_frequencies(model, LARGEST_FORCE_BANDWIDTH)
    plant = GridResponse(model, frequencies)
    return {
        name: margins(force_loop(plant, names.index(name), gain), frequencies)
        for name, gain in gains.items()
    }


def check_separation(motion: Mapping[Dof, Margins], force: Mapping[str, Margins]) -> None:
    """Check that every force loop is fast enough for cables to look stiff to the motion loops.

    Raises:
        InputError: naming the slowest cable, the fastest DOF, and what is allowed.
    """
    dof = max(motion, key=lambda name: motion[name].bandwidth)
    cable = min(force, key=lambda name: force[name].bandwidth)
    least = BANDWIDTH_RATIO * motion[dof].bandwidth
    if force[cable].bandwidth < least:
        raise InputError(
            f"control.force: {cable} has a bandwidth of {force[cable].bandwidth:.4g} rad/s,"
            f" allowed: at least {least:.4g} rad/s, {BANDWIDTH_RATIO:g} times that of {dof}"
        )


def _refine(
    loop: Response, measure: Callable[[ComplexArray], Array], low: float, high: float
) -> float:
    def at(frequency: float) -> float:
        return float(measure(loop(np.array([frequency])))[0])

    ends = at(low), at(high)
    if ends[0] * ends[1] > 0.0:  # a root on the grid itself, rounded to either side of it
        return low if abs(ends[0]) < abs(ends[1]) else high
    return float(scipy.optimize.brentq(at, low, high, xtol=1e-10 * low))


def motion_plant(
    testbed: Testbed, parameters: PlantParameters, design_pose: ArrayLike
) -> StateSpace:
    """Return the motion sub-system (6-2) that the motion controller is designed on.

    Raises:
        InputError: the machine has no bar or cannot exert all controlled forces.
        ConvergenceError: the bar cannot hang at the design pose.
    """
    point = operating_point(testbed, parameters, design_pose)
    _check_rank(point)
    model = linear_model(testbed, parameters, point)
    return motion_subsystem(model, parameters, point, CONTROLLED_AXES)


def tension_plant(
    testbed: Testbed, parameters: PlantParameters, design_pose: ArrayLike
) -> StateSpace:
    """Return the tension sub-system (6-6) that the force controllers are designed on.

    Raises:
        InputError: the machine has no bar.
        ConvergenceError: the bar cannot hang at the design pose.
    """
    point = operating_point(testbed, parameters, design_pose)
    return tension_subsystem(linear_model(testbed, parameters, point))


def motion_loop(plant: StateSpace | GridResponse, dof: str, gains: PidGains) -> Response:
    """Return one DOF's open loop, PID without derivative filter on the motion sub-system."""
    output, column = DOFS.index(dof), CONTROLLED_DOFS.index(dof)

    def loop(frequencies: Array) -> ComplexArray:
        s = 1j * frequencies
        controller = gains.kp + gains.ki / s + gains.kd * s
        return np.asarray(controller * plant.response(frequencies)[:, output, column])

    return loop


def force_loop(plant: StateSpace | GridResponse, i: int, gains: PiGains) -> Response:
    """Return cable i's open loop, PI on the tension sub-system, the other torques held."""

    def loop(frequencies: Array) -> ComplexArray:
        controller = gains.kp * (1.0 + gains.integral_frequency / (1j * frequencies))
        return np.asarray(controller * plant.response(frequencies)[:, i, i])

    return loop


def loop_frequencies(plant: StateSpace, frequency: float) -> Array:
    """Return three decades around `frequency`, and every resonance, which may be sharp."""
    even = np.geomspace(1e-3 * frequency, 1e3 * frequency, 6 * POINTS_PER_DECADE)
    resonances = np.abs(np.linalg.eigvals(plant.A))
    return np.union1d(even, resonances[(resonances > even[0]) & (resonances < even[-1])])


def _integral_frequency(
    name: str, frequencies: Array, response: ComplexArray, bandwidth: float
) -> float:
    room = np.unwrap(np.angle(response)) - LOWEST_PHASE
    if room.min() <= 0.0:
        raise InputError(
            f"control.force: {name}'s tension falls {np.degrees(-LOWEST_PHASE - room.min()):.0f}°"
            f" behind its torque at {frequencies[room.argmin()]:.4g} rad/s, allowed: less than"
            f" {np.degrees(-LOWEST_PHASE):.0f}°"
        )
    lag = room < 0.5 * np.pi  # elsewhere any integral frequency will do
    largest = LARGEST_INTEGRAL_SHARE * bandwidth
    return float(np.min(frequencies[lag] * np.tan(room[lag]), initial=largest))


def _check_dofs(given: Mapping[Dof, object]) -> None:
    unknown = [dof for dof in given if dof not in CONTROLLED_DOFS]
    if unknown:
        allowed = ", ".join(CONTROLLED_DOFS)
        raise InputError(f"control.motion: {unknown[0]} is not controlled, allowed: {allowed}")


def _check_rank(point: OperatingPoint) -> None:
    structure = point.jacobian[:, list(CONTROLLED_AXES)]
    rank = int(np.linalg.matrix_rank(structure, rtol=RANK_TOLERANCE))
    if rank < len(CONTROLLED_AXES):
        raise InputError(
            f"control.motion: the cables span {rank} of the wrench's {len(CONTROLLED_AXES)}"
            f" controlled directions {', '.join(CONTROLLED_DOFS)} at the design pose, allowed: all"
        )


def _check_motion(dof: str, frequency: float, found: Margins) -> None:
    checks = (
        ("phase margin", np.degrees(found.phase_margin), np.degrees(PHASE_MARGIN), "°"),
        ("gain margin", found.gain_margin, GAIN_MARGIN, " dB"),
        ("low-frequency gain", found.low_frequency_gain, LOW_FREQUENCY_GAIN, " dB"),
        ("bandwidth", found.bandwidth, MOTION_BANDWIDTH, " rad/s"),
    )
    for name, value, least, unit in checks:
        if value < least:
            raise InputError(
                f"control.motion.crossover: {dof} at {frequency:g} rad/s has a {name} of"
                f" {value:.3g}{unit}, allowed: at least {least:.3g}{unit}"
            )


def _check_force(name: str, bandwidth: float, found: Margins) -> None:
    if abs(found.bandwidth - bandwidth) > 1e-3 * bandwidth:
        raise InputError(
            f"control.force.bandwidth: at {bandwidth:g} rad/s the loop of {name} already falls"
            f" below −3 dB at {found.bandwidth:.4g} rad/s, allowed: a bandwidth above the"
            " resonances of the cables"
        )
