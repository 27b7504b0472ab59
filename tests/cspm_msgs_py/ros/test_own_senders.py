"""Programs of the user's are waited for until they can see who reads from them."""

import time

from ros_graph import load_ros, new_domain
from run_samples import bundle_of

load_ros()

from cspm_msgs_py.ros.contract_node import ros_class  # noqa: E402 - after ROS is known to be there
from cspm_msgs_py.ros.own_senders import OwnSenders  # noqa: E402
from cspm_msgs_py.ros.qos import contract_qos  # noqa: E402
from cspm_msgs_py.ros.rendezvous import SETTLE_S  # noqa: E402
from cspm_msgs_py.ros.session import Session  # noqa: E402
from cspm_msgs_py.schedule import MOTION_CONTROLLER, schedule_of  # noqa: E402

PATIENCE_S = 20.0
WRENCH = "/wrench_command"


def schedule():
    bundle = bundle_of("rest")
    return schedule_of(bundle.scenario, bundle.testbed.testbed)


def test_a_sender_is_there_once_it_had_time_to_see_its_readers():
    with Session(domain_id=new_domain()) as session:
        senders = OwnSenders(session.node("recorder"), schedule(), [MOTION_CONTROLLER], [WRENCH])
        other = session.node("own").node
        assert not senders.ready()
        kind = ros_class("geometry_msgs/msg/WrenchStamped")
        publisher = other.create_publisher(kind, WRENCH, contract_qos())
        begun = time.monotonic()
        assert session.spin_until(senders.ready, PATIENCE_S)
        assert time.monotonic() - begun >= SETTLE_S
        other.destroy_publisher(publisher)
        assert session.spin_until(lambda: not senders.ready(), PATIENCE_S)
        again = time.monotonic()
        other.create_publisher(kind, WRENCH, contract_qos())
        assert session.spin_until(senders.ready, PATIENCE_S)
        assert time.monotonic() - again >= SETTLE_S


def test_what_a_node_does_not_read_from_them_is_not_waited_for():
    with Session(domain_id=new_domain()) as session:
        node = session.node("force_controller")
        assert OwnSenders(node, schedule(), [MOTION_CONTROLLER], ["/tension_command"]).ready()
        assert OwnSenders(node, schedule(), [], [WRENCH]).ready()
        assert not OwnSenders(node, schedule(), [MOTION_CONTROLLER], [WRENCH]).ready()
