"""What the viewer's node shows of a run, over real ROS 2."""

import numpy as np
import pytest
from ros_graph import load_ros, new_domain
from run_samples import bundle_of

load_ros()

from cspm_msgs_py.ros.qos import contract_qos  # noqa: E402
from cspm_msgs_py.ros.session import Session  # noqa: E402
from cspm_msgs_py.ros_types import deserialize, typestore  # noqa: E402
from cspm_msgs_py.topics import SCENE  # noqa: E402
from cspm_ros.scene.viewer_node import ViewerNode  # noqa: E402
from cspm_ros.schema_types.schema_class import message_class_of  # noqa: E402

PATIENCE_S = 30.0
POSE = np.array([0.1, -0.2, 1.6, 0.0, 0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def testbed():
    return bundle_of("calm").testbed.testbed


class Viewer:
    """What RViz would hear: the scene's topics, with the durability that it asks for."""

    def __init__(self, node):
        self.heard = {name: [] for name in SCENE}
        for name, topic in SCENE.items():
            node.create_subscription(
                message_class_of(topic.ros_type, typestore()),
                name,
                self.heard[name].append,
                contract_qos(10, latched=topic.latched),
                raw=True,
            )

    def last(self, name):
        return deserialize(self.heard[name][-1], SCENE[name].ros_type)


def test_a_viewer_that_comes_later_gets_frames_urdf_and_markers(testbed):
    with Session(domain_id=new_domain()) as session:
        shown = ViewerNode(session.node("viewer"), testbed)
        plant = session.node("plant")
        send = {
            name: plant.publisher(testbed.topics[name])
            for name in ("/bar/pose", "/winch_frame/pose")
        }
        viewer, stamps = Viewer(session.node("rviz").node), iter(range(10**6, 10**12, 10**6))

        def speak():
            now = next(stamps)
            for each in send.values():
                each(now, now, POSE)

        session.every(0.02, speak)
        assert session.spin_until(lambda: all(viewer.heard.values()), PATIENCE_S)
        assert shown.drawn > 0
    bodies = [frame.child_frame_id for frame in viewer.last("/tf").transforms]
    assert bodies == ["winch_frame_ned", "bar_ned"]
    at = viewer.last("/tf").transforms[1].transform.translation
    assert (at.x, at.y, at.z) == tuple(POSE[:3])
    assert viewer.last("/tf_static").transforms[0].header.frame_id == "world"
    assert viewer.last("/robot_description").data.startswith("<?xml")
    assert len(viewer.last("/markers").markers[0].points) == 2 * len(testbed.cables)


def test_nothing_is_drawn_while_nothing_is_said(testbed):
    with Session(domain_id=new_domain()) as session:
        shown = ViewerNode(session.node("viewer"), testbed)
        looks = []
        session.every(0.06, lambda: looks.append(shown.drawn))
        assert session.spin_until(lambda: len(looks) > 5, PATIENCE_S)
    assert set(looks) == {0}


def test_what_cannot_be_read_is_said_and_not_drawn(testbed, capfd):
    with Session(domain_id=new_domain()) as session:
        shown = ViewerNode(session.node("viewer"), testbed)
        publish = session.node("stranger").raw_publisher(testbed.topics["/bar/pose"])
        session.every(0.05, lambda: publish(b"\x00\x01\x00\x00"))
        said = []

        def heard():
            said.append(capfd.readouterr().err)
            return "/bar/pose" in "".join(said)

        assert session.spin_until(heard, PATIENCE_S)
        assert shown.drawn == 0
    assert "4 bytes that are no geometry_msgs/msg/PoseStamped" in "".join(said)
