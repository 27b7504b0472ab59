"""Batches of messages taken from the real middleware, with what is missing among them."""

import numpy as np
import pytest
from ros_graph import load_ros, new_domain

load_ros()

from cspm_msgs_py.ros.contract_node import ros_class  # noqa: E402 - after ROS is known to be there
from cspm_msgs_py.ros.intake import DEPTH, Intake  # noqa: E402
from cspm_msgs_py.ros.session import Session  # noqa: E402
from cspm_msgs_py.topics import contract_topics  # noqa: E402
from cspm_msgs_py.wire import WireReader  # noqa: E402

PATIENCE_S = 20.0
FLOOD = 6000  # more than Fast DDS lets wait
TOPICS = contract_topics(["a", "b"], has_bar=False, has_winch_frame=False)
TENSION, COMMAND = TOPICS["/cables/tension"], TOPICS["/tension_command"]


@pytest.fixture(scope="module")
def domain():
    return new_domain()


@pytest.fixture
def session(domain):
    with Session(domain_id=domain) as session:
        session.node("sender")
        yield session


class Reader:
    """An intake on two topics that notes what it hands on."""

    def __init__(self, session, **arguments):
        self.node = session.node("reader")
        self.intake = Intake(self.node.node)
        self.taken = {TENSION.name: [], COMMAND.name: []}
        for topic in (TENSION, COMMAND):
            keep = self.taken[topic.name]
            self.intake.subscribe(
                topic,
                ros_class(topic.ros_type),
                lambda payload, at, _, keep=keep: keep.append((payload, at)),
                **arguments,
            )

    def stamps(self, topic):
        decode = WireReader(topic).decode
        return [decode(payload)[0] for payload, _ in self.taken[topic.name]]


def sender_of(session, node, topic):
    """Return what publishes a message of a stamp, once the reader is connected."""
    send = node.publisher(topic, ["reader"])
    assert session.spin_until(lambda: not node.unmatched(), PATIENCE_S), node.unmatched()
    return lambda stamp: send(stamp, stamp, np.array([1.0, 2.0]))


def taken(session, reader, topic, count):
    """Take until so many messages of a topic are there."""

    def there():
        reader.intake.take()
        return len(reader.taken[topic.name]) >= count

    assert session.spin_until(there, PATIENCE_S)
    return reader.stamps(topic)


def test_it_hands_on_all_that_came_in_order_with_the_time(session):
    reader = Reader(session)
    node = session._nodes[0]
    before = node.now_ns()
    send = sender_of(session, node, TENSION)
    # No executor takes them: they wait until they are asked for.
    for stamp in range(500):
        send(stamp)
    assert taken(session, reader, TENSION, 500) == list(range(500))
    times = [at for _, at in reader.taken[TENSION.name]]
    assert times == sorted(times)
    assert before <= times[0] <= times[-1] <= node.now_ns()
    assert reader.taken[COMMAND.name] == []
    reader.intake.take()
    assert len(reader.taken[TENSION.name]) == 500
    assert reader.intake.lost == {TENSION.name: 0, COMMAND.name: 0}


def test_what_did_not_wait_is_lost_and_counted(session):
    reader = Reader(session, depth=10)
    node = session._nodes[0]
    send = sender_of(session, node, TENSION)
    send(0)
    taken(session, reader, TENSION, 1)
    for stamp in range(1, 201):
        send(stamp)
    stamps = taken(session, reader, TENSION, 11)
    assert stamps == [0, *range(191, 201)]
    assert reader.intake.lost == {TENSION.name: 190, COMMAND.name: 0}


@pytest.mark.parametrize(("depth", "arrives"), [(DEPTH, False), (None, True)])
def test_a_flood_pushes_nothing_out_where_all_waits(session, depth, arrives):
    """Neither what waits already, nor what comes when no more fits."""
    reader = Reader(session, depth=depth, numbered=False)
    send = sender_of(session, session._nodes[0], TENSION)
    stranger = sender_of(session, session.node("stranger"), TENSION)
    send(1)
    for _ in range(FLOOD):
        stranger(0)
    send(2)

    def there():
        reader.intake.take()
        return 2 in reader.stamps(TENSION)

    assert session.spin_until(there, PATIENCE_S)
    assert (1 in reader.stamps(TENSION)) == arrives


def test_one_look_ends_while_a_flood_goes_on(session):
    class Endless:  # a subscription whose messages never end
        def take_message(self, *_):
            return b"", {"publication_sequence_number": None, "received_timestamp": 0}

    reader = Reader(session)
    reader.intake._inlets[0].handle = Endless()
    reader.intake.take()
    assert 0 < len(reader.taken[TENSION.name]) <= DEPTH


def test_a_strangers_numbers_are_no_losses(session):
    reader = Reader(session)
    send = sender_of(session, session._nodes[0], TENSION)
    stranger = sender_of(session, session.node("stranger"), TENSION)
    for stamp in range(100):
        send(stamp)
    taken(session, reader, TENSION, 100)
    for stamp in range(100, 110):
        stranger(stamp)
        send(stamp)
        taken(session, reader, TENSION, 100 + 2 * (stamp - 99))
    assert reader.intake.lost == {TENSION.name: 0, COMMAND.name: 0}


def test_where_numbers_mean_nothing_nothing_is_lost(session):
    reader = Reader(session, depth=10, numbered=False)
    send = sender_of(session, session._nodes[0], TENSION)
    for stamp in range(100):
        send(stamp)
    taken(session, reader, TENSION, 10)
    assert reader.intake.lost == {TENSION.name: 0, COMMAND.name: 0}


def test_closed_it_takes_nothing(session):
    reader = Reader(session)
    node = session._nodes[0]
    sender_of(session, node, TENSION)
    reader.intake.close()
    reader.intake.take()
    assert reader.taken[TENSION.name] == []
    assert reader.intake.lost == {}
    assert session.spin_until(
        lambda: not node.node.get_subscriptions_info_by_topic(TENSION.name), PATIENCE_S
    )
