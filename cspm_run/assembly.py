"""From scenario and test-bed to the objects that a run steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cspm_control.controllers.torque_profile import TorqueGenerator
from cspm_control.stages.make import make_controller
from cspm_control.stages.own_code import own_stage
from cspm_control.stages.target_stage import TargetStage
from cspm_control.stages.wave_stage import WaveStage
from cspm_control.waves.wave_trajectory import WaveTrajectory
from cspm_model.motion import Motion
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording.run_record import SIM
from cspm_msgs_py.scenario import (
    AngleProfile,
    ClosedLoop,
    Control,
    LockedWinches,
    Scenario,
    TorqueProfile,
)
from cspm_msgs_py.scenario_keys.events import check_cables, cuts_by_step
from cspm_msgs_py.schedule import (
    BAR_REFERENCE,
    FRAME_REFERENCE,
    MOTION_CONTROLLER,
    RATE_OF_SENSOR,
    TARGET_POSE,
    TARGET_REFERENCE,
    WAVE_TRAJECTORY,
    Schedule,
    schedule_of,
)
from cspm_msgs_py.stepping.stage import Stage
from cspm_msgs_py.testbed import Testbed
from cspm_run.controlled_dofs import with_controlled_dofs
from cspm_run.designed_gains import with_gains
from cspm_run.motions import REFERENCE_POSES, motions_of, reference_poses
from cspm_run.plants import make_plant
from cspm_sim.any_plant import AnyPlant
from cspm_sim.faults import Faults
from cspm_sim.plant import Plant
from cspm_sim.sensor_fault import sensor_faults
from cspm_sim.sensors import AnySensor, SensorModel
from cspm_sim.step_stability import axial_modes, steps_along, steps_needed

Array = NDArray[np.float64]

# Nodes that know the motions that are to come.
PLANNERS = (WAVE_TRAJECTORY, MOTION_CONTROLLER)


@dataclass(frozen=True)
class Assembly:
    """Everything that one run steps.

    `references` holds the prescribed motions by topic, `/winch_frame/reference` and
    `/bar/reference`, or `/target/reference` where the target is measured; `stages` the controllers
    in the order in which they compute; `target` the motion of a target that is measured;
    `faults` what fails, if anything does.
    """

    scenario: Scenario
    testbed: Testbed
    schedule: Schedule
    plant: AnyPlant
    sensors: dict[str, AnySensor]
    references: dict[str, WaveTrajectory]
    stages: list[Stage]
    target: Motion | None = None
    faults: Faults | None = None

    @property
    def period_ns(self) -> int:
        """The plant's period [ns]."""
        return self.schedule.period_ns

    @property
    def controlled(self) -> bool:
        """Whether a closed loop is to follow the reference."""
        return isinstance(self.scenario.control, ClosedLoop)

    @property
    def bar_reference(self) -> Array | None:
        """The bar's reference last computed, as `Motion.at`; None where it has none."""
        computed = [each for each in self.stages if isinstance(each, TargetStage)]
        prescribed = self.references.get(BAR_REFERENCE)
        if computed:
            return computed[0].values
        return None if prescribed is None else prescribed.values


def resolve(scenario: Scenario, testbed: Testbed, folder: Path | None = None) -> Scenario:
    """Return the scenario with its controlled DOFs chosen and their gains computed.

    So that it is complete. `folder` is where its relative paths start; without it the DOFs are
    those at the design pose and the mean pose.

    Raises:
        InputError: the machine cannot be controlled as the scenario requires, or has no cable that
            the scenario cuts.
    """
    check_cables(scenario.events, testbed)
    _check_controllers(scenario, testbed)
    control = scenario.control
    locked = [cable.name for cable in testbed.cables if cable.locked]
    if locked and not (isinstance(control, LockedWinches) and len(locked) == len(testbed.cables)):
        raise InputError(
            f"locked: {', '.join(locked)}, allowed in a run: all winches, under control.mode"
            " locked_winches"
        )
    if not isinstance(control, ClosedLoop):
        return scenario
    if testbed.bar is None:
        raise InputError(
            "control.mode: closed_loop without a bar, allowed: torque, angle, locked_winches"
        )
    if control.tension_distribution.axes is None:
        control = with_controlled_dofs(
            scenario, testbed, reference_poses(scenario, testbed, folder)
        )
    control = with_gains(control, scenario, testbed)
    missing = set(testbed.cable_names) ^ set(control.force.gains or {})
    if missing:
        raise InputError(
            f"control.force.gains: {', '.join(sorted(missing))}, allowed: exactly the cables"
            f" {', '.join(testbed.cable_names)}"
        )
    return scenario.model_copy(update={"control": control})


def _check_controllers(scenario: Scenario, testbed: Testbed) -> None:
    """Check that the scenario has the stages in whose place it names controllers."""
    if scenario.controllers:
        nodes = schedule_of(scenario, testbed).nodes
        unknown = [name for name in scenario.controllers if name not in nodes]
        if unknown:
            raise InputError(f"controllers: {unknown[0]}, allowed: {', '.join(nodes) or 'none'}")


def assemble(scenario: Scenario, testbed: Testbed, folder: Path, plant: str = SIM) -> Assembly:
    """Build all parts of a resolved scenario; `folder` is where its relative paths start.

    `plant` is one of `PLANTS`.

    Raises:
        InputError: scenario and test-bed do not fit together.
        ConvergenceError: the bar cannot hang at its first reference pose.
    """
    schedule = schedule_of(scenario, testbed)
    check_lockstep(schedule)
    motions = motions_of(scenario, testbed, folder)
    wave = schedule.nodes.get(WAVE_TRAJECTORY)
    references = {name: WaveTrajectory(motions[name]) for name in (wave.outputs if wave else ())}
    return Assembly(
        scenario=scenario,
        testbed=testbed,
        schedule=schedule,
        plant=_plant(scenario, testbed, motions, plant),
        sensors=_sensors(scenario, testbed),
        references=references,
        stages=[
            _stage(node, scenario, testbed, folder, motions, references) for node in schedule.nodes
        ],
        target=_target(schedule, motions),
        faults=faults_of(scenario, testbed, plant),
    )


def check_lockstep(schedule: Schedule) -> None:
    """Check that a run can keep the schedule without a clock.

    Raises:
        InputError: somebody's driver is to send a topic, who goes by the wall.
    """
    if schedule.foreign:
        raise InputError(
            f"target.source: external, {', '.join(schedule.foreign)} of a driver, in lockstep,"
            " allowed: mode realtime, or source measured"
        )


def assemble_simulator(
    scenario: Scenario, testbed: Testbed, folder: Path, plant: str
) -> tuple[AnyPlant, dict[str, AnySensor], Motion | None]:
    """Build a resolved scenario's plant, its sensors, and the motion of a target that is measured.

    Arguments and errors as `assemble`.
    """
    motions = motions_of(scenario, testbed, folder)
    target = _target(schedule_of(scenario, testbed), motions)
    return _plant(scenario, testbed, motions, plant), _sensors(scenario, testbed), target


def faults_of(
    scenario: Scenario, testbed: Testbed, plant: str, *, realtime: bool = False
) -> Faults | None:
    """Return what fails in a run, None where nothing can.

    Args:
        scenario: with its timetable.
        testbed: the machine.
        plant: whose equations are simulated.
        realtime: whether the run is one in real time, into which others may be put.

    Raises:
        InputError: a fault that the machine cannot have.
    """
    if not scenario.faults and not realtime:
        return None
    timetable, seed, cuts = scenario.faults, scenario.seed, plant == SIM
    return Faults(timetable, testbed, seed, realtime=realtime, cuts=cuts)


def assemble_stage(node: str, scenario: Scenario, testbed: Testbed, folder: Path) -> Stage:
    """Build one stage of a resolved scenario; arguments and errors as `assemble`."""
    motions = motions_of(scenario, testbed, folder) if node in PLANNERS else None
    references = {}
    if motions is not None and node == WAVE_TRAJECTORY:
        names = schedule_of(scenario, testbed).nodes[node].outputs
        references = {name: WaveTrajectory(motions[name]) for name in names}
    return _stage(node, scenario, testbed, folder, motions, references)


def _stage(
    node: str,
    scenario: Scenario,
    testbed: Testbed,
    folder: Path,
    motions: Mapping[str, Motion] | None,
    references: Mapping[str, WaveTrajectory],
) -> Stage:
    """Return a stage: the user's own where the scenario names one."""
    built_in = WaveStage(references) if node == WAVE_TRAJECTORY else None
    if node in scenario.controllers:
        return own_stage(node, scenario, testbed, folder, built_in)
    return built_in or make_controller(node, scenario, testbed, motions)


def _target(schedule: Schedule, motions: Mapping[str, Motion]) -> Motion | None:
    return motions[TARGET_REFERENCE] if TARGET_REFERENCE in schedule.topics else None


def _plant(
    scenario: Scenario, testbed: Testbed, motions: Mapping[str, Motion], name: str
) -> AnyPlant:
    control, period_ns = scenario.control, 1_000_000_000 // scenario.rates.plant
    bar = motions["/bar/reference"].at(0.0)[:6] if testbed.bar else None
    made = make_plant(
        name,
        testbed,
        motions["/winch_frame/reference"],
        period_ns,
        bar_pose=bar,
        tensions=_start_tensions(testbed, control),
        locked=isinstance(control, LockedWinches),
        cuts=cuts_by_step(scenario.events, testbed.cable_names, period_ns),
    )
    if isinstance(made, Plant):
        made.substeps = _substeps(scenario, testbed, made, motions)
    return made


def _substeps(
    scenario: Scenario, testbed: Testbed, plant: Plant, motions: Mapping[str, Motion]
) -> int:
    """Return how many steps of the integration a period needs, at the start and later.

    Raises:
        InputError: more than any run would wait for.
    """
    lengths, rate = (plant.unstretched_lengths, plant.lengths), scenario.rates.plant
    if testbed.bar is None:
        modes = axial_modes(
            plant.parameters, None, plant.frame[:6], lengths, plant.tensions, locked=plant.locked
        )
        return steps_needed(modes, rate)
    times = np.linspace(0.0, scenario.duration, REFERENCE_POSES)
    bars, frames = (
        np.array([motions[name].at(time)[:6] for time in times])
        for name in (BAR_REFERENCE, FRAME_REFERENCE)
    )
    bars[0] = plant.bar_state[:6]
    return steps_along(
        plant.parameters, (bars, frames), lengths, plant.tensions, rate, locked=plant.locked
    )


def _start_tensions(testbed: Testbed, control: Control) -> Array | None:
    """Return what the cables carry at the start, so that a rig does not start with a jerk."""
    if isinstance(control, AngleProfile):
        paths = [control.angle.get(name) for name in testbed.cable_names]
        return np.array([path.tension if path else 0.0 for path in paths])
    if not isinstance(control, TorqueProfile):
        return None
    first = TorqueGenerator(control.torque, testbed.cable_names).step(0)
    radii = np.array([cable.wound_radius for cable in testbed.cables])
    has_cable = np.array([cable.has_cable for cable in testbed.cables])
    tensions: Array = np.maximum(0.0, first / radii) * has_cable
    return tensions


def _sensors(scenario: Scenario, testbed: Testbed) -> dict[str, AnySensor]:
    return {
        name: SensorModel(
            testbed.topics[name],
            sensor,
            rate=getattr(scenario.rates, RATE_OF_SENSOR[name]),
            period_ns=1_000_000_000 // scenario.rates.plant,
            seed=scenario.seed,
            ideal=scenario.sensors == "ideal",
            faults=sensor_faults(testbed, name),
        )
        for name, sensor in testbed.sensors.items()
        if name != TARGET_POSE or scenario.target.is_measured
    }
