"""What viewers of others are shown: frames, cables, wrench and reference."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cspm_model.kinematics import inverse_kinematics
from cspm_model.parameters import nominal_parameters
from cspm_model.scene.marked_message import MarkedMessage
from cspm_model.scene.scene import Scene
from cspm_model.scene.transforms import turned
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.ros_types import deserialize, message_class
from cspm_msgs_py.topics import SCENE

STAMP = 12_345_678_901
"""[ns]"""
ANGLES = np.array([0.2, -0.1, 0.3])
"""φ θ ψ of the bar [rad]."""


@pytest.fixture(scope="module")
def testbed(thesis):
    return thesis


def pose_row(place, angles):
    return np.array([*place, *Rotation.from_euler("xyz", angles).as_quat()])


BAR = pose_row([0.1, -0.2, 1.6], ANGLES)
FRAME = pose_row([0.02, 0.03, -0.01], [0.05, 0.02, -0.04])


def scene_of(testbed, **rows):
    """Return a scene that heard rows, by topic with _ for /."""
    scene = Scene(testbed, testbed.topics)
    for name, row in rows.items():
        scene.take("/" + name.replace("__", "/"), STAMP, np.asarray(row, dtype=float))
    return scene


def moving(scene):
    return {
        message.topic: deserialize(message.payload, SCENE[message.topic].ros_type)
        for message in scene.moving()
    }


def placed(transforms):
    """Return each frame's pose in the root by following parents, as (rotation, place)."""
    known = {t.child_frame_id: t for t in transforms}

    def of(name):
        if name not in known:
            return Rotation.identity(), np.zeros(3)
        found = known[name]
        turn, place = found.transform.rotation, found.transform.translation
        above, origin = of(found.header.frame_id)
        own = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w])
        return above * own, origin + above.apply([place.x, place.y, place.z])

    return {name: of(name) for name in known}


def frames(testbed, **rows):
    scene = scene_of(testbed, **rows)
    lasting = {message.topic: message for message in scene.lasting()}
    fixed = deserialize(lasting["/tf_static"].payload, "tf2_msgs/msg/TFMessage").transforms
    return placed([*fixed, *moving(scene)["/tf"].transforms])


def test_the_root_has_z_up_and_every_frame_hangs_on_it(testbed):
    found = frames(testbed, bar__pose=BAR, winch_frame__pose=FRAME)
    down, _ = found["world_ned"]
    assert down.apply([0.0, 0.0, 1.0]) == pytest.approx([0.0, 0.0, -1.0])
    assert down.apply([1.0, 0.0, 0.0]) == pytest.approx([1.0, 0.0, 0.0])
    _, bar = found["bar_ned"]
    assert bar == pytest.approx([0.1, 0.2, -1.6])


def test_cables_between_frames_are_as_long_as_kinematics_says(testbed):
    """The lengths of the model are an independent road to frames, signs and turns."""
    found = frames(testbed, bar__pose=BAR, winch_frame__pose=FRAME)
    lengths = [
        np.linalg.norm(found[f"{name}_exit"][1] - found[f"{name}_attachment"][1])
        for name in testbed.cable_names
    ]
    bar = [*BAR[:3], *ANGLES]
    frame = [*FRAME[:3], 0.05, 0.02, -0.04]
    model = inverse_kinematics(nominal_parameters(testbed).cables, bar, frame)
    assert lengths == pytest.approx(model, abs=1e-12)


def test_markers_end_where_the_frames_are(testbed):
    scene = scene_of(testbed, bar__pose=BAR, winch_frame__pose=FRAME)
    cables, _, _ = moving(scene)["/markers"].markers
    found = frames(testbed, bar__pose=BAR, winch_frame__pose=FRAME)
    down, _ = found["world_ned"]
    for i, name in enumerate(testbed.cable_names):
        for end, point in zip(("exit", "attachment"), cables.points[2 * i :], strict=False):
            at = down.apply([point.x, point.y, point.z])
            assert at == pytest.approx(found[f"{name}_{end}"][1], abs=1e-12)
    assert cables.header.frame_id == "world_ned"
    assert (cables.header.stamp.sec, cables.header.stamp.nanosec) == (12, 345_678_901)


def test_colours_follow_tension(testbed):
    limits = np.array([cable.tension_limits[1] for cable in testbed.cables])
    rows = {"bar__pose": BAR, "winch_frame__pose": FRAME}

    def colours(tensions):
        scene = scene_of(testbed, **rows, cables__tension=tensions)
        found = moving(scene)["/markers"].markers[0].colors
        return np.array([[c.r, c.g, c.b, c.a] for c in found[::2]])

    slack, taut = colours(0.0 * limits), colours(limits)
    assert (slack[:, 2] > slack[:, 0]).all()
    assert (taut[:, 0] > taut[:, 2]).all()
    assert (colours(9.0 * limits) == taut).all()
    mixed = colours(np.where(np.arange(len(limits)) == 3, limits, 0.0))
    assert (mixed[3] == taut[3]).all()
    assert (mixed[4] == slack[4]).all()
    unknown = moving(scene_of(testbed, **rows))["/markers"].markers[0].colors[0]
    assert unknown.r == unknown.g == unknown.b


def test_wrench_and_reference_are_seen_once_they_are_there(testbed):
    rows = {"bar__pose": BAR, "winch_frame__pose": FRAME}
    _, arrow, box = moving(scene_of(testbed, **rows))["/markers"].markers
    assert (arrow.color.a, box.color.a) == (0.0, 0.0)
    wanted = np.array([*pose_row([0.0, 0.0, 1.5], [0.0, 0.0, 0.1]), *np.zeros(12)])
    wrench = [0.0, 0.0, -20.0, 0.0, 0.0, 0.0]
    scene = scene_of(testbed, **rows, wrench_command=wrench, bar__reference=wanted)
    _, arrow, box = moving(scene)["/markers"].markers
    assert min(arrow.color.a, box.color.a) > 0.0
    assert arrow.points[1].z < arrow.points[0].z == BAR[2]
    assert (box.pose.position.z, box.pose.orientation.z) == (1.5, wanted[5])


def test_bodies_that_were_not_heard_are_not_shown(testbed):
    assert moving(scene_of(testbed)) == {}
    found = moving(scene_of(testbed, bar__pose=BAR))
    assert [t.child_frame_id for t in found["/tf"].transforms] == ["bar_ned"]
    assert "/markers" not in found


def test_a_body_without_sensor_is_drawn_where_the_simulation_has_it(testbed):
    topics = {name: topic for name, topic in testbed.topics.items() if name != "/bar/pose"}
    scene = Scene(testbed, topics)
    assert "/truth/bar/pose" in scene.sources
    assert "/truth/winch_frame/pose" not in scene.sources


def test_quaternions_turn_points_as_scipy_does():
    rng = np.random.default_rng(4)
    for _ in range(20):
        rotation = Rotation.random(random_state=rng)
        points = rng.normal(size=(5, 3))
        assert turned(rotation.as_quat(), points) == pytest.approx(rotation.apply(points))
        assert turned(rotation.inv().as_quat(), points) != pytest.approx(rotation.apply(points))


def test_a_marked_message_is_that_of_the_serialiser():
    point, header = (
        message_class("geometry_msgs/msg/PointStamped"),
        message_class("std_msgs/msg/Header"),
    )
    place, time = (
        message_class("geometry_msgs/msg/Point"),
        message_class("builtin_interfaces/msg/Time"),
    )

    def build(stamps, doubles, _):
        return point(header(stamps[0], "odd"), place(*doubles))

    made = MarkedMessage(build, stamps=1, doubles=3).bytes_of([STAMP], np.array([1.0, -2.0, 3.5]))
    message = point(header(time(12, 345_678_901), "odd"), place(1.0, -2.0, 3.5))
    assert deserialize(made, "geometry_msgs/msg/PointStamped") == message


def test_a_number_that_is_used_twice_or_not_at_all_is_refused():
    point = message_class("geometry_msgs/msg/Point")
    for build in (lambda _, d, __: point(d[0], d[0], 0.0), lambda *_: point(0.0, 0.0, 0.0)):
        with pytest.raises(InputError) as caught:
            MarkedMessage(build, stamps=0, doubles=1)
        assert str(caught.value) == "1 marks are not in the message once, allowed: each once"
