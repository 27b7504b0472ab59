"""Batches of messages taken from the real middleware, with what is missing among them."""

import numpy as np
import pytest
from ros_graph import load_ros, new_domain

load_ros()

from cspm_msgs_py.ros.contract_node import ros_class  # noqa: E402 - after ROS is known to be there
from cspm_msgs_py.ros.intake import DEPTH, Intake  # noqa: E402
from cspm_msgs_py.ros.session import Session  # noqa: E402
from cspm_msgs_py.topics import contract_topics  # noqa: E402
from cspm_msgs_py.wire import WireReader, WireWriter  # noqa: E402

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


class Counter:
    """Knows what is due of a topic, from stamp and number 1, and keeps all that it is given."""

    def __init__(self):
        self.due, self.rows, self.others = (1, 1, 1), [], []

    def receive_rows(self, rows):
        self.rows += rows.tolist()
        stamp, step, number = self.due
        self.due = stamp + step * len(rows), step, number + len(rows)

    def receive_other(self, payload, number):
        if payload == b"none at all.":
            self.others.append(number)
            return
        stamp, row = WireReader(COMMAND).decode(payload)
        assert (stamp, number) == (self.due[0], self.due[2] + len(self.others))
        self.receive_rows(row[None])

    def receive(self, payloads, numbers):
        for payload, number in zip(payloads, numbers, strict=True):
            self.receive_other(payload, number)


class Store:
    """Keeps rows of one publisher, in room for a few at a time."""

    def __init__(self, publisher=None):
        self.publisher, self.rows, self.stamps, self.received = publisher, [], [], []
        self._times, self._room = np.empty((7, 2), dtype=np.int64), np.empty((7, TENSION.width))

    def room(self):
        return self._times, self._room

    def stored(self, count):
        self.rows += self._room[:count].tolist()
        self.stamps += self._times[:count, 0].tolist()
        self.received += self._times[:count, 1].tolist()


ROADS = [pytest.param("rcl", marks=pytest.mark.compiled), "rclpy"]


@pytest.fixture(params=ROADS)
def road(request, monkeypatch):
    if request.param == "rclpy":
        monkeypatch.setattr("cspm_msgs_py.ros.intake.take_address", lambda: None)


@pytest.mark.usefixtures("road")
def test_rows_come_whether_rcl_is_called_or_rclpy(session):
    reader, rows, others = Reader(session), [], []
    decode = WireReader(TENSION).decode

    def take(stamp, row, number):
        rows.append((stamp, row.tolist(), number))

    def take_bytes(payload, _, number):
        if payload == b"none at all.":
            others.append(number)
        else:
            take(*decode(payload), number)

    reader.intake.subscribe_rows(TENSION, ros_class(TENSION.ros_type), take, take_bytes)
    counter = Counter()
    reader.intake.subscribe_due(COMMAND, ros_class(COMMAND.ros_type), counter)
    node = session._nodes[0]
    raw = {topic: node.raw_publisher(topic, ["reader"]) for topic in (TENSION, COMMAND)}
    assert session.spin_until(lambda: not node.unmatched(), PATIENCE_S), node.unmatched()
    for topic, send in raw.items():
        encode = WireWriter(topic).encode
        for stamp in range(1, 301):
            if stamp == 201:
                send(b"none at all.")
            send(encode(stamp, np.array([stamp, 0.5])))

    def there():
        reader.intake.take()
        return len(rows) == len(counter.rows) == 300

    assert session.spin_until(there, PATIENCE_S)
    sent = [[float(stamp), 0.5] for stamp in range(1, 301)]
    assert rows == [(s, sent[s - 1], s + (s > 200)) for s in range(1, 301)]
    assert (others, counter.rows, counter.others) == ([201], sent, [201])


@pytest.mark.usefixtures("road")
def test_a_store_gets_the_rows_of_its_publisher_and_all_else_is_handed_on(session, request):
    """Strangers' messages, malformed ones and whatever came before the publisher was known."""
    node, other = session._nodes[0], session.node("stranger")
    intake, store, others = Intake(session.node("reader").node), Store(), []
    intake.subscribe_tagged(TENSION, ros_class(TENSION.ros_type), others.append, store=store)
    send, strange = (sender_of(session, each, TENSION) for each in (node, other))
    raw, before = node.raw_publisher(TENSION, ["reader"]), node.now_ns()

    def there(count):
        def look():
            intake.take()
            return len(others) + len(store.rows) == count

        assert session.spin_until(look, PATIENCE_S)

    send(1)
    there(1)
    store.publisher = others[0].gid
    for stamp in range(2, 32):
        send(stamp)
    there(31)
    strange(77)
    there(32)
    for stamp in range(32, 42):
        send(stamp)
    raw(b"none at all.")
    there(43)
    decode = WireReader(TENSION).decode
    handed = [each.payload for each in others if each.payload != b"none at all."]
    stamps = [decode(payload)[0] for payload in handed]
    if "rcl]" in request.node.name:
        # After another's number nobody knows the next one of the sender's.
        assert stamps == [1, 77, 32]
        assert store.rows == [[1.0, 2.0]] * len(store.rows)
        assert before <= store.received[0] <= store.received[-1] <= node.now_ns()
        assert store.received == sorted(store.received)
    else:
        assert store.stamps == []
    assert sorted(stamps + store.stamps) == [*range(1, 42), 77]
    assert len(others) - len(handed) == 1
    assert intake.lost == {TENSION.name: 0}
    intake.close()


@pytest.mark.usefixtures("road")
def test_a_row_is_the_readers_own(session):
    reader, rows = Reader(session), []
    reader.intake.subscribe_rows(
        TENSION,
        ros_class(TENSION.ros_type),
        lambda _stamp, row, _number: rows.append(row),
        lambda payload, *_: rows.append(WireReader(TENSION).decode(payload)[1]),
    )
    send = sender_of(session, session._nodes[0], TENSION)

    def both():
        reader.intake.take_one()
        return len(rows) == 2

    send(1)
    send(2)
    assert session.spin_until(both, PATIENCE_S)
    rows[0][:] = 9.0
    np.testing.assert_array_equal(rows[1], [1.0, 2.0])


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
