"""The variables of a plant as a unit of FMI 2, by quantity and column."""

from __future__ import annotations

from collections.abc import Iterable

from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.testbed import Testbed

COMMAND, BRAKE = "torque_command", "brake"
POSE, TWIST, FRAME = "bar_pose", "bar_twist", "frame_pose"
ANGLE, SPEED, TORQUE = "winch_angle", "winch_speed", "winch_torque"
TENSION, LENGTH = "tension", "unstretched_length"

# Of an exported unit's resources: what a recording of the run would carry.
RUN_FOLDER = "run"
# What each is, in SI; quantities, columns and signs are those of a recording.
MEANINGS = {
    COMMAND: "torque wanted of the motor, held over a step, positive winds in [N·m]",
    POSE: "bar in world_ned, z down: x y z [m], roll pitch yaw [rad]",
    TWIST: "bar in world_ned: velocity [m/s], angular velocity [rad/s]",
    FRAME: "winch frame in world_ned, z down: x y z [m], roll pitch yaw [rad]",
    ANGLE: "of the motor, positive winds in [rad]",
    SPEED: "of the motor [rad/s]",
    TORQUE: "as the drive reports it [N·m]",
    TENSION: "on the bar's side of the exit [N]",
    LENGTH: "of the cable outside the drum [m]",
}


def names_of(quantity: str, testbed: Testbed) -> tuple[str, ...]:
    """Return the names of a quantity's variables, such as `tension.hoist_1`."""
    columns = DOFS if quantity in (POSE, TWIST, FRAME) else testbed.cable_names
    return tuple(f"{quantity}.{column}" for column in columns)


def outputs_of(testbed: Testbed) -> tuple[str, ...]:
    """Return the quantities that a machine's plant tells."""
    return (*_bodies(testbed), ANGLE, SPEED, TORQUE, TENSION, LENGTH)


def _bodies(testbed: Testbed) -> Iterable[str]:
    if testbed.bar:
        yield from (POSE, TWIST)
    if testbed.winch_frame:
        yield FRAME
