"""Nodes of a run find each other over the real middleware, whatever strangers say."""

import pytest
from ros_graph import load_ros, new_domain

load_ros()

from cspm_msgs_py.ros.contract_node import ros_class  # noqa: E402 - after ROS is known to be there
from cspm_msgs_py.ros.qos import contract_qos  # noqa: E402
from cspm_msgs_py.ros.rendezvous import END, START, FollowerSide, PlantSide  # noqa: E402
from cspm_msgs_py.ros.session import Session  # noqa: E402
from cspm_msgs_py.topics import DIAGNOSTICS  # noqa: E402

PERIOD_NS = 1_000_000
PATIENCE_S = 20.0


@pytest.mark.parametrize("topic", [START, END])
def test_a_node_announces_itself_whoever_says_that_the_run_began_or_ended(topic):
    """The plant, which comes later, hears of it all the same."""
    with Session(domain_id=new_domain()) as session:
        heard = []
        follower = FollowerSide(
            session.node("recorder"), PERIOD_NS, on_start=lambda stamp: heard.append(stamp)
        )
        stranger = session.node("stranger")
        header = ros_class("std_msgs/msg/Header")
        said = stranger.node.create_publisher(header, topic, contract_qos())

        def reported():
            said.publish(header())
            return bool(heard) if topic == START else follower.end_ns == 0

        assert session.spin_until(reported, PATIENCE_S)
        plant = PlantSide(session.node("plant"), PERIOD_NS, ["recorder"], lambda *_: None)
        assert session.spin_until(lambda: not plant.absent, PATIENCE_S), plant.absent


def test_who_is_not_there_is_named_before_those_who_wait_for_it():
    with Session(domain_id=new_domain()) as session:

        def join(name, reader):
            """Add a node that announces itself once a reader is there."""
            node = session.node(name)
            node.raw_publisher(DIAGNOSTICS, [reader])
            return FollowerSide(node, PERIOD_NS)

        names = ["motion_controller", "wave_trajectory"]
        plant = PlantSide(session.node("plant"), PERIOD_NS, names, lambda *_: None)
        assert plant.unmatched() == names
        join("wave_trajectory", "motion_controller")
        assert session.spin_until(lambda: plant.unmatched() == names[:1], PATIENCE_S)
        join("motion_controller", "nobody")
        assert session.spin_until(lambda: plant.unmatched() == names, PATIENCE_S)


def test_a_reader_that_announces_nothing_is_named_before_those_who_wait_for_it():
    """A program of the user's in a controller's place is such a reader."""
    with Session(domain_id=new_domain()) as session:
        node = session.node("plant")
        node.raw_publisher(DIAGNOSTICS, ["own_program"])
        plant = PlantSide(node, PERIOD_NS, ["recorder"], lambda *_: None)
        assert plant.unmatched() == ["recorder"]
        waiting = session.node("recorder")
        waiting.raw_publisher(DIAGNOSTICS, ["own_program"])
        FollowerSide(waiting, PERIOD_NS)
        named = [f"{DIAGNOSTICS.name} (own_program)"]
        assert session.spin_until(lambda: plant.unmatched() == named, PATIENCE_S), plant.unmatched()
