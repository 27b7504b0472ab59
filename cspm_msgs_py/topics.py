"""The public topics: name, ROS type, frame and the row of numbers that each carries.

A *row* is the flat float64 array in which simulation, control and recording pass a message's
numbers around; the message's stamp travels beside it as integer nanoseconds. SI units, radians,
z down. Poses are `x y z qx qy qz qw`, twists and accelerations `vx vy vz wx wy wz`, wrenches
`fx fy fz mx my mz`; all of them in the frame that `frame_id` names.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cspm_msgs_py.dofs import DOFS

WORLD_FRAME = "world_ned"
WINCH_FRAME = "winch_frame_ned"
BAR_FRAME = "bar_ned"
TARGET_FRAME = "target_ned"

POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
TWIST = ("vx", "vy", "vz", "wx", "wy", "wz")
ACCELERATION = ("ax", "ay", "az", "alphax", "alphay", "alphaz")
WRENCH = ("fx", "fy", "fz", "mx", "my", "mz")

QOS_RELIABILITY = "reliable"
QOS_DEPTH = 10
# What a sender keeps for readers that are held up: 0.1 s at 1 kHz.
SENDER_DEPTH = 100


@dataclass(frozen=True)
class Topic:
    """One topic of the contract.

    Attributes:
        name: absolute ROS topic name.
        ros_type: ROS 2 interface name, `package/msg/Type`.
        frame_id: the header's frame, empty where the type has none or it has no meaning.
        fields: names of the row's columns, in order; one per number in the message.
        joint_names: names inside the message (cables, or the moving body), in order.
        parts: for JointState, which of position, velocity, effort are filled.
        latched: sent once, and kept for readers who come later.
    """

    name: str
    ros_type: str
    frame_id: str
    fields: tuple[str, ...]
    joint_names: tuple[str, ...] = ()
    parts: tuple[str, ...] = ()
    latched: bool = False

    @property
    def width(self) -> int:
        """Number of float64 columns of the row."""
        return len(self.fields)


def _joint_state(name: str, cables: Sequence[str], parts: Sequence[str]) -> Topic:
    fields = tuple(f"{part}/{cable}" for part in parts for cable in cables)
    return Topic(name, "sensor_msgs/msg/JointState", "", fields, tuple(cables), tuple(parts))


def _pose(name: str) -> Topic:
    return Topic(name, "geometry_msgs/msg/PoseStamped", WORLD_FRAME, POSE)


def _twist(name: str) -> Topic:
    return Topic(name, "geometry_msgs/msg/TwistStamped", WORLD_FRAME, TWIST)


def _reference(name: str, body_frame: str) -> Topic:
    return Topic(
        name,
        "trajectory_msgs/msg/MultiDOFJointTrajectory",
        WORLD_FRAME,
        POSE + TWIST + ACCELERATION,
        (body_frame,),
    )


CLOCK = Topic("/clock", "rosgraph_msgs/msg/Clock", "", ())
DIAGNOSTICS = Topic("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", "", ())
EMERGENCY_STOP = Topic("/emergency_stop", "std_msgs/msg/Bool", "", ())
BRAKE = Topic("/winches/brake", "std_msgs/msg/Bool", "", ())
# Whether the winches are in their safe state, so that nobody's wanted wrench is followed.
SAFE = Topic("/winches/safe", "std_msgs/msg/Bool", "", ())
# Of all nodes in a domain, whatever their namespace.
ROSOUT = Topic("/rosout", "rcl_interfaces/msg/Log", "", ())
PARAMETER_EVENTS = Topic("/parameter_events", "rcl_interfaces/msg/ParameterEvent", "", ())

TF = Topic("/tf", "tf2_msgs/msg/TFMessage", "", ())
TF_STATIC = Topic("/tf_static", TF.ros_type, "", (), latched=True)
ROBOT_DESCRIPTION = Topic("/robot_description", "std_msgs/msg/String", "", (), latched=True)
MARKERS = Topic("/markers", "visualization_msgs/msg/MarkerArray", "", ())
# What others' viewers draw from. It follows from other topics: nothing reads it in a run.
SCENE = {topic.name: topic for topic in (TF_STATIC, ROBOT_DESCRIPTION, TF, MARKERS)}


def contract_topics(
    cables: Sequence[str], *, has_bar: bool, has_winch_frame: bool
) -> dict[str, Topic]:
    """Return the topics that a test-bed with these parts can have, by name, in contract order.

    Args:
        cables: cable names in the order of the test-bed file.
        has_bar: whether a bar hangs on the cables, which may follow a target.
        has_winch_frame: whether the winches ride on a moving frame.
    """
    topics = [CLOCK]
    bodies = [("winch_frame", WINCH_FRAME)] * has_winch_frame + [("bar", BAR_FRAME)] * has_bar
    bodies += [("target", TARGET_FRAME)] * has_bar
    topics += [_reference(f"/{body}/reference", frame) for body, frame in bodies]
    for body, _ in bodies:
        topics.append(_pose(f"/{body}/pose"))
        if body != "target":
            topics.append(_twist(f"/{body}/twist"))
    topics += _winch_topics("", cables)
    if has_bar:
        topics.append(
            Topic("/wrench_command", "geometry_msgs/msg/WrenchStamped", WORLD_FRAME, WRENCH)
        )
    topics += [
        _joint_state("/tension_command", cables, ["effort"]),
        _joint_state("/winches/torque_command", cables, ["effort"]),
        *(_internals(cables) if has_bar else ()),
        DIAGNOSTICS,
    ]
    for body, _ in bodies:
        topics += [_pose(f"/truth/{body}/pose"), _twist(f"/truth/{body}/twist")]
    topics += _winch_topics("/truth", cables)
    topics.append(_joint_state("/truth/cables/unstretched_length", cables, ["position"]))
    return {topic.name: topic for topic in topics}


def _internals(cables: Sequence[str]) -> list[Topic]:
    """Return what controllers compute on the way; a JointState's `effort` as named numbers."""
    described = {
        "/motion_controller": (("error", "proportional", "integral", "derivative"), DOFS),
        "/tension_distribution": (("unlimited", "limit"), cables),
        "/force_controller": (("proportional", "integral"), cables),
    }
    return [
        _joint_state(
            f"{node}/internals", [f"{what}_{of}" for what in kinds for of in names], ["effort"]
        )
        for node, (kinds, names) in described.items()
    ]


def _winch_topics(prefix: str, cables: Sequence[str]) -> list[Topic]:
    return [
        _joint_state(f"{prefix}/winches/state", cables, ["position", "velocity", "effort"]),
        _joint_state(f"{prefix}/cables/tension", cables, ["effort"]),
    ]
