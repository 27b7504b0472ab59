"""From scenario and test-bed to the objects that a run steps."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_bringup.plants import SIM, AnyPlant, make_plant
from cspm_control.design import (
    check_separation,
    design_force_gains,
    design_motion_gains,
    force_margins,
    motion_margins,
)
from cspm_control.force_controller import ForceController
from cspm_control.motion_controller import MotionController
from cspm_control.tension_distribution import PseudoInverse
from cspm_control.torque_profile import TorqueGenerator
from cspm_control.wave_trajectory import WaveTrajectory
from cspm_control.waves.build import build_motion
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import Body, ClosedLoop, LockedWinches, Scenario, TorqueProfile
from cspm_msgs_py.testbed import Testbed
from cspm_sim.kernels.cable import RADIUS
from cspm_sim.motion import Motion
from cspm_sim.parameters import plant_parameters
from cspm_sim.sensors import SensorModel

Array = NDArray[np.float64]

_RATE_OF_SENSOR = {
    "/winch_frame/pose": "motion_capture",
    "/winch_frame/twist": "motion_capture",
    "/bar/pose": "motion_capture",
    "/bar/twist": "motion_capture",
    "/winches/state": "winches",
    "/cables/tension": "load_cells",
}


class Controllers(NamedTuple):
    """The thesis's cascade."""

    motion: MotionController
    distribution: PseudoInverse
    force: ForceController


@dataclass(frozen=True)
class Assembly:
    """Everything that one run steps; absent parts are None.

    `references` holds the prescribed motions by topic, `/winch_frame/reference` and
    `/bar/reference`, of the bodies that the machine has.
    """

    scenario: Scenario
    testbed: Testbed
    period_ns: int
    plant: AnyPlant
    sensors: dict[str, SensorModel]
    references: dict[str, WaveTrajectory]
    controllers: Controllers | None
    torque_generator: TorqueGenerator | None


def resolve(scenario: Scenario, testbed: Testbed) -> Scenario:
    """Return the scenario with its controller gains worked out, so that it says all of itself.

    Raises:
        InputError: the machine cannot be controlled as the scenario asks.
    """
    control = scenario.control
    if not isinstance(control, ClosedLoop):
        return scenario
    if testbed.bar is None:
        raise InputError("control.mode: closed_loop without a bar, allowed: torque, locked_winches")
    parameters = plant_parameters(testbed)
    motion, force = control.motion, control.force
    pose = motion.design_pose
    designed = motion.gains is None and force.gains is None
    motion_gains = motion.gains or design_motion_gains(testbed, parameters, pose, motion.crossover)
    force_gains = force.gains or design_force_gains(testbed, parameters, pose, force.bandwidth)
    if designed:
        check_separation(
            motion_margins(testbed, parameters, pose, motion_gains),
            force_margins(testbed, parameters, pose, force_gains),
        )
    missing = set(testbed.cable_names) ^ set(force_gains)
    if missing:
        raise InputError(
            f"control.force.gains: {', '.join(sorted(missing))}, allowed: exactly the cables"
            f" {', '.join(testbed.cable_names)}"
        )
    control = control.model_copy(
        update={
            "motion": motion.model_copy(update={"gains": motion_gains}),
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
    period_ns = 1_000_000_000 // scenario.rates.plant
    frame = _motion(scenario, scenario.winch_frame, testbed, folder)
    if testbed.winch_frame is None and frame.knots.any():
        raise InputError("winch_frame: this test-bed has none, allowed: no motion and no mean pose")
    target = scenario.target.model_copy(update={"mean_pose": scenario.bar_mean_pose})
    references = {"/winch_frame/reference": frame} if testbed.winch_frame else {}
    if testbed.bar:
        references["/bar/reference"] = _motion(scenario, target, testbed, folder)
    control = scenario.control
    sensors = _sensors(scenario, testbed, period_ns)
    generator = (
        TorqueGenerator(control.torque, testbed.cable_names)
        if isinstance(control, TorqueProfile)
        else None
    )
    return Assembly(
        scenario=scenario,
        testbed=testbed,
        period_ns=period_ns,
        plant=make_plant(
            plant,
            testbed,
            frame,
            period_ns,
            bar_pose=references["/bar/reference"].at(0.0)[:6] if testbed.bar else None,
            tensions=_balanced_tensions(testbed, generator) if generator else None,
            locked=isinstance(control, LockedWinches),
        ),
        sensors=sensors,
        references={name: WaveTrajectory(motion) for name, motion in references.items()},
        controllers=(
            _controllers(control, scenario, testbed, sensors)
            if isinstance(control, ClosedLoop)
            else None
        ),
        torque_generator=generator,
    )


def _balanced_tensions(testbed: Testbed, generator: TorqueGenerator) -> Array:
    """Return the tensions that the first torques hold, so that a rig does not start with a jerk."""
    radii = np.array([cable.drum_radius / cable.gear_ratio for cable in testbed.cables])
    has_cable = np.array([cable.has_cable for cable in testbed.cables])
    tensions: Array = np.maximum(0.0, generator.step(0) / radii) * has_cable
    return tensions


def _motion(scenario: Scenario, body: Body, testbed: Testbed, folder: Path) -> Motion:
    return build_motion(
        body.motion,
        body.mean_pose,
        seed=scenario.seed,
        duration=scenario.duration,
        gravity=testbed.gravity,
        folder=folder,
    )


def _sensors(scenario: Scenario, testbed: Testbed, period_ns: int) -> dict[str, SensorModel]:
    return {
        name: SensorModel(
            testbed.topics[name],
            sensor,
            rate=getattr(scenario.rates, _RATE_OF_SENSOR[name]),
            period_ns=period_ns,
            seed=scenario.seed,
            ideal=scenario.sensors == "ideal",
        )
        for name, sensor in testbed.sensors.items()
    }


def _controllers(
    control: ClosedLoop, scenario: Scenario, testbed: Testbed, sensors: dict[str, SensorModel]
) -> Controllers:
    if testbed.bar is None:
        raise InputError("control.mode: closed_loop without a bar, allowed: torque, locked_winches")
    needed = ["/bar/pose", "/cables/tension"] + ["/winch_frame/pose"] * bool(testbed.winch_frame)
    missing = [name for name in needed if name not in sensors]
    if missing:
        raise InputError(
            f"sensors: {', '.join(missing)} missing, allowed in closed loop: {', '.join(needed)}"
        )
    motion, force, cables = control.motion, control.force, testbed.cables
    rows = plant_parameters(testbed).cables
    return Controllers(
        MotionController(
            motion.gains or {},
            testbed.bar,
            testbed.gravity,
            period=1.0 / scenario.rates.motion_controller,
            derivative_filter=motion.derivative_filter,
            integral_limits=motion.integral_limits,
        ),
        PseudoInverse(rows, np.array([cable.tension_limits for cable in cables], dtype=float)),
        ForceController(
            [(force.gains or {})[cable.name] for cable in cables],
            rows[:, RADIUS].copy(),
            np.array([cable.torque_limit for cable in cables]),
            period=1.0 / scenario.rates.force_controller,
        ),
    )
