"""The loops of a scenario: as the thesis designs them, sampled, and in their cascade."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from cspm_control.analysis.loop_view import LoopView, continuous_view, sampled_view
from cspm_control.analysis.sampled_loops import (
    LoopTiming,
    cascade_plant,
    force_plant_sampled,
    motion_controllers,
    motion_plant_sampled,
    pi_system,
    pid_system,
)
from cspm_control.analysis.sampled_system import SampledSystem, closed
from cspm_control.design.gains import (
    LARGEST_FORCE_BANDWIDTH,
    MOTION_BANDWIDTH,
    force_loop,
    motion_loop,
    motion_plant,
    tension_plant,
    wrench_column,
)
from cspm_control.design.margins import loop_frequencies
from cspm_control.stages.make import controlled_axes
from cspm_model.linearisation import StateSpace, linear_model, motion_subsystem, operating_point
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import ClosedLoop, MotionControl
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

DESIGNED, SAMPLED, CASCADE, LATE = "designed", "sampled", "cascade", "late"
MOTION_STEP, FORCE_STEP = 4.0, 0.06  # s


@dataclass(frozen=True, eq=False)
class LoopAnalysis:
    """All loops of a scenario.

    Attributes:
        motion: per way and controlled DOF.
        force: per way and cable.
        growth: per way of closing everything: how fast the slowest or growing motion changes, as
            Re λ [1/s], and its frequency [rad/s].
    """

    motion: dict[str, dict[str, LoopView]]
    force: dict[str, dict[str, LoopView]]
    growth: dict[str, tuple[float, float]]


def analyse_loops(testbed: Testbed, control: ClosedLoop, timing: LoopTiming) -> LoopAnalysis:
    """Return the loops of a resolved scenario at `control.motion.design_pose`.

    `designed` is the thesis's way: continuous, each loop alone on the model with cable directions
    held. `sampled` is the same with samples and delays of sensors. `cascade` closes everything on
    the exact model and opens one loop at a time. `late` adds the time that computing takes.

    Args:
        testbed: the machine.
        control: with its gains worked out.
        timing: of the loops, torques as late as computing makes them.

    Raises:
        InputError: the machine cannot exert all controlled forces, or its bar is not controlled by
            one loop per DOF.
        ConvergenceError: the bar cannot hang at the design pose.
    """
    prompt = replace(timing, torque_delay=0)
    cascades = {CASCADE: prompt, LATE: timing}
    law = pid_law(control)
    axes = controlled_axes(control)
    motion = _designed_motion(testbed, law, axes)
    motion[SAMPLED] = sampled_motion(testbed, law, prompt, axes)
    growth = {}
    for way, clock in cascades.items():
        motion[way], growth[way] = _cascaded_motion(testbed, control, clock)
    force = _designed_force(testbed, control)
    for way, clock in ((SAMPLED, prompt), (LATE, timing)):
        force[way] = sampled_force(testbed, control, clock)
    return LoopAnalysis(motion, force, growth)


def pid_law(control: ClosedLoop) -> MotionControl:
    """Return the motion controller that has a loop of its own for each DOF.

    Raises:
        InputError: there is none.
    """
    if not isinstance(control.motion, MotionControl):
        raise InputError(f"control.motion.law: {control.motion.law} has no loops, allowed: pid")
    return control.motion


def _designed_motion(
    testbed: Testbed, motion: MotionControl, axes: Sequence[int]
) -> dict[str, dict[str, LoopView]]:
    plant = motion_plant(testbed, nominal_parameters(testbed), motion.design_pose, axes)
    grid = loop_frequencies(plant, MOTION_BANDWIDTH)
    found = {}
    for dof, gains in (motion.gains or {}).items():
        place = DOFS.index(dof), wrench_column(plant, dof)
        found[str(dof)] = continuous_view(
            partial(_entry, plant, place),
            motion_loop(plant, dof, gains),
            grid,
        )
    return {DESIGNED: found}


def _entry(plant: StateSpace, place: tuple[int, int], frequencies: Array) -> ComplexArray:
    return plant.response(frequencies)[:, place[0], place[1]]


def _designed_force(testbed: Testbed, control: ClosedLoop) -> dict[str, dict[str, LoopView]]:
    plant = tension_plant(testbed, nominal_parameters(testbed), control.motion.design_pose)
    grid = loop_frequencies(plant, LARGEST_FORCE_BANDWIDTH)
    found = {}
    for i, name in enumerate(testbed.cable_names):
        loop = force_loop(plant, i, (control.force.gains or {})[name])
        found[name] = continuous_view(partial(_entry, plant, (i, i)), loop, grid)
    return {DESIGNED: found}


def sampled_motion(
    testbed: Testbed, motion: MotionControl, timing: LoopTiming, axes: Sequence[int]
) -> dict[str, LoopView]:
    """Return the sampled motion loop of each controlled DOF alone, by name."""
    continuous = motion_plant(testbed, nominal_parameters(testbed), motion.design_pose, axes)
    plant = motion_plant_sampled(continuous, timing)
    found = {}
    for dof, gains in (motion.gains or {}).items():
        output, column = DOFS.index(dof), wrench_column(continuous, dof)
        alone = plant.part(slice(output, output + 1), slice(column, column + 1))
        pid = pid_system(gains, motion.derivative_filter, plant.period)
        found[str(dof)] = sampled_view(alone, pid, MOTION_STEP)
    return found


def sampled_force(testbed: Testbed, control: ClosedLoop, timing: LoopTiming) -> dict[str, LoopView]:
    """Return the sampled force loop of each cable alone, by name."""
    continuous = tension_plant(testbed, nominal_parameters(testbed), control.motion.design_pose)
    gains = control.force.gains or {}
    plant = force_plant_sampled(continuous, timing)
    found = {}
    for i, name in enumerate(testbed.cable_names):
        one = slice(i, i + 1)
        controller = pi_system(gains[name], plant.period)
        found[name] = sampled_view(plant.part(one, one), controller, FORCE_STEP)
    return found


def cascade_growth(
    testbed: Testbed, control: ClosedLoop, timing: LoopTiming
) -> tuple[float, float]:
    """Return how fast the slowest motion changes with all loops closed, as in `LoopAnalysis`.

    Arguments and errors as `analyse_loops`, torques late by `timing`.
    """
    return _growth(_cascade(testbed, control, timing)[1])


def _cascade(
    testbed: Testbed, control: ClosedLoop, timing: LoopTiming
) -> tuple[SampledSystem, SampledSystem]:
    """Return wanted wrench to pose with the force loops closed, and with all loops closed."""
    parameters, motion = nominal_parameters(testbed), pid_law(control)
    point = operating_point(testbed, parameters, motion.design_pose)
    model = linear_model(testbed, parameters, point, exact=True)
    rows = motion_subsystem(model, parameters, point).C
    gains = {name: (control.force.gains or {})[name] for name in testbed.cable_names}
    axes = controlled_axes(control)
    plant = cascade_plant(model, parameters, point, rows, timing, gains, axes)
    return plant, closed(plant, motion_controllers(motion, plant.period, axes))


def _cascaded_motion(
    testbed: Testbed, control: ClosedLoop, timing: LoopTiming
) -> tuple[dict[str, LoopView], tuple[float, float]]:
    motion, axes = pid_law(control), controlled_axes(control)
    plant, everything = _cascade(testbed, control, timing)
    found = {}
    for dof, pid in (motion.gains or {}).items():
        output = slice(DOFS.index(dof), DOFS.index(dof) + 1)
        found[str(dof)] = sampled_view(
            _with_others_closed(plant, motion, dof, axes),
            pid_system(pid, motion.derivative_filter, plant.period),
            MOTION_STEP,
            everything.part(output, output),
        )
    return found, _growth(everything)


def _with_others_closed(
    plant: SampledSystem, motion: MotionControl, dof: str, axes: Sequence[int]
) -> SampledSystem:
    """Return one DOF's wrench to its pose while the controllers of the others act."""
    others = closed(plant, motion_controllers(motion, plant.period, axes, without=dof))
    output, column = DOFS.index(dof), list(axes).index(DOFS.index(dof))
    memories = len(others.A) - len(plant.A)
    wrench = np.vstack([np.zeros((memories, 1)), plant.B[:, [column]]])
    rows = slice(output, output + 1)
    return SampledSystem(others.A, wrench, others.C[rows], np.zeros((1, 1)), plant.period)


def _growth(system: SampledSystem) -> tuple[float, float]:
    """Return Re λ [1/s] of the slowest decay, or fastest growth, and its frequency [rad/s]."""
    poles = np.linalg.eigvals(system.A)
    worst = poles[np.argmax(np.abs(poles))]
    return float(np.log(np.abs(worst)) / system.period), float(
        np.abs(np.angle(worst)) / system.period
    )
