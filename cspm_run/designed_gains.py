"""The gains that a scenario leaves open, designed for its machine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache

from cspm_control.analysis.sampled_loops import sensor_delays
from cspm_control.design.force_gains import design_force_gains
from cspm_control.design.gains import (
    BANDWIDTH_RATIO,
    MOTION_BANDWIDTH,
    check_separation,
    design_motion_gains,
    design_widest_gains,
    force_margins,
    motion_margins,
)
from cspm_control.design.state_feedback import design_feedback_gains
from cspm_control.stages.make import controlled_axes
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.control_spec.force import FORCE_BANDWIDTH
from cspm_msgs_py.dofs import Dof
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import (
    ClosedLoop,
    FeedbackControl,
    MotionControl,
    PidGains,
    Scenario,
)
from cspm_msgs_py.schedule import BAR_POSE, TENSION
from cspm_msgs_py.testbed import Testbed
from cspm_run.stability.loop_growth import loop_growth

# By what the bandwidth is lowered, step by step, where the loops are not stable together; and by
# what their gains may then rise at once: the 6 dB of one loop.
LOWERED, SPARE_GAIN = 0.8, 2.0
# Machines and controllers whose gains are kept: runs that differ in their seeds share a design.
_KEPT = 64


@dataclass(frozen=True)
class _Question:
    """What gains depend on; equal where its text is."""

    text: str
    control: ClosedLoop = field(compare=False)
    scenario: Scenario = field(compare=False)
    testbed: Testbed = field(compare=False)


def with_gains(control: ClosedLoop, scenario: Scenario, testbed: Testbed) -> ClosedLoop:
    """Return a closed loop whose missing gains are designed.

    Args:
        control: the scenario's, with its controlled DOFs.
        scenario: whose rates and sensors count.
        testbed: the machine.

    Raises:
        InputError: no gains meet what is asked for.
    """
    # Half the nodes of a run need no parameters, for which scipy's integrators have to be loaded.
    if control.force.gains and not _lacks_gains(control.motion):
        return control
    described = (control, scenario.rates, testbed)
    text = "\n".join([*(each.model_dump_json() for each in described), scenario.sensors])
    return _designed(_Question(text, control, scenario, testbed))


def _lacks_gains(motion: object) -> bool:
    if not isinstance(motion, MotionControl | FeedbackControl):
        return False
    return set(motion.gains or {}) < set(motion.controlled)


@lru_cache(maxsize=_KEPT)
def _designed(question: _Question) -> ClosedLoop:
    """Return the control with its gains.

    Where a file gives none, and those of fast force loops are not stable together or leave the
    motion none, force loops are slow.

    Raises:
        InputError: no gains meet what is asked for.
    """
    known = question.scenario, question.testbed
    try:
        fast = _with_designed(question, slow=False)
    except InputError:
        if not _is_open(question.control):
            raise
        return _with_designed(question, slow=True)
    if not _is_open(question.control) or not _grows(fast, *known):
        return fast
    try:
        slow = _with_designed(question, slow=True)
    except InputError:
        return fast
    return fast if _grows(slow, *known) else slow


def _is_open(control: ClosedLoop) -> bool:
    """Return whether a file leaves all gains to be designed, of motion and force loops."""
    motion = control.motion
    if not isinstance(motion, MotionControl):
        return False
    return not (control.force.gains or motion.gains or motion.crossover)


def _grows(control: ClosedLoop, scenario: Scenario, testbed: Testbed) -> bool:
    """Return whether all loops together are known not to be stable at the design pose."""
    designed = scenario.model_copy(update={"control": control, "controllers": {}})
    found = loop_growth(designed, testbed)
    return found is not None and found.unstable


def _with_designed(question: _Question, *, slow: bool) -> ClosedLoop:
    """Return the control with its gains; `slow` keeps force loops below their resonances."""
    control, scenario, testbed = question.control, question.scenario, question.testbed
    parameters = nominal_parameters(testbed)
    motion, force = control.motion, control.force
    pose = motion.design_pose
    force_gains = force.gains or design_force_gains(
        testbed, parameters, pose, force.bandwidth, _force_dead_time(scenario, testbed), slow=slow
    )
    control = control.model_copy(update={"force": force.model_copy(update={"gains": force_gains})})
    if isinstance(motion, MotionControl) and _lacks_gains(motion):
        gains = _motion_gains(control, scenario, testbed, designed=force.gains is None)
        control = control.model_copy(update={"motion": motion.model_copy(update={"gains": gains})})
    elif isinstance(motion, FeedbackControl):
        designed = design_feedback_gains(motion, testbed, 1.0 / scenario.rates.motion_controller)
        gains = designed | (motion.gains or {})
        control = control.model_copy(update={"motion": motion.model_copy(update={"gains": gains})})
    return control


def _motion_gains(
    control: ClosedLoop, scenario: Scenario, testbed: Testbed, *, designed: bool
) -> dict[Dof, PidGains]:
    """Return the gains of the motion controller; `designed` says that those of force are too."""
    motion, axes = control.motion, controlled_axes(control)
    assert isinstance(motion, MotionControl)
    parameters, pose = nominal_parameters(testbed), motion.design_pose
    force_gains = control.force.gains or {}
    force = force_margins(testbed, parameters, pose, force_gains)
    crossover = {dof: motion.crossover[dof] for dof in motion.controlled if dof in motion.crossover}
    wanted = design_motion_gains(testbed, parameters, pose, crossover, axes)
    if designed and wanted:
        check_separation(motion_margins(testbed, parameters, pose, wanted, axes), force)
    wanted |= motion.gains or {}
    left = [dof for dof in motion.controlled if dof not in wanted]
    if not left:
        return {dof: wanted[dof] for dof in motion.controlled}

    def with_widest(force_bandwidth: float) -> dict[Dof, PidGains]:
        widest = design_widest_gains(
            testbed,
            parameters,
            pose,
            left,
            dead_time=_motion_dead_time(scenario, testbed),
            force_bandwidth=force_bandwidth,
            force_gains=force_gains,
            axes=axes,
        )
        return {dof: wanted.get(dof) or widest[dof] for dof in motion.controlled}

    # The torque that goes ahead makes up for a slow loop.
    ahead = {name for name, each in force_gains.items() if each.feedforward}
    slowest = min(FORCE_BANDWIDTH if n in ahead else force[n].bandwidth for n in force)
    return _stable(control, scenario, testbed, with_widest, slowest)


def _stable(
    control: ClosedLoop,
    scenario: Scenario,
    testbed: Testbed,
    design: Callable[[float], dict[Dof, PidGains]],
    slowest: float,
) -> dict[Dof, PidGains]:
    """Return the motion gains of the largest bandwidth that is stable with all loops closed.

    The procedure of section 7-1 looks at each loop by itself, with cables that do not turn. Where
    its gains are not stable together, motion loops are designed as for slower force loops, until
    twice their gains are stable; where none are, they stay what they are, and a run says so.

    Args:
        control: with the gains of its force controllers.
        scenario: whose rates and sensors count.
        testbed: the machine.
        design: returns gains by the bandwidth of the slowest force loop [rad/s].
        slowest: that bandwidth.

    Raises:
        InputError: no gains meet what is asked for.
    """
    gains = design(slowest)
    if not _unstable(control, scenario, testbed, gains):
        return gains
    bandwidth = LOWERED * slowest
    while bandwidth >= BANDWIDTH_RATIO * MOTION_BANDWIDTH:
        try:
            slower = design(bandwidth)
        except InputError:
            break
        raised = {dof: _times(SPARE_GAIN, pid) for dof, pid in slower.items()}
        if not any(_unstable(control, scenario, testbed, each) for each in (slower, raised)):
            return slower
        bandwidth *= LOWERED
    return gains


def _unstable(
    control: ClosedLoop, scenario: Scenario, testbed: Testbed, gains: dict[Dof, PidGains]
) -> bool:
    """Return whether motion gains are known not to be stable at the design pose."""
    motion = control.motion.model_copy(update={"gains": gains})
    control = control.model_copy(update={"motion": motion})
    return _grows(control, scenario, testbed)


def _times(factor: float, pid: PidGains) -> PidGains:
    return PidGains(kp=factor * pid.kp, ki=factor * pid.ki, kd=factor * pid.kd)


def _force_dead_time(scenario: Scenario, testbed: Testbed) -> float:
    """Return by how much holding the torque and the load cells delay a force loop [s]."""
    delays = sensor_delays(scenario, testbed)
    return 0.5 / scenario.rates.force_controller + delays.get(TENSION, 0.0)


def _motion_dead_time(scenario: Scenario, testbed: Testbed) -> float:
    """Return by how much the motion loop's sampling and sensor delay it [s].

    A held output and the difference that approximates the derivative cost half a period each. A
    loop that runs with every step of the plant counts as continuous, as the thesis designs it.
    """
    rates = scenario.rates
    slower = 1.0 / min(rates.motion_controller, rates.motion_capture) - 1.0 / rates.plant
    return slower + (0.0 if scenario.sensors == "ideal" else testbed.sensors[BAR_POSE].delay)
