"""From scenario and test-bed to what is plausible on the machine.

The defaults follow from the machine:

- A body stays within the machine's size of its mean position: the largest extent of exits and
  attachments. References of the shipped scenarios reach 0.33 of it.
- No point is faster than √(2·a·size), with a what all cables at their upper limits and gravity
  give the bar: falling, or pulled, from one end of the workspace to the other. On the thesis's
  machine that is 11.9 m/s, where the shipped scenarios reach 2.1 m/s.
- A pose trembles no more than its sensor's noise and those accelerations explain; off the middle of
  the bar a force accelerates a point more, because the bar turns.
- The bar is within half the size of its reference at least, and a run in real time knows better:
  three times its tracking error. In the first minute of the shipped scenarios it
  is within 0.44 (`worst_case_steep`), but for those in which the loop loses it: `worst_case_4m`,
  `worst_case_steep_4m` and `worst_case_literal`, more than 1 m off.
- A motor accelerates no more than its largest torque and the tension at which the guard trips turn
  its rotor.
- A reading repeats no longer than silence is allowed, where the sensor's noise makes that certain,
  and so does each quantity of it. An angle does not stand while its speed makes a way.
- Torque may be off by a twentieth of the motor's limit, or half of what the tension needs. Healthy
  runs of the shipped scenarios are off by 0.014 of the limit; dry friction comes on top.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cspm_control.plausibility.drive_motion import DriveMotion
from cspm_control.plausibility.pose_limits import FollowingError, PoseLimits
from cspm_control.plausibility.pose_noise import PoseNoise, point_accelerations, points_noise
from cspm_control.plausibility.repeated_quantity import RepeatedQuantity
from cspm_control.plausibility.repeated_reading import RepeatedReading
from cspm_control.plausibility.standing_angle import StandingAngle
from cspm_control.plausibility.torque_balance import TorqueBalance
from cspm_control.stages.make import tension_trips
from cspm_msgs_py.safety_spec import Safety
from cspm_msgs_py.scenario import Scenario
from cspm_msgs_py.schedule import (
    BAR_POSE,
    BAR_REFERENCE,
    FRAME_POSE,
    TARGET_POSE,
    TENSION,
    WINCH_STATE,
    schedule_of,
)
from cspm_msgs_py.sensor_spec import Sensor, quantities
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]

FOLLOWING_SHARE = 0.5
TORQUE_SHARE = 0.05


@dataclass(frozen=True)
class MachinePlausibility:
    """What one node can judge of what it reads.

    Attributes:
        poses: limits of bodies, by the topic of their poses.
        noise: what those poses may tremble, likewise.
        following: of the bar, where the node reads its reference.
        motion: of the winches, by the topic of their states.
        balance: of the winches, where the node reads tensions and states.
        repeated: of sensors with noise, by topic.
        single: of their single quantities, likewise.
        standing: of the winches' angles, by the topic of their states.
    """

    poses: Mapping[str, PoseLimits] = field(default_factory=dict)
    noise: Mapping[str, PoseNoise] = field(default_factory=dict)
    following: FollowingError | None = None
    motion: Mapping[str, DriveMotion] = field(default_factory=dict)
    balance: TorqueBalance | None = None
    repeated: Mapping[str, RepeatedReading] = field(default_factory=dict)
    single: Mapping[str, RepeatedQuantity] = field(default_factory=dict)
    standing: Mapping[str, StandingAngle] = field(default_factory=dict)

    def fault(
        self, topic: str, stamp_ns: int, row: Array, rows: Mapping[str, Array], *, running: bool
    ) -> str | None:
        """Take a message; see `cspm_msgs_py.stepping.plausibility`."""
        judges = (
            *(self.repeated, self.single, self.standing),
            *(self.poses, self.noise, self.motion),
        )
        for each in judges:
            fault = each[topic].fault(stamp_ns, row) if topic in each else None
            if fault is not None:
                return fault
        if topic == BAR_POSE and self.following is not None and BAR_REFERENCE in rows:
            return self.following.fault(row, rows[BAR_REFERENCE], running=running)
        if topic == WINCH_STATE and self.balance is not None and TENSION in rows:
            return self.balance.fault(stamp_ns, row, rows[TENSION], running=running)
        return None


def make_plausibility(node: str, scenario: Scenario, testbed: Testbed) -> MachinePlausibility:
    """Return what a controller's node can judge of what it reads.

    Args:
        node: its name; one of the scenario's schedule.
        scenario: resolved.
        testbed: the machine.

    Raises:
        InputError: scenario and test-bed do not fit.
    """
    schedule = schedule_of(scenario, testbed)
    plan, safety = schedule.nodes[node], scenario.safety
    read = {*plan.inputs, *plan.held}
    poses, noise = {}, {}
    if testbed.bar is not None:
        speed = safety.pose_speed or fastest(testbed)
        reach = safety.workspace or machine_size(testbed)
        for topic, (middle, points) in _bodies(scenario, body_points(testbed)).items():
            if topic in read:
                period_ns = schedule.topics[topic].divider * schedule.period_ns
                poses[topic] = PoseLimits(topic, middle, points, reach, speed, period_ns)
                noise[topic] = _pose_noise(topic, points, safety, testbed, period_ns)
    following = balance = None
    motion, standing = {}, {}
    if {BAR_POSE, BAR_REFERENCE} <= read:
        most = safety.following_error or FOLLOWING_SHARE * machine_size(testbed)
        following = FollowingError(body_points(testbed)[1], most)
    if WINCH_STATE in read:
        each = schedule.topics[WINCH_STATE]
        motion[WINCH_STATE] = drive_motion(scenario, testbed, each.divider * schedule.period_ns)
        standing[WINCH_STATE] = _standing_angle(testbed, safety.stale_after)
    if {WINCH_STATE, TENSION} <= read:
        balance = torque_balance(scenario, testbed)
    repeated = _repeated(scenario, testbed, read)
    single = _single(scenario, testbed, read)
    return MachinePlausibility(poses, noise, following, motion, balance, repeated, single, standing)


def _pose_noise(
    topic: str, points: Array, safety: Safety, testbed: Testbed, period_ns: int
) -> PoseNoise:
    """Return what finds noise on a body's pose; its origin is one of the points."""
    points = np.vstack([np.zeros(3), points])
    if safety.pose_acceleration:
        accelerations = np.full(len(points), safety.pose_acceleration)
    elif topic == BAR_POSE:
        accelerations = bar_accelerations(points, testbed)
    else:
        accelerations = np.full(len(points), largest_acceleration(testbed))
    noise = np.zeros(len(points))
    if topic in testbed.sensors:
        position, orientation = _deviations(testbed.sensors[topic])
        noise = points_noise(points, position, orientation)
    return PoseNoise(topic, points, accelerations, noise, period_ns)


def _deviations(sensor: Sensor) -> Array:
    """Return the standard deviation of each quantity; a step of r is uniform noise of r/√12."""
    return np.hypot(sensor.noise, np.array(sensor.resolution) / np.sqrt(12.0))


def _repeated(
    scenario: Scenario, testbed: Testbed, read: Collection[str]
) -> dict[str, RepeatedReading]:
    """Return what finds sensors that are stuck, of those that a node reads.

    Drives are none of them: one at rest may say so exactly.
    """
    if scenario.sensors == "ideal":
        return {}
    found = {}
    for topic, sensor in testbed.sensors.items():
        if topic in read and topic != WINCH_STATE:
            each = testbed.topics[topic]
            width = 6 if each.ros_type.endswith("PoseStamped") else each.width
            times = width // len(quantities(each))
            noise, steps = np.repeat(sensor.noise, times), np.repeat(sensor.resolution, times)
            allowed = scenario.safety.stale_after
            found[topic] = RepeatedReading(topic, noise, steps, allowed)
    return found


def _single(
    scenario: Scenario, testbed: Testbed, read: Collection[str]
) -> dict[str, RepeatedQuantity]:
    """Return what finds single quantities that are stuck, of those that a node reads.

    Orientations are none of them: the share of a quaternion near one hardly moves.
    """
    if scenario.sensors == "ideal":
        return {}
    found = {}
    for topic, sensor in testbed.sensors.items():
        if topic not in read:
            continue
        each = testbed.topics[topic]
        kinds, width = len(quantities(each)), each.width
        if each.ros_type.endswith("PoseStamped"):
            kinds, width = 1, 3
        noise, steps = (
            np.repeat(values[:kinds], width // kinds)
            for values in (sensor.noise, sensor.resolution)
        )
        names = [" of ".join(name.split("/")) for name in each.fields[:width]]
        found[topic] = RepeatedQuantity(topic, names, noise, steps, scenario.safety.stale_after)
    return found


def _standing_angle(testbed: Testbed, allowed: float) -> StandingAngle:
    """Return what finds encoders that are stuck."""
    noise, resolution = (0.0, 0.0), 0.0
    if WINCH_STATE in testbed.sensors:
        sensor = testbed.sensors[WINCH_STATE]
        noise, resolution = (sensor.noise[0], sensor.noise[1]), sensor.resolution[0]
    return StandingAngle(testbed.cable_names, noise, resolution, allowed)


def body_points(testbed: Testbed) -> tuple[Array, Array]:
    """Return exits and attachments of a machine's cables, (k, 3) each [m]."""
    cables = [cable for cable in testbed.cables if cable.has_cable]
    exits = np.array([cable.exit for cable in cables], dtype=float).reshape(-1, 3)
    return exits, np.array([cable.attachment for cable in cables], dtype=float).reshape(-1, 3)


def machine_size(testbed: Testbed) -> float:
    """Return the largest extent of exits, attachments or bar [m]; 0 where there is none."""
    points = np.vstack(body_points(testbed))
    extent = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    return max(extent, *(testbed.bar.dimensions if testbed.bar else (0.0,)))


def fastest(testbed: Testbed) -> float:
    """Return the speed [m/s] beyond which no point of a machine with a bar moves."""
    return float(np.sqrt(2.0 * largest_acceleration(testbed) * machine_size(testbed)))


def largest_acceleration(testbed: Testbed) -> float:
    """Return what gravity and all cables at their upper limits give a bar without turning it."""
    assert testbed.bar is not None
    return float(_pulls(testbed).sum() / testbed.bar.mass + testbed.gravity)


def bar_accelerations(points: Array, testbed: Testbed) -> Array:
    """Return what gravity and all cables, at their upper limits, give points of it, (k,) [m/s²]."""
    bar = testbed.bar
    assert bar is not None
    attachments, pulls = body_points(testbed)[1], _pulls(testbed)
    found = point_accelerations(
        points, attachments, pulls, bar.mass, bar.inertia.matrix, np.array(bar.com)
    )
    return found + testbed.gravity


def _pulls(testbed: Testbed) -> Array:
    """Return how hard each cable can pull [N]."""
    return np.array(
        [
            cable.tension_limits[1]
            if cable.tension_limits
            else cable.torque_limit * cable.gear_ratio / cable.drum_radius
            for cable in testbed.cables
            if cable.has_cable
        ]
    )


def drive_motion(scenario: Scenario, testbed: Testbed, period_ns: int) -> DriveMotion:
    """Return what the motors of a machine can do, with readings in so many ns."""
    cables, trips = testbed.cables, tension_trips(scenario, testbed)
    # What has no limit carries no bar, and nothing pulls at it.
    tensions = np.where(np.isfinite(trips), trips, 0.0)
    radii = np.array([cable.wound_radius for cable in cables])
    torques = np.array([cable.torque_limit for cable in cables]) + radii * tensions
    accelerations = torques / np.array([cable.rotor_inertia for cable in cables])
    noise = (0.0, 0.0)
    if WINCH_STATE in testbed.sensors:
        angle, speed, _ = _deviations(testbed.sensors[WINCH_STATE])
        noise = (angle, speed)
    return DriveMotion(testbed.cable_names, accelerations, noise, period_ns)


def torque_balance(scenario: Scenario, testbed: Testbed) -> TorqueBalance:
    """Return the balance of the winches, of those that carry a cable."""
    cables, wanted = testbed.cables, scenario.safety.torque_mismatch
    allowed = [wanted or TORQUE_SHARE * cable.torque_limit for cable in cables]
    return TorqueBalance(
        testbed.cable_names,
        np.array([cable.wound_radius for cable in cables]),
        np.array([cable.rotor_inertia for cable in cables]),
        np.array(allowed),
        np.array([cable.has_cable for cable in cables]),
    )


def _bodies(scenario: Scenario, points: tuple[Array, Array]) -> dict[str, tuple[Array, Array]]:
    """Return mean position (3,) and points (k, 3) of each body, by the topic of its poses."""
    exits, attachments = points
    found = {
        BAR_POSE: (scenario.bar_mean_pose, attachments),
        FRAME_POSE: (scenario.winch_frame.mean_pose, exits),
        TARGET_POSE: (scenario.target.mean_pose, attachments),
    }
    return {name: (np.array(pose[:3]), each) for name, (pose, each) in found.items()}
