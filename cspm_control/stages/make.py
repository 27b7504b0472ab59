"""From scenario and test-bed to controllers."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from cspm_control.allocation.lost_cables import LostCables
from cspm_control.allocation.tension_distribution import TensionDistribution
from cspm_control.controllers.angle_servo import AngleGenerator, AngleServo
from cspm_control.controllers.bar_dynamics import bar_parameters
from cspm_control.controllers.computed_wrench import ComputedWrench
from cspm_control.controllers.dither import make_dither
from cspm_control.controllers.force_controller import ForceController
from cspm_control.controllers.governor import Governed, plan_deviation
from cspm_control.controllers.load_cell_bias import LoadCellBias
from cspm_control.controllers.mass_observer import MassObserver
from cspm_control.controllers.motion_controller import MotionController
from cspm_control.controllers.state_feedback import StateFeedback
from cspm_control.controllers.torque_profile import TorqueGenerator
from cspm_control.feedforward.friction_feedforward import FrictionFeedforward, winch_friction
from cspm_control.feedforward.winch_feedforward import WinchFeedforward
from cspm_control.safe_state import make_safe_state
from cspm_control.stages.angle_stage import AngleStage
from cspm_control.stages.distribution_stage import DistributionStage
from cspm_control.stages.force_stage import ForceLimits, ForceStage
from cspm_control.stages.motion_stage import MotionStage
from cspm_control.stages.target_stage import target_stage
from cspm_control.stages.torque_stage import TorqueStage
from cspm_model.kernels.cable import INERTIA, RADIUS
from cspm_model.motion import Motion
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.dofs import CONTROLLED_AXES, DOFS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import (
    AngleProfile,
    ClosedLoop,
    ComputedWrenchControl,
    Governor,
    MotionControl,
    Scenario,
    TorqueProfile,
)
from cspm_msgs_py.scenario_keys.bodies import ORIGIN
from cspm_msgs_py.schedule import (
    BAR_POSE,
    BAR_REFERENCE,
    FORCE_CONTROLLER,
    FRAME_REFERENCE,
    MOTION_CONTROLLER,
    TARGET_TRACKER,
    TENSION_DISTRIBUTION,
    schedule_of,
)
from cspm_msgs_py.stepping.stage import Stage
from cspm_msgs_py.testbed import Bar, Testbed

# A measured tension beyond this many times a cable's upper limit trips, unless the scenario says.
TRIP_FACTOR = 2.0
# After so many time constants what the pose's observer leaves unexplained is believed.
SETTLING = 5.0
# At this rate the speed of a winch without its cable dies out [1/s]: its torque stays within the
# motor's limit from any speed that it reaches until it is released.
RELEASE_RATE = 10.0


def make_controller(
    node: str, scenario: Scenario, testbed: Testbed, motions: Mapping[str, Motion] | None = None
) -> Stage:
    """Return the controller that `node` runs in a resolved scenario.

    `motions` are those of bar and winch frame, by reference topic; a governor plans with them.

    Raises:
        InputError: this scenario has no such controller.
        ConvergenceError: a governor finds no plan.
    """
    control = scenario.control
    if isinstance(control, TorqueProfile) and node == FORCE_CONTROLLER:
        return torque_stage(control, scenario, testbed)
    if isinstance(control, AngleProfile) and node == FORCE_CONTROLLER:
        return angle_stage(control, scenario, testbed)
    if node == TARGET_TRACKER and scenario.target.is_measured:
        return target_stage(scenario)
    if isinstance(control, ClosedLoop) and node == MOTION_CONTROLLER:
        return motion_stage(control, scenario, testbed, motions)
    makers: dict[str, Callable[[ClosedLoop, Scenario, Testbed], Stage]] = {
        TENSION_DISTRIBUTION: distribution_stage,
        FORCE_CONTROLLER: force_stage,
    }
    if not isinstance(control, ClosedLoop) or node not in makers:
        raise InputError(f"node {node}: scenario {scenario.name} ({control.mode}) has none")
    return makers[node](control, scenario, testbed)


def motion_stage(
    control: ClosedLoop,
    scenario: Scenario,
    testbed: Testbed,
    motions: Mapping[str, Motion] | None = None,
) -> MotionStage:
    """Return the motion controller, which without `motions` has no governor."""
    motion = control.motion
    if testbed.bar is None:
        raise InputError(
            "control.mode: closed_loop without a bar, allowed: torque, angle, locked_winches"
        )
    period = 1.0 / scenario.rates.motion_controller
    if isinstance(motion, ComputedWrenchControl):
        computed = ComputedWrench(
            motion.bandwidth,
            testbed,
            tension_distribution(control, testbed),
            observer_bandwidth=motion.observer_bandwidth,
            period=period,
            steps_per_pose=max(
                1, scenario.rates.motion_controller // scenario.rates.motion_capture
            ),
            pose_age=_pose_age(scenario, testbed),
            known_wrench=motion.known_wrench,
            mass=mass_observer(motion, testbed.bar, period),
        )
        planned = _planned(motion.governor, scenario, testbed, motions)
        return MotionStage(computed, planned, internals=control.record_internals)
    feedback = MotionController if isinstance(motion, MotionControl) else StateFeedback
    return MotionStage(
        feedback(
            motion.gains or {},
            testbed.bar,
            testbed.gravity,
            period=period,
            derivative_filter=motion.derivative_filter,
            integral_limits=motion.integral_limits,
        ),
        internals=control.record_internals,
    )


def mass_observer(motion: ComputedWrenchControl, bar: Bar, period: float) -> MassObserver | None:
    """Return the observer of the bar's mass at `period` [s], where the scenario wants it."""
    if motion.mass_adaptation is None:
        return None
    settling = SETTLING / motion.observer_bandwidth
    return MassObserver(bar.mass, motion.mass_adaptation.largest, period=period, settling=settling)


def _pose_age(scenario: Scenario, testbed: Testbed) -> float:
    """Return how old the bar's pose is when the motion controller first computes with it [s]."""
    schedule = schedule_of(scenario, testbed)
    first = schedule.nodes[MOTION_CONTROLLER].first
    stamped = schedule.topics[BAR_POSE].latest(first)
    return 0.0 if stamped is None else 1e-9 * schedule.period_ns * (first - stamped)


def _planned(
    governor: Governor | None,
    scenario: Scenario,
    testbed: Testbed,
    motions: Mapping[str, Motion] | None,
) -> Motion | None:
    control = scenario.control
    if governor is None or motions is None:
        return None
    assert isinstance(control, ClosedLoop)
    limits = planned_tension_limits(control, governor, testbed)
    return plan_deviation(
        governed(scenario, testbed, limits),
        motions[BAR_REFERENCE],
        motions[FRAME_REFERENCE],
        scenario.duration,
        governor.preview,
        governor.excess_weight,
    )


def governed(scenario: Scenario, testbed: Testbed, limits: NDArray[np.float64]) -> Governed:
    """Return what a governor plans for, with planned tensions within limits (n, 2) [N]."""
    assert isinstance(scenario.control, ClosedLoop)
    assert testbed.bar is not None
    requirement = scenario.requirement
    return Governed(
        nominal_parameters(testbed).cables,
        bar_parameters(testbed.bar, testbed.gravity),
        limits,
        controlled_axes(scenario.control),
        np.array([requirement.position] * 3 + [requirement.angle] * 3),
        known_wrench(scenario.control),
    )


def planned_tension_limits(
    control: ClosedLoop, governor: Governor, testbed: Testbed
) -> NDArray[np.float64]:
    """Return between what planned tensions stay, (n, 2) [N].

    Raises:
        InputError: the reserve leaves nothing between a cable's limits.
    """
    limits = wanted_tension_limits(control, testbed)
    limits[:, 0] += governor.reserve
    closed = np.flatnonzero(limits[:, 0] >= limits[:, 1])
    if len(closed):
        raise InputError(
            f"control.motion.governor.reserve: {governor.reserve:g} N, allowed: less than what is"
            f" between the tension limits of {testbed.cable_names[closed[0]]}"
        )
    return limits


def distribution_stage(
    control: ClosedLoop, scenario: Scenario, testbed: Testbed
) -> DistributionStage:
    """Return the tension distribution."""
    solver = tension_distribution(control, testbed)
    lost = lost_cables(control, testbed, scenario.rates.tension_distribution)
    return DistributionStage(solver, testbed.cable_names, lost, internals=control.record_internals)


def lost_cables(control: ClosedLoop, testbed: Testbed, rate: int) -> LostCables | None:
    """Return what knows lost cables at `rate` [Hz], where the scenario wants it.

    Raises:
        InputError: a whole cable may have as little tension as a lost one.
    """
    wanted = control.tension_distribution.lost_cable
    if wanted is None:
        return None
    lowest = wanted_tension_limits(control, testbed)[:, 0]
    i = int(np.argmin(lowest))
    if lowest[i] <= wanted.below:
        raise InputError(
            f"control.tension_distribution.lost_cable.below: {wanted.below:g} N, allowed: less"
            f" than the lower tension limit of {testbed.cable_names[i]}, {lowest[i]:g} N"
        )
    steps = max(1, round(wanted.duration * rate))
    return LostCables(len(lowest), wanted.below, steps, len(controlled_axes(control)))


def tension_distribution(control: ClosedLoop, testbed: Testbed) -> TensionDistribution:
    """Return what turns a wrench into tensions."""
    return TensionDistribution(
        nominal_parameters(testbed).cables,
        wanted_tension_limits(control, testbed),
        control.tension_distribution,
        controlled_axes(control),
        control.motion.design_pose,
    )


def controlled_axes(control: ClosedLoop) -> tuple[int, ...]:
    """Return the world axes in which the wrench is to be met.

    A recording from before the distribution had `axes` meets roll only where it is controlled.
    """
    axes = control.tension_distribution.axes
    if axes is not None:
        return tuple(DOFS.index(dof) for dof in axes)
    return tuple(range(6)) if "roll" in control.motion.controlled else CONTROLLED_AXES


def known_wrench(control: ClosedLoop) -> NDArray[np.float64]:
    """Return the constant wrench on the bar that the law is given, (6,) [N, N·m], or zero."""
    motion = control.motion
    known = motion.known_wrench if isinstance(motion, ComputedWrenchControl) else ORIGIN
    return np.array(known, dtype=float)


def wanted_tension_limits(control: ClosedLoop, testbed: Testbed) -> NDArray[np.float64]:
    """Return between what wanted tensions stay, (n, 2) [N].

    Raises:
        InputError: the scenario's lower limit is not below an upper one.
    """
    limits = np.array([cable.tension_limits for cable in testbed.cables], dtype=float)
    lower = control.tension_distribution.lower_limit
    if lower is not None:
        limits[:, 0] = lower
    closed = [
        cable.name for cable, (low, high) in zip(testbed.cables, limits, strict=True) if low >= high
    ]
    if closed:
        raise InputError(
            f"control.tension_distribution.lower_limit: {lower:g} N, allowed: below the upper"
            f" limit of {closed[0]}"
        )
    return limits


def force_stage(control: ClosedLoop, scenario: Scenario, testbed: Testbed) -> ForceStage:
    """Return the force controllers."""
    rate = scenario.rates.force_controller
    tensions = wanted_tension_limits(control, testbed)
    safety = scenario.safety
    limits = ForceLimits(
        tensions,
        tension_trips(scenario, testbed),
        None if safety.torque_slew is None else safety.torque_slew / rate,
    )
    radii = nominal_parameters(testbed).cables[:, RADIUS].copy()
    torque_limits = np.array([cable.torque_limit for cable in testbed.cables])
    dither, names = control.force.dither, testbed.cable_names
    gains = control.force.gains_of(names)
    return ForceStage(
        ForceController(gains, radii, torque_limits, period=1.0 / rate),
        limits,
        names,
        make_safe_state(scenario, testbed),
        safety,
        1_000_000_000 // rate,
        load_cell_bias(control, testbed, 1.0 / rate),
        friction_feedforward(control, testbed),
        winch_feedforward(control, testbed, 1.0 / rate),
        None if dither is None else make_dither(dither, names, torque_limits, rate),
        release_damping(control, testbed),
        internals=control.record_internals,
    )


def release_damping(control: ClosedLoop, testbed: Testbed) -> NDArray[np.float64] | None:
    """Return what brings released winches to rest, (n,) [N·m·s/rad], where any are released."""
    if control.tension_distribution.lost_cable is None:
        return None
    return RELEASE_RATE * nominal_parameters(testbed).cables[:, INERTIA]


def load_cell_bias(control: ClosedLoop, testbed: Testbed, period: float) -> LoadCellBias | None:
    """Return the observer of load cell biases at `period` [s], where the scenario wants it."""
    wanted = control.force.load_cell_bias
    if wanted is None:
        return None
    cables = nominal_parameters(testbed).cables
    radii, inertias = cables[:, RADIUS].copy(), cables[:, INERTIA].copy()
    return LoadCellBias(radii, inertias, wanted.largest, period=period)


def friction_feedforward(control: ClosedLoop, testbed: Testbed) -> FrictionFeedforward | None:
    """Return what goes ahead of the winches' friction, where the scenario wants it.

    Raises:
        InputError: the test-bed's file has no friction.
    """
    wanted = control.force.friction_feedforward
    if wanted is None:
        return None
    cables = nominal_parameters(testbed).cables
    return FrictionFeedforward(cables, winch_friction(testbed), wanted.smooth_below)


def winch_feedforward(
    control: ClosedLoop, testbed: Testbed, period: float
) -> WinchFeedforward | None:
    """Return what goes ahead of the winches every `period` [s], where the scenario wants it."""
    wanted = control.force.winch_feedforward
    if wanted is None:
        return None
    return WinchFeedforward(nominal_parameters(testbed), wanted.stretch_bandwidth, period=period)


def torque_stage(control: TorqueProfile, scenario: Scenario, testbed: Testbed) -> TorqueStage:
    """Return the prescribed torques, one for each of the plant's periods."""
    return TorqueStage(
        TorqueGenerator(control.torque, testbed.cable_names),
        np.array([cable.wound_radius for cable in testbed.cables]),
        make_safe_state(scenario, testbed),
        scenario.safety,
        1_000_000_000 // scenario.rates.plant,
    )


def angle_stage(control: AngleProfile, scenario: Scenario, testbed: Testbed) -> AngleStage:
    """Return the position servos.

    Raises:
        InputError: a path names no cable, or the bandwidth is beyond what the rate allows.
    """
    cables, rate = testbed.cables, scenario.rates.force_controller
    return AngleStage(
        AngleGenerator(control.angle, testbed.cable_names),
        AngleServo(
            np.array([cable.rotor_inertia for cable in cables]),
            np.array([cable.torque_limit for cable in cables]),
            control.bandwidth,
            period=1.0 / rate,
        ),
        np.array([cable.wound_radius for cable in cables]),
        tension_trips(scenario, testbed),
        testbed.cable_names,
        make_safe_state(scenario, testbed),
        scenario.safety,
        1_000_000_000 // rate,
    )


def tension_trips(scenario: Scenario, testbed: Testbed) -> NDArray[np.float64]:
    """Return the highest tension that each load cell may show while all is well, (n,) [N]."""
    trip = scenario.safety.tension_trip
    limits = [cable.tension_limits or (0.0, np.inf) for cable in testbed.cables]
    return np.array([TRIP_FACTOR * most if trip is None else trip for _, most in limits])
