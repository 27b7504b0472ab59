"""Blocks of messages from the wire: read together they are what they are read one by one."""

import numpy as np
import pytest
from schedules import MS, schedule_with
from wire_rows import COUNT, TOPICS, rows_of

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.ros_types import deserialize, serialize
from cspm_msgs_py.stepping.lockstep import Sequence
from cspm_msgs_py.wire import UNIT_LENGTH_TOLERANCE, WireReader, WireWriter


def block_of(topic, rows=None):
    encode = WireWriter(topic).encode
    rows = rows_of(topic) if rows is None else rows
    return [encode(1_999_999_990 + 7 * i, row) for i, row in enumerate(rows)]


@pytest.mark.parametrize("topic", TOPICS.values(), ids=TOPICS)
def test_a_block_is_what_its_messages_are(topic):
    reader, payloads = WireReader(topic), block_of(topic)
    stamps, rows = reader.decode_block(payloads)
    one_by_one = [reader.decode(payload) for payload in payloads]
    assert stamps == [stamp for stamp, _ in one_by_one]
    np.testing.assert_array_equal(rows, [row for _, row in one_by_one])
    np.testing.assert_array_equal(rows, rows_of(topic))


def spoilt(payload, kind, topic):
    """Return a message that `decode` refuses."""
    if kind == "seconds":
        return payload[:4] + b"\xff\xff\xff\xff" + payload[8:]
    if kind == "nanoseconds":
        return payload[:8] + (10**9).to_bytes(4, "little") + payload[12:]
    if kind == "longer":
        return payload + bytes(9)
    if kind == "shorter":
        return payload[:-8]
    value = {"nan": np.nan, "inf": np.inf}.get(kind, 1.0 + 2 * UNIT_LENGTH_TOLERANCE)
    row = rows_of(topic)[0]
    row[3:7] = row[3:7] * value if kind == "quaternion" else row[3:7]
    row[-1] = row[-1] if kind == "quaternion" else value
    return WireWriter(topic).encode(0, row)


@pytest.mark.parametrize(
    "kind", ["seconds", "nanoseconds", "longer", "shorter", "nan", "inf", "quaternion"]
)
@pytest.mark.parametrize("place", range(COUNT))
def test_a_block_with_one_that_is_refused_is_looked_at_one_by_one(kind, place):
    topic = TOPICS["/bar/pose"]
    payloads = block_of(topic)
    reader = WireReader(topic)
    assert reader.decode_block(payloads) is not None
    payloads[place] = spoilt(payloads[place], kind, topic)
    assert reader.decode_block(payloads) is None
    with pytest.raises(InputError):
        reader.decode(payloads[place])


def test_lengths_that_make_up_for_each_other_are_seen():
    reader, payloads = WireReader(TOPICS["/bar/pose"]), block_of(TOPICS["/bar/pose"])
    payloads[0], payloads[1] = payloads[0] + bytes(8), payloads[1][:-8]
    assert reader.decode_block(payloads) is None


def test_other_names_are_seen():
    topic = TOPICS["/cables/tension"]
    reader, payloads = WireReader(topic), block_of(topic)
    assert reader.decode_block(payloads) is not None
    payloads[2] = payloads[2].replace(b"bb", b"bc")
    assert reader.decode_block(payloads) is None


def test_another_senders_form_is_left_to_the_reader_of_one():
    """A frame where no vector needs one is no fault, but not the contract's bytes."""
    topic = TOPICS["/cables/tension"]
    reader, payloads = WireReader(topic), block_of(topic)
    payloads[1] = in_frame(topic, payloads[1], "lab")
    assert reader.decode_block(payloads) is None
    np.testing.assert_array_equal(reader.decode(payloads[1])[1], rows_of(topic)[1])


def test_another_frame_of_a_vector_is_refused():
    topic = TOPICS["/bar/pose"]
    reader, payloads = WireReader(topic), block_of(topic)
    payloads[1] = in_frame(topic, payloads[1], "lab")
    assert reader.decode_block(payloads) is None
    with pytest.raises(InputError, match="frame 'lab', allowed: 'world_ned'"):
        reader.decode(payloads[1])


def in_frame(topic, payload, frame):
    message = deserialize(payload, topic.ros_type)
    message.header.frame_id = frame
    return serialize(message)


# Stamps of a block


def stamps(first, count, step=10):
    return [(first + i * step) * MS for i in range(count)]


@pytest.mark.parametrize("numbered", [True, False])
def test_a_block_of_the_next_ones_is_taken_whole(numbered):
    sequence, single = (Sequence("/in", schedule_with(divider=10)) for _ in range(2))
    numbers = [1, 2, 3] if numbered else [None] * 3
    assert sequence.take_block(stamps(0, 3), numbers)
    for stamp, number in zip(stamps(0, 3), numbers, strict=True):
        single.take(stamp, number)
    assert (sequence.complete, sequence.next_number) == (single.complete, single.next_number)
    assert (sequence.complete, sequence.next_number) == (29, 4)
    sequence.take(30 * MS, 4)


@pytest.mark.parametrize(
    ("found", "numbers"),
    [
        (stamps(0, 3), [1, 2, 4]),
        (stamps(0, 3), [2, 3, 4]),
        (stamps(0, 3), [1, None, 3]),
        (stamps(10, 3), [1, 2, 3]),
        ([0, 20 * MS, 10 * MS], [1, 2, 3]),
        ([0, 10 * MS, 20 * MS + 1], [1, 2, 3]),
        ([0, 0, 10 * MS], [1, 2, 3]),
    ],
)
def test_any_other_block_changes_nothing(found, numbers):
    sequence = Sequence("/in", schedule_with(divider=10))
    assert not sequence.take_block(found, numbers)
    assert (sequence.complete, sequence.next_number) == (-1, 1)
    assert sequence.take_block(stamps(0, 3), [1, 2, 3])
