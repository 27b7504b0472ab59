"""What a machine's sensors would read along a scenario that it follows exactly: no simulation.

Tensions come from inverse dynamics and the tension distribution, motor angles from the cables'
law. Good for planning, where effects' columns along the motion matter; tracking errors and noise
are left out.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from cspm_control.allocation.tension_distribution import TensionDistribution
from cspm_control.waves.build import build_motion
from cspm_ident.diagnosis.residuals.cable_and_bar import Suspension
from cspm_ident.diagnosis.residuals.machine_signals import (
    BodyMotion,
    MachineSignals,
    body_state,
    cable_spans,
)
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.samples import Samples
from cspm_model.elastic_law import elongation_at, law_at
from cspm_model.equilibrium import unstretched_lengths
from cspm_model.kernels.cable import OFFSET_LENGTH, RADIUS
from cspm_model.kernels.machine import PlantParameters
from cspm_model.kernels.rotation import quaternion_from_euler
from cspm_model.kinematics import lengths_between_points
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.scenario import DESIGN_POSE, AngleProfile, ClosedLoop, Scenario
from cspm_msgs_py.scenario_keys.bodies import Body
from cspm_msgs_py.testbed import Testbed, TestbedFile

Array = NDArray[np.float64]

STEP_S = 0.005
_ROUNDS = 2


class Plan(NamedTuple):
    """A planned experiment.

    Attributes:
        measurement: what the sensors would read, exactly, every `STEP_S`.
        missed: share of the wanted wrench that tensions within their limits cannot give, (k,).
    """

    measurement: Measurement
    missed: Array


def planned(scenario: Scenario, testbed: TestbedFile) -> Plan:
    """Return what following a scenario would give: closed loop with a bar, angles without one.

    Args:
        scenario: with motions that need no files.
        testbed: the machine.

    Raises:
        SingularityError: at some pose no tensions give some wrench.
    """
    machine, parameters = testbed.testbed, nominal_parameters(testbed.testbed)
    times = np.arange(0.0, scenario.duration, STEP_S)
    if isinstance(scenario.control, AngleProfile):
        return _rig(scenario.control, testbed, parameters, times)
    frame = _motion(scenario.winch_frame, scenario, machine, times)
    target = scenario.target.model_copy(update={"mean_pose": scenario.bar_mean_pose})
    bar = _motion(target, scenario, machine, times)
    zero = np.zeros((len(times), len(machine.cables)))
    still = MachineSignals(times, frame, bar, zero, zero, zero)
    needed = Suspension(still, machine, parameters, np.ones(zero.shape[1])).wrench_residuals
    control = scenario.control
    how, pose = None, DESIGN_POSE
    if isinstance(control, ClosedLoop):
        how, pose = control.tension_distribution, control.motion.design_pose
    limits = np.array([cable.tension_limits for cable in machine.cables])
    distribution = TensionDistribution(parameters.cables, limits, how, design_pose=pose)
    tensions, missed = _distributed(distribution, needed, bar.poses, frame.poses)
    lengths = cable_spans(still, body_state(bar), body_state(frame), parameters.cables).lengths
    angles = _wound_angles(parameters, lengths, tensions)
    poses = {"frame_pose": Samples(times, frame.poses), "bar_pose": Samples(times, bar.poses)}
    if machine.winch_frame is None:
        del poses["frame_pose"]
    return Plan(_measured(testbed, times, angles, tensions, poses), missed)


def _motion(body: Body, scenario: Scenario, machine: Testbed, times: Array) -> BodyMotion:
    motion = build_motion(
        body.motion,
        body.mean_pose,
        seed=scenario.seed,
        duration=scenario.duration,
        gravity=machine.gravity,
        folder=Path(),
    )
    rows = np.array([motion.at(float(time)) for time in times])
    return BodyMotion(rows[:, :6], rows[:, 6:12], rows[:, 12:18])


def _distributed(
    distribution: TensionDistribution, needed: Array, bar: Array, frame: Array
) -> tuple[Array, Array]:
    bars, frames = _rows(bar), _rows(frame)
    found = [distribution.step(*each) for each in zip(needed, bars, frames, strict=True)]
    return np.array([f.tensions for f in found]), np.array([f.residual for f in found])


def _rows(poses: Array) -> Array:
    """Return position and quaternion x y z w, (k, 7), of poses x y z φ θ ψ."""
    out = np.empty((len(poses), 7))
    out[:, :3] = poses[:, :3]
    for row, pose in zip(out, poses, strict=True):
        quaternion_from_euler(pose[3], pose[4], pose[5], row[3:])
    return out


def _wound_angles(parameters: PlantParameters, lengths: Array, tensions: Array) -> Array:
    """Return motor angles from 0 on, by thesis (2-16..2-18) from lengths and tensions, (k, n)."""
    offset, wound = parameters.cables[:, OFFSET_LENGTH], lengths
    for _ in range(_ROUNDS):
        wound = lengths - elongation_at(parameters, tensions, wound + offset)
    middle = 0.5 * (lengths[1:] + lengths[:-1])
    turned = -np.diff(np.log(wound), axis=0) * middle / parameters.cables[:, RADIUS]
    return np.vstack([np.zeros(lengths.shape[1]), np.cumsum(turned, axis=0)])


def _rig(
    control: AngleProfile, testbed: TestbedFile, parameters: PlantParameters, times: Array
) -> Plan:
    """Return the plan of winches whose cables, if any, end at fixed points."""
    machine, cables = testbed.testbed, parameters.cables
    angles = np.zeros((len(times), len(machine.cables)))
    tensions = np.zeros(angles.shape)
    for i, cable in enumerate(machine.cables):
        path = control.angle.get(cable.name)
        if path is None:
            continue
        at, values = np.array(path.points).T
        last = at[-1] * path.cycles
        along = np.where(times < last, np.mod(times, max(at[-1], STEP_S)), at[-1])
        # The servo rounds the corners.
        sigma = 1.0 / (control.bandwidth * STEP_S)
        angles[:, i] = gaussian_filter1d(np.interp(along, at, values), sigma, mode="nearest")
        tensions[:, i] = path.tension
    if any(cable.has_cable for cable in machine.cables):
        lengths = lengths_between_points(cables)
        start = unstretched_lengths(parameters, lengths, tensions[0])
        wound = start * np.exp(-angles * cables[:, RADIUS] / lengths)
        elastic = wound + cables[:, OFFSET_LENGTH]
        tensions = law_at(parameters, lengths - wound, elastic)[:, :, 0]
    return Plan(_measured(testbed, times, angles, tensions, {}), np.zeros(len(times)))


def _measured(
    testbed: TestbedFile, times: Array, angles: Array, tensions: Array, poses: dict[str, Samples]
) -> Measurement:
    machine = testbed.testbed
    speeds = np.gradient(angles, STEP_S, axis=0)
    inertia = np.array([cable.rotor_inertia for cable in machine.cables])
    radius = np.array([cable.wound_radius for cable in machine.cables])
    torques = inertia * np.gradient(speeds, STEP_S, axis=0) + radius * tensions
    has_cable = any(cable.has_cable for cable in machine.cables)
    return Measurement(
        Path("planned"),
        "",
        testbed,
        angle=Samples(times, angles),
        speed=Samples(times, speeds),
        torque=Samples(times, torques),
        tension=Samples(times, tensions) if has_cable else None,
        bar_pose=poses.get("bar_pose"),
        frame_pose=poses.get("frame_pose"),
    )
