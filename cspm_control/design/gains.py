"""Controller gains by the thesis's procedure (chapter 7), and the margins of their loops.

Both designs see the linear model with frozen cable directions of chapter 6, one loop at a time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cspm_control.design.drive_limited import motion_plant_of_slow_loops
from cspm_control.design.margins import (
    ComplexArray,
    GridResponse,
    Margins,
    Response,
    loop_frequencies,
    margins,
)
from cspm_control.design.widest_loop import Axis, LoopRequirement, widest_loop
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
from cspm_msgs_py.control_spec.force import PiGains
from cspm_msgs_py.dofs import CONTROLLED_AXES, DOFS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import PidGains
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]
Dof = TypeVar("Dof", bound=str)

# Zeros of a PID whose crossover is wanted, as shares of it: integral action below the first,
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

# Margins are interpolated on this grid while the widest loop is looked for: within 0.02 dB.
DESIGN_POINTS_PER_DECADE = 240


def design_motion_gains(
    testbed: Testbed,
    parameters: PlantParameters,
    design_pose: ArrayLike,
    crossover: Mapping[Dof, float],
    axes: Sequence[int] = CONTROLLED_AXES,
) -> dict[Dof, PidGains]:
    """Return the PID per DOF with |L| = 1 at its crossover and zeros in fixed ratio to it.

    Args:
        testbed: the machine.
        parameters: its kernel parameters.
        design_pose: the bar's pose x y z φ θ ψ with the winch frame at the origin.
        crossover: wanted crossover frequency per DOF [rad/s].
        axes: world axes of the wrench that the tensions meet.

    Raises:
        InputError: the machine has no bar or cannot exert all controlled forces, a DOF is not
            controlled, or its loop misses a requirement of the thesis.
        ConvergenceError: the bar cannot hang at the design pose.
    """
    _check_dofs(crossover, axes)
    if not crossover:
        return {}
    plant = motion_plant(testbed, parameters, design_pose, axes)
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


def design_widest_gains(
    testbed: Testbed,
    parameters: PlantParameters,
    design_pose: ArrayLike,
    dofs: Sequence[Dof],
    *,
    dead_time: float,
    force_bandwidth: float,
    force_gains: Mapping[str, PiGains] | None = None,
    axes: Sequence[int] = CONTROLLED_AXES,
) -> dict[Dof, PidGains]:
    """Return the PID of largest crossover per DOF, by the procedure of section 7-1.

    Args:
        testbed: the machine.
        parameters: its kernel parameters.
        design_pose: the bar's pose x y z φ θ ψ with the winch frame at the origin.
        dofs: whose loops to design.
        dead_time: what sampling and sensors delay the loop by [s].
        force_bandwidth: of the slowest force loop [rad/s], ten times what a motion loop may have.
        force_gains: of the force loops, which count where one is slow: where its torque goes ahead.
        axes: world axes of the wrench that the tensions meet.

    Raises:
        InputError: the machine has no bar or cannot exert all controlled forces, a DOF is not
            controlled, or no PID of it meets the requirements.
        ConvergenceError: the bar cannot hang at the design pose.
    """
    _check_dofs(dict.fromkeys(dofs), axes)
    if not dofs:
        return {}
    plant = motion_plant(testbed, parameters, design_pose, axes, force_gains)
    frequencies = loop_frequencies(plant, MOTION_BANDWIDTH, DESIGN_POINTS_PER_DECADE)
    responses = plant.response(frequencies) * np.exp(-1j * frequencies * dead_time)[:, None, None]
    requirement = LoopRequirement(
        PHASE_MARGIN, GAIN_MARGIN, LOW_FREQUENCY_GAIN, force_bandwidth / BANDWIDTH_RATIO
    )
    places = {dof: (DOFS.index(dof), wrench_column(plant, dof)) for dof in dofs}
    return {
        dof: widest_loop(dof, Axis(frequencies, responses[:, output, column]), requirement)
        for dof, (output, column) in places.items()
    }


def motion_margins(
    testbed: Testbed,
    parameters: PlantParameters,
    design_pose: ArrayLike,
    gains: Mapping[Dof, PidGains],
    axes: Sequence[int] = CONTROLLED_AXES,
) -> dict[Dof, Margins]:
    """Return each motion loop's margins on the motion plant (6-2), without derivative filter.

    `axes` are the world axes of the wrench that the tensions meet.

    Raises:
        InputError: the machine has no bar or cannot exert all controlled forces, or a DOF is not
            controlled.
        ConvergenceError: the bar cannot hang at the design pose.
    """
    _check_dofs(gains, axes)
    model = motion_plant(testbed, parameters, design_pose, axes)
    frequencies = loop_frequencies(model, MOTION_BANDWIDTH)
    plant = GridResponse(model, frequencies)
    return {dof: margins(motion_loop(plant, dof, g), frequencies) for dof, g in gains.items()}


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


def motion_plant(
    testbed: Testbed,
    parameters: PlantParameters,
    design_pose: ArrayLike,
    axes: Sequence[int] = CONTROLLED_AXES,
    force_gains: Mapping[str, PiGains] | None = None,
) -> StateSpace:
    """Return the motion sub-system (6-2) that the motion controller is designed on.

    `axes` are the world axes of the wrench that the tensions meet, its inputs. Force loops that
    are slow, those whose torque goes ahead, are part of it.

    Raises:
        InputError: the machine has no bar or cannot exert all controlled forces.
        ConvergenceError: the bar cannot hang at the design pose.
    """
    point = operating_point(testbed, parameters, design_pose)
    _check_rank(point, axes)
    model = linear_model(testbed, parameters, point)
    gains = [force_gains[name] for name in testbed.cable_names] if force_gains else []
    if any(each.feedforward for each in gains):
        return motion_plant_of_slow_loops(model, parameters, point, gains, axes)
    return motion_subsystem(model, parameters, point, axes)


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
    output, column = DOFS.index(dof), wrench_column(plant, dof)

    def loop(frequencies: Array) -> ComplexArray:
        s = 1j * frequencies
        controller = gains.kp + gains.ki / s + gains.kd * s
        return np.asarray(controller * plant.response(frequencies)[:, output, column])

    return loop


def wrench_column(plant: StateSpace | GridResponse, dof: str) -> int:
    """Return which input of a motion sub-system is the wrench along a DOF."""
    return plant.inputs.index(f"wrench {dof}")


def force_loop(plant: StateSpace | GridResponse, i: int, gains: PiGains) -> Response:
    """Return cable i's open loop, PI on the tension sub-system, the other torques held."""

    def loop(frequencies: Array) -> ComplexArray:
        controller = gains.kp * (1.0 + gains.integral_frequency / (1j * frequencies))
        return np.asarray(controller * plant.response(frequencies)[:, i, i])

    return loop


def _check_dofs(given: Mapping[Dof, object], axes: Sequence[int]) -> None:
    possible = [DOFS[axis] for axis in axes]
    unknown = [dof for dof in given if dof not in possible]
    if unknown:
        raise InputError(
            f"control.motion: {unknown[0]} is not controlled, allowed: {', '.join(possible)}"
        )


def _check_rank(point: OperatingPoint, axes: Sequence[int]) -> None:
    structure = point.jacobian[:, list(axes)]
    rank = int(np.linalg.matrix_rank(structure, rtol=RANK_TOLERANCE))
    if rank < len(axes):
        names = ", ".join(DOFS[axis] for axis in axes)
        raise InputError(
            f"control.motion: the cables span {rank} of the wrench's {len(axes)}"
            f" controlled directions {names} at the design pose, allowed: all"
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
