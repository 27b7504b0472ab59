"""The thesis's two cascaded loops as they run: sampled, delayed, one inside the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cspm_control.analysis.sampled_system import SampledSystem, closed, diagonal, sample, series
from cspm_model.equilibrium import gravity_wrench
from cspm_model.kernels.cable import RADIUS
from cspm_model.kernels.machine import PlantParameters
from cspm_model.kinematics import RANK_TOLERANCE, geometry
from cspm_model.linearisation import OperatingPoint, StateSpace
from cspm_msgs_py.control_spec.force import PiGains
from cspm_msgs_py.dofs import CONTROLLED_AXES, DOFS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import MotionControl, PidGains, Rates, Scenario
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]

POSE = slice(0, 6)
# Step of the pose in differencing the tension distribution [m, rad].
POSE_STEP = 1e-6
# How far from a whole number of periods a time may be, for round-off.
WHOLE = 1e-6


@dataclass(frozen=True)
class LoopTiming:
    """How often the controllers run and how late everything comes, in periods of the plant.

    Attributes:
        period: of the plant [s].
        force: from one step of the force controllers to the next.
        motion: the same of motion controller and tension distribution.
        tension_delay: from the instant a load cell shows to its message.
        pose_delay: the same of the bar's pose.
        torque_delay: from the messages that a torque is computed of to when it acts.
    """

    period: float
    force: int
    motion: int
    tension_delay: int
    pose_delay: int
    torque_delay: int


def sensor_delays(scenario: Scenario, testbed: Testbed) -> dict[str, float]:
    """Return the delays of a scenario's sensors [s], by topic; ideal ones have none."""
    ideal = scenario.sensors == "ideal"
    return {} if ideal else {name: each.delay for name, each in testbed.sensors.items()}


def timing_of(scenario: Scenario, testbed: Testbed, computing: float) -> LoopTiming:
    """Return the timing of a scenario's loops; `computing` from measurement to torque [s].

    Raises:
        InputError: the rates or the time are none that the analysis can follow.
    """
    return loop_timing(scenario.rates, sensor_delays(scenario, testbed), computing)


def loop_timing(rates: Rates, delays: Mapping[str, float], computing: float) -> LoopTiming:
    """Return the timing of a scenario.

    Args:
        rates: the scenario's.
        delays: of sensors [s], by topic.
        computing: time from the measurement to the torque [s].

    Raises:
        InputError: the rates or the time are none that this analysis can follow.
    """
    if abs(computing * rates.plant - round(computing * rates.plant)) > WHOLE:
        raise InputError(
            f"computing: {computing:g} s, allowed: a whole number of the plant's periods of"
            f" {1.0 / rates.plant:g} s"
        )
    _check_rates(rates)
    return LoopTiming(
        period=1.0 / rates.plant,
        force=rates.plant // rates.force_controller,
        motion=rates.plant // rates.motion_controller,
        tension_delay=round(delays.get("/cables/tension", 0.0) * rates.plant),
        pose_delay=round(delays.get("/bar/pose", 0.0) * rates.plant),
        torque_delay=round(computing * rates.plant),
    )


def _check_rates(rates: Rates) -> None:
    if rates.tension_distribution != rates.motion_controller:
        raise InputError(
            f"rates.tension_distribution: {rates.tension_distribution} Hz, allowed here: that of"
            f" the motion controller, {rates.motion_controller} Hz"
        )
    if rates.force_controller % rates.motion_controller:
        raise InputError(
            f"rates.motion_controller: {rates.motion_controller} Hz, allowed here: a divisor of"
            f" the force controllers' {rates.force_controller} Hz"
        )
    for key in ("motion_capture", "load_cells"):
        needed = rates.motion_controller if key == "motion_capture" else rates.force_controller
        if getattr(rates, key) % needed:
            raise InputError(
                f"rates.{key}: {getattr(rates, key)} Hz, allowed here: a multiple of the"
                f" {needed} Hz of what reads it"
            )


def pi_system(gains: PiGains, period: float) -> SampledSystem:
    """Return the force controller of `force_controller.py`, which adds up afterwards."""
    step = gains.kp * gains.integral_frequency * period
    one = np.ones((1, 1))
    return SampledSystem(one, step * one, one, gains.kp * one, period)


def pid_system(gains: PidGains, pole: float, period: float) -> SampledSystem:
    """Return the PID of `motion_controller.py`: states integral, derivative, last error.

    The integral counts the present error; the derivative is a backward difference through `pole`.
    """
    fade = 1.0 / (1.0 + pole * period)
    a = np.array([[1.0, 0.0, 0.0], [0.0, fade, -pole * fade], [0.0, 0.0, 0.0]])
    b = np.array([[gains.ki * period], [pole * fade], [1.0]])
    c = np.array([[1.0, gains.kd * fade, -gains.kd * pole * fade]])
    d = np.array([[gains.kp + gains.ki * period + gains.kd * pole * fade]])
    return SampledSystem(a, b, c, d, period)


def force_plant_sampled(plant: StateSpace, timing: LoopTiming) -> SampledSystem:
    """Return the tension sub-system (6-6) as sampled force controllers see it."""
    late = np.full(len(plant.C), timing.tension_delay)
    sampled = sample(plant.A, plant.B, plant.C, timing.period).late(timing.torque_delay, late)
    return sampled.every(timing.force)


def motion_plant_sampled(plant: StateSpace, timing: LoopTiming) -> SampledSystem:
    """Return the motion sub-system (6-2) as a sampled motion controller sees it, cables rigid."""
    late = np.full(len(plant.C), timing.pose_delay)
    sampled = sample(plant.A, plant.B, plant.C, timing.period).late(timing.torque_delay, late)
    return sampled.every(timing.motion)


def cascade_plant(
    model: StateSpace,
    parameters: PlantParameters,
    point: OperatingPoint,
    pose_rows: Array,
    timing: LoopTiming,
    force: Mapping[str, PiGains],
    axes: Sequence[int] = CONTROLLED_AXES,
) -> SampledSystem:
    """Return wanted wrench to measured pose with force loops and tension distribution at work.

    The distribution takes the pose that is measured, so that it follows the cables as they turn.

    Args:
        model: of `linear_model`.
        parameters: the machine's kernel parameters.
        point: the model's operating point.
        pose_rows: from states to the pose x y z φ θ ψ, (6, states).
        timing: of the loops.
        force: gains per cable, in the machine's order.
        axes: world axes of the wrench that the tensions meet.
    """
    cables = len(point.tensions)
    outputs = np.vstack([pose_rows, model.C[-cables:]])
    late = np.repeat([timing.pose_delay, timing.tension_delay], [6, cables])
    sampled = sample(model.A, model.B, outputs, timing.period).late(timing.torque_delay, late)
    seen = sampled.every(timing.force)
    ignoring = _nothing(6, seen.period)
    controllers = diagonal([ignoring, *(pi_system(g, seen.period) for g in force.values())])
    loops = closed(seen, controllers)
    radii = parameters.cables[:, RADIUS]
    ahead = np.diag([each.feedforward for each in force.values()] * radii)
    loops.B[len(controllers.A) :, 6:] += seen.B @ ahead
    inner = loops.part(POSE, slice(6, None)).every(timing.motion // timing.force)
    per_wrench, per_pose = distribution_slopes(parameters, point, axes)
    return SampledSystem(
        inner.A + inner.B @ per_pose @ inner.C,
        inner.B @ per_wrench,
        inner.C,
        np.zeros((6, len(axes))),
        inner.period,
    )


def distribution_slopes(
    parameters: PlantParameters, point: OperatingPoint, axes: Sequence[int] = CONTROLLED_AXES
) -> tuple[Array, Array]:
    """Return ∂t/∂wrench (n, m) and ∂t/∂pose (n, 6) of the pseudo-inverse holding the weight.

    The latter, with Euler angles, by central differences. `axes` (m,) are those of the wrench.
    """
    rows = list(axes)

    def inverse(pose: Array) -> Array:
        jacobian = geometry(parameters.cables, pose, point.frame_pose).bar
        return -np.linalg.pinv(jacobian[:, rows].T, rcond=RANK_TOLERANCE)

    def tensions(pose: Array) -> Array:
        return inverse(pose) @ -gravity_wrench(parameters, pose)[rows]

    pairs = [
        (tensions(point.bar_pose + step), tensions(point.bar_pose - step))
        for step in POSE_STEP * np.eye(6)
    ]
    slopes = np.array([(high - low) / (2.0 * POSE_STEP) for high, low in pairs]).T
    return inverse(point.bar_pose), slopes


def motion_controllers(
    motion: MotionControl,
    period: float,
    axes: Sequence[int] = CONTROLLED_AXES,
    without: str = "",
) -> SampledSystem:
    """Return the PIDs from the six pose errors to the wrench along `axes`, one of them left out."""
    still = PidGains(kp=0.0, ki=0.0, kd=0.0)
    kept = {str(dof): each for dof, each in (motion.gains or {}).items() if dof != without}
    each = [
        pid_system(kept.get(DOFS[axis], still), motion.derivative_filter, period) for axis in axes
    ]
    chosen = np.eye(6)[list(axes)]
    chooser = SampledSystem(
        np.zeros((0, 0)), np.zeros((0, 6)), np.zeros((len(chosen), 0)), chosen, period
    )
    return series(chooser, diagonal(each))


def _nothing(inputs: int, period: float) -> SampledSystem:
    """Return what gives no outputs for its inputs: as a block, it leaves these inputs out."""
    none, ignored = np.zeros((0, 0)), np.zeros((0, inputs))
    return SampledSystem(none, ignored, none, ignored, period)
