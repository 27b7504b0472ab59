"""From scenario and test-bed to the objects that a run steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cspm_control.controllers.torque_profile import TorqueGenerator
from cspm_control.design.gains import (
    check_separation,
    design_force_gains,
    design_motion_gains,
    force_margins,
    motion_margins,
)
from cspm_control.stages.make import make_controller
from cspm_control.stages.wave_stage import WaveStage
from cspm_control.waves.build import build_motion
from cspm_control.waves.wave_trajectory import WaveTrajectory
from cspm_model.motion import Motion
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import (
    AngleProfile,
    ClosedLoop,
    Control,
    LockedWinches,
    MotionControl,
    Scenario,
    TorqueProfile,
)
from cspm_msgs_py.schedule import (
    MOTION_CONTROLLER,
    RATE_OF_SENSOR,
    WAVE_TRAJECTORY,
    Schedule,
    schedule_of,
)
from cspm_msgs_py.stepping.stage import Stage
from cspm_msgs_py.testbed import Testbed
from cspm_run.plants import SIM, make_plant
from cspm_sim.any_plant import AnyPlant
from cspm_sim.sensor_fault import sensor_faults
from cspm_sim.sensors import AnySensor, SensorModel

Array = NDArray[np.float64]

# Nodes that know the motions that are to come.
PLANNERS = (WAVE_TRAJECTORY, MOTION_CONTROLLER)


@dataclass(frozen=True)
class Assembly:
    """Everything that one run steps.

    `references` holds the prescribed motions by topic, `/winch_frame/reference` and
    `/bar/reference`, of the bodies that the machine has; `stages` the controllers in the order in
    which they compute.
    """

    scenario: Scenario
    testbed: Testbed
    schedule: Schedule
    plant: AnyPlant
    sensors: dict[str, AnySensor]
    references: dict[str, WaveTrajectory]
    stages: list[Stage]

    @property
    def period_ns(self) -> int:
        """The plant's period [ns]."""
        return self.schedule.period_ns

    @property
    def controlled(self) -> bool:
        """Whether a closed loop is to follow the reference."""
        return isinstance(self.scenario.control, ClosedLoop)


def resolve(scenario: Scenario, testbed: Testbed) -> Scenario:
    """Return the scenario with its controller gains computed, so that it is complete.

    Raises:
        InputError: the machine cannot be controlled as the scenario requires.
    """
    control = scenario.control
    if not isinstance(control, ClosedLoop):
        return scenario
    if testbed.bar is None:
        raise InputError(
            "control.mode: closed_loop without a bar, allowed: torque, angle, locked_winches"
        )
    parameters = nominal_parameters(testbed)
    motion, force = control.motion, control.force
    pose = motion.design_pose
    force_gains = force.gains or design_force_gains(testbed, parameters, pose, force.bandwidth)
    if isinstance(motion, MotionControl):
        designed = motion.gains is None and force.gains is None
        gains = motion.gains or design_motion_gains(testbed, parameters, pose, motion.crossover)
        if designed:
            check_separation(
                motion_margins(testbed, parameters, pose, gains),
                force_margins(testbed, parameters, pose, force_gains),
            )
        motion = motion.model_copy(update={"gains": gains})
    missing = set(testbed.cable_names) ^ set(force_gains)
    if missing:
        raise InputError(
            f"control.force.gains: {', '.join(sorted(missing))}, allowed: exactly the cables"
            f" {', '.join(testbed.cable_names)}"
        )
    control = control.model_copy(
        update={
            "motion": motion,
            "force": force.model_copy(update={"gains": force_gains}),
        }
    )
    return scenario.model_copy(update={"control": control})


def assemble(scenario: Scenario, testbed: Testbed, folder: Path, plant: str = SIM) -> Assembly:
    """Build all parts of a resolved scenario; `folder` is where its relative paths start.

    `plant` is one of `PLANTS`.

    Raises:
        InputError: scenario and test-bed do not fit together.
        ConvergenceError: the bar cannot hang at its first reference pose.
    """
    schedule = schedule_of(scenario, testbed)
    motions = motions_of(scenario, testbed, folder)
    references = {
        name: WaveTrajectory(motions[name]) for name in schedule.topics if name in motions
    }
    return Assembly(
        scenario=scenario,
        testbed=testbed,
        schedule=schedule,
        plant=_plant(scenario, testbed, motions, plant),
        sensors=_sensors(scenario, testbed),
        references=references,
        stages=[
            WaveStage(references)
            if node == WAVE_TRAJECTORY
            else make_controller(node, scenario, testbed, motions)
            for node in schedule.nodes
        ],
    )


def assemble_simulator(
    scenario: Scenario, testbed: Testbed, folder: Path, plant: str
) -> tuple[AnyPlant, dict[str, AnySensor]]:
    """Build a resolved scenario's plant and its sensors; arguments and errors as `assemble`."""
    motions = motions_of(scenario, testbed, folder)
    return _plant(scenario, testbed, motions, plant), _sensors(scenario, testbed)


def assemble_stage(node: str, scenario: Scenario, testbed: Testbed, folder: Path) -> Stage:
    """Build one stage of a resolved scenario; arguments and errors as `assemble`."""
    motions = motions_of(scenario, testbed, folder) if node in PLANNERS else None
    if motions is None or node != WAVE_TRAJECTORY:
        return make_controller(node, scenario, testbed, motions)
    names = schedule_of(scenario, testbed).nodes[node].outputs
    return WaveStage({name: WaveTrajectory(motions[name]) for name in names})


def _plant(
    scenario: Scenario, testbed: Testbed, motions: Mapping[str, Motion], name: str
) -> AnyPlant:
    control = scenario.control
    bar = motions["/bar/reference"].at(0.0)[:6] if testbed.bar else None
    return make_plant(
        name,
        testbed,
        motions["/winch_frame/reference"],
        1_000_000_000 // scenario.rates.plant,
        bar_pose=bar,
        tensions=_start_tensions(testbed, control),
        locked=isinstance(control, LockedWinches),
    )


def _start_tensions(testbed: Testbed, control: Control) -> Array | None:
    """Return what the cables carry at the start, so that a rig does not start with a jerk."""
    if isinstance(control, AngleProfile):
        paths = [control.angle.get(name) for name in testbed.cable_names]
        return np.array([path.tension if path else 0.0 for path in paths])
    if not isinstance(control, TorqueProfile):
        return None
    first = TorqueGenerator(control.torque, testbed.cable_names).step(0)
    radii = np.array([cable.drum_radius / cable.gear_ratio for cable in testbed.cables])
    has_cable = np.array([cable.has_cable for cable in testbed.cables])
    tensions: Array = np.maximum(0.0, first / radii) * has_cable
    return tensions


def motions_of(scenario: Scenario, testbed: Testbed, folder: Path) -> dict[str, Motion]:
    """Return the motions of winch frame, moving or not, and bar, by reference topic."""
    target = scenario.target.model_copy(update={"mean_pose": scenario.bar_mean_pose})
    bodies = {"/winch_frame/reference": scenario.winch_frame}
    if testbed.bar:
        bodies["/bar/reference"] = target
    motions = {
        name: build_motion(
            body.motion,
            body.mean_pose,
            seed=scenario.seed,
            duration=scenario.duration,
            gravity=testbed.gravity,
            folder=folder,
        )
        for name, body in bodies.items()
    }
    if testbed.winch_frame is None and motions["/winch_frame/reference"].knots.any():
        raise InputError("winch_frame: this test-bed has none, allowed: no motion and no mean pose")
    return motions


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
    }
