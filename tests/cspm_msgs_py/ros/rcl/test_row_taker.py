"""Rows taken from rcl in compiled code: what the reader of single messages makes of the same."""

import random
from contextlib import contextmanager

import numpy as np
import pytest
from recorded_lockstep_runs import spoilt
from ros_graph import load_ros, new_domain
from wire_rows import TOPICS, rows_of

from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.message import message_of
from cspm_msgs_py.ros_types import serialize
from cspm_msgs_py.topics import POSE
from cspm_msgs_py.wire import WireReader, WireWriter

load_ros()

from cspm_msgs_py.ros.contract_node import ros_class  # noqa: E402
from cspm_msgs_py.ros.intake import Intake  # noqa: E402
from cspm_msgs_py.ros.rcl import rcl_message  # noqa: E402 - after ROS is known to be there
from cspm_msgs_py.ros.rcl.rcl_message import publish_address, take_address  # noqa: E402
from cspm_msgs_py.ros.rcl.row_taker import RowTaker, TakenBytes, TakenRow  # noqa: E402
from cspm_msgs_py.ros.session import Session  # noqa: E402

pytestmark = pytest.mark.compiled

PATIENCE_S = 20.0
MS = 1_000_000
TENSION, BAR = TOPICS["/cables/tension"], TOPICS["/bar/pose"]


@pytest.fixture(scope="module")
def domain():
    return new_domain()


class Line:
    """A sender of a topic, a taker of its messages, and rclpy's subscription beside it."""

    def __init__(self, session, topic):
        self.session, self.topic = session, topic
        self._sender, reader = session.node("sender"), session.node("reader")
        self.send = self._sender.raw_publisher(topic, ["reader"])
        self._class, self._next = ros_class(topic.ros_type), None
        self.intakes = [Intake(reader.node) for _ in range(2)]
        for intake in self.intakes:
            intake.subscribe_blocks(topic, self._class, lambda *_: None)
        ours, self._rclpy = [intake._inlets[0].handle for intake in self.intakes]
        self.taker = RowTaker(topic, ours.pointer, take_address())
        publisher = self._sender.node.publishers
        sender = next(each for each in publisher if each.topic_name == topic.name)
        assert session.spin_until(lambda: sender.get_subscription_count() == 2, PATIENCE_S)

    def plain(self):
        """Return bytes and number of the next message by rclpy."""
        assert self._comes() or self.session.spin_until(self._comes, PATIENCE_S)
        (payload, info), self._next = self._next, None
        return payload, info["publication_sequence_number"]

    def _comes(self):
        self._next = self._next or self._rclpy.take_message(self._class, True)
        return self._next is not None


@contextmanager
def line_of(domain, topic):
    with Session(domain_id=domain) as session:
        line = Line(session, topic)
        yield line
        line.taker.close()
        for intake in line.intakes:
            intake.close()


def assert_is(taken, payload, number, topic):
    """Check that a message was taken as what it is."""
    assert taken.number == number
    try:
        stamp, row = WireReader(topic).decode(payload)
    except InputError:
        assert taken == TakenBytes(payload, number)
        return False
    if isinstance(taken, TakenBytes):
        # It may be valid in another form than the contract's.
        assert taken.payload == payload != WireWriter(topic).encode(stamp, row)
        return False
    assert taken.stamp_ns == stamp
    np.testing.assert_array_equal(taken.row, row)
    return True


@pytest.mark.parametrize("topic", TOPICS.values(), ids=TOPICS)
def test_a_message_is_what_its_reader_makes_of_it(domain, topic):
    """Among valid messages are broken ones, other stamps, and longer ones: they move the buffer."""
    rng, encode, valid = random.Random(1), WireWriter(topic).encode, 0
    rows = np.tile(rows_of(topic), (12, 1))
    with line_of(domain, topic) as line:
        assert line.taker.take() is None
        for i, row in enumerate(rows):
            payload = encode(i * 999_999_999, row)
            wrong = spoilt(topic.name, payload, rng) + bytes(4)
            # A clock's message has no part of free length, so that a longer one is not sent.
            wrong = wrong if topic.fields else wrong[: len(payload)]
            for each in (wrong, payload) if rng.random() < 0.5 else (payload,):
                line.send(each)
                found = line.plain()
                valid += assert_is(line.taker.take(), *found, topic)
        assert line.taker.take() is None
    assert valid >= len(rows)


@pytest.mark.parametrize(
    ("length", "how"), [(1.0004, TakenRow), (1.0008, TakenBytes), (0.9992, TakenBytes)]
)
def test_a_quaternion_near_the_limit_gets_a_second_look(domain, length, how):
    row = rows_of(BAR)[0]
    row[3:7] *= length
    with line_of(domain, BAR) as line:
        line.send(WireWriter(BAR).encode(MS, row))
        line.plain()
        taken = line.taker.take()
    assert isinstance(taken, how)
    assert BAR.fields[: len(POSE)] == POSE


def test_another_frame_comes_as_bytes(domain):
    message = message_of(BAR, MS, rows_of(BAR)[0])
    message.header.frame_id = "elsewhere"
    with line_of(domain, BAR) as line:
        line.send(serialize(message))
        payload, number = line.plain()
        assert line.taker.take() == TakenBytes(payload, number)
    with pytest.raises(InputError, match="frame 'elsewhere', allowed: 'world_ned'"):
        WireReader(BAR).decode(payload)


class Block:
    """Messages of a topic with stamps that follow each other, sent."""

    def __init__(self, line, stamps):
        self.rows = np.random.default_rng(2).normal(size=(len(stamps), line.topic.width))
        encode = WireWriter(line.topic).encode
        self.payloads = [encode(s, row) for s, row in zip(stamps, self.rows, strict=True)]
        for payload in self.payloads:
            line.send(payload)
        for _ in stamps:
            line.plain()


def test_what_is_due_comes_together_up_to_a_limit(domain):
    with line_of(domain, TENSION) as line:
        block = Block(line, [3 * MS + 2 * MS * i for i in range(90)])
        first = line.taker.take_due(3 * MS, 2 * MS, 1, 10)
        np.testing.assert_array_equal(first.rows, block.rows[:10])
        second = line.taker.take_due(23 * MS, 2 * MS, 11, 2000)
        np.testing.assert_array_equal(second.rows, block.rows[10:74])
        third = line.taker.take_due(151 * MS, 2 * MS, 75, 2000)
        np.testing.assert_array_equal(third.rows, block.rows[74:])
        assert (first.other, second.other, third.other) == (None, None, None)
        rows, other = line.taker.take_due(183 * MS, 2 * MS, 91, 2000)
        assert (len(rows), other) == (0, None)


@pytest.mark.parametrize(
    ("stamps", "number"), [([1, 2, 4, 5], 1), ([1, 2, 2, 3], 1), ([1, 2, 1, 2], 1), ([1, 2], 2)]
)
def test_what_is_not_due_comes_as_bytes_after_what_is(domain, stamps, number):
    with line_of(domain, TENSION) as line:
        block = Block(line, [MS * stamp for stamp in stamps])
        rows, other = line.taker.take_due(MS, MS, number, 2000)
        due = 2 if number == 1 else 0
        np.testing.assert_array_equal(rows, block.rows[:due])
        assert other == TakenBytes(block.payloads[due], due + 1)
        # The rest is still there.
        rows, other = line.taker.take_due(stamps[due + 1] * MS, MS, due + 2, 2000)
        np.testing.assert_array_equal(rows, block.rows[due + 1 :])
        assert other is None


def test_what_rcl_refuses_is_reported():
    taker = RowTaker(TENSION, 0, take_address())
    with pytest.raises(
        CspmError, match=r"^/cables/tension: rcl takes no messages \(its code 400\)$"
    ):
        taker.take()
    with pytest.raises(CspmError, match=r"its code 400"):
        taker.take_due(0, MS, 1, 10)
    taker.close()
    # rcl would complain on standard error where another error takes the place of one that is left.
    is_set = rcl_message.rcl_library("librcutils.so").rcutils_error_is_set
    is_set.restype = rcl_message.ctypes.c_bool
    assert not is_set()


@pytest.mark.parametrize(
    ("find", "name"),
    [
        (take_address, "rcl_take_serialized_message"),
        (publish_address, "rcl_publish_serialized_message"),
    ],
)
def test_without_rcls_own_functions_or_compiled_code_there_is_no_address(monkeypatch, find, name):
    def look():
        # What is found under a patch must not be kept for others.
        return rcl_message._address.__wrapped__(name)

    assert find() == look() is not None
    with monkeypatch.context() as patch:
        patch.setattr(rcl_message.numba.config, "DISABLE_JIT", 1)
        assert look() is None
    with monkeypatch.context() as patch:
        patch.setattr(rcl_message, "rcl_library", lambda name: rcl_message.ctypes.CDLL(None))
        assert look() is None
    with monkeypatch.context() as patch:
        patch.setattr(rcl_message.ctypes, "CDLL", no_library)
        assert look() is None


def test_taking_and_publishing_are_two_functions():
    assert take_address() != publish_address()


def no_library(*_, **__):
    raise OSError("not loaded")
