"""Rows sent by rcl in compiled code: the bytes of the writer of single messages."""

from contextlib import contextmanager

import numpy as np
import pytest
from ros_graph import load_ros, new_domain
from wire_rows import TOPICS, rows_of

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.layout import LATEST_SECOND
from cspm_msgs_py.wire import WireWriter

load_ros()

from cspm_msgs_py.ros.rcl.rcl_message import publish_address  # noqa: E402 - ROS is there
from cspm_msgs_py.ros.rcl.row_sender import RowSender  # noqa: E402
from cspm_msgs_py.ros.session import Session  # noqa: E402

PATIENCE_S = 20.0
SECOND = 1_000_000_000
STAMPS = (0, SECOND - 1, SECOND, 3 * SECOND + 7, (LATEST_SECOND + 1) * SECOND - 1, -1)
BAR = TOPICS["/bar/pose"]


@pytest.fixture(scope="module")
def domain():
    return new_domain()


@contextmanager
def line_of(domain, topic, publish):
    """Yield a sender of a topic, and what returns the next bytes that its reader hears."""
    with Session(domain_id=domain) as session:
        heard = []
        session.node("reader").subscribe(topic, heard.append, depth=100)
        node = session.node("sender")
        publisher = node._publisher(topic, ["reader"])
        sender = RowSender(topic, publisher, publish)
        assert session.spin_until(lambda: not node.unmatched(), PATIENCE_S)

        def next_bytes():
            assert session.spin_until(lambda: heard, PATIENCE_S)
            return bytes(heard.pop(0))

        yield sender, next_bytes
        sender.close()


@pytest.mark.compiled
@pytest.mark.parametrize("topic", TOPICS.values(), ids=TOPICS)
def test_every_row_has_the_writers_bytes(domain, topic):
    encode = WireWriter(topic).encode
    with line_of(domain, topic, publish_address()) as (sender, next_bytes):
        for row in rows_of(topic):
            for stamp in STAMPS:
                sender.send(stamp, row)
                assert next_bytes() == encode(stamp, row)


@pytest.mark.compiled
def test_a_row_may_be_a_view_or_of_other_numbers(domain):
    encode, table = WireWriter(BAR).encode, np.arange(14.0).reshape(7, 2)
    with line_of(domain, BAR, publish_address()) as (sender, next_bytes):
        for row in (table[:, 1], np.frombuffer(np.ones(7).tobytes()), np.ones(7, np.float32)):
            sender.send(SECOND, row)
            assert next_bytes() == encode(SECOND, row)


@pytest.mark.parametrize("publish", [publish_address(), None], ids=["compiled", "rclpy"])
def test_what_no_message_can_hold_is_refused_and_nothing_is_sent(domain, publish):
    with line_of(domain, BAR, publish) as (sender, next_bytes):
        with pytest.raises(InputError, match=r"^/bar/pose: a row of shape \(6,\), allowed: \(7,\)"):
            sender.send(0, np.zeros(6))
        with pytest.raises(InputError, match=r"^/bar/pose: stamp 2147483648000000000 ns, allowed"):
            sender.send((LATEST_SECOND + 1) * SECOND, np.zeros(7))
        sender.send(5, np.arange(7.0))
        assert next_bytes() == WireWriter(BAR).encode(5, np.arange(7.0))


def test_after_it_is_closed_rclpy_sends(domain):
    with line_of(domain, BAR, publish_address()) as (sender, next_bytes):
        sender.close()
        sender.close()
        sender.send(SECOND, np.arange(7.0))
        assert next_bytes() == WireWriter(BAR).encode(SECOND, np.arange(7.0))


@pytest.mark.compiled
def test_what_rcl_refuses_is_rclpys_error(domain):
    """An address that is no publisher's: rcl says so instead of sending."""
    with line_of(domain, BAR, publish_address()) as (sender, next_bytes):
        form = sender._arguments[0]
        empty = np.zeros(64, dtype=np.int64)
        form[1] = empty.ctypes.data
        sender.send(SECOND, np.ones(7))
        assert next_bytes() == WireWriter(BAR).encode(SECOND, np.ones(7))
