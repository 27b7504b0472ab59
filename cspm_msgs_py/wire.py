"""One message of a topic as CDR bytes and back, for loops that pass thousands of them a second.

A topic's messages have one layout (`cspm_msgs_py.layout`), so writing one is filling in stamp and
numbers, and reading one is comparing everything else and taking them out: 1 to 2 µs each. Other
senders may fill more of a message than the contract requires; their form is learned from the first
such message, with the typed reader of `rosbags`. Whatever else arrives is refused with one line.

Writers and readers keep state: use each from one thread at a time.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.layout import LATEST_SECOND, Layout, find_layout, layout_of
from cspm_msgs_py.message import NANOSECONDS, topic_of
from cspm_msgs_py.ros_types import deserialize, serialize
from cspm_msgs_py.topics import POSE, Topic

Array = NDArray[np.float64]

UNIT_LENGTH_TOLERANCE = 1e-3

_STAMP = struct.Struct("<iI")
_MOST_EXTRA_BYTES = 8  # that serialisers append, see `ros_types`
_MOST_FORMS = 8
_MOST_FRAME_CHARACTERS = 255
_SPARE_BYTES = 2048  # room for a frame's name in a message that is still read
_MOST_NAMES_SHOWN, _MOST_CHARACTERS_SHOWN = 12, 40


class WireWriter:
    """Writes a topic's messages as canonical CDR bytes."""

    def __init__(self, topic: Topic) -> None:
        """Prepare the bytes that all messages of `topic` share.

        Raises:
            InputError: the topic's type carries no row, or its columns do not fit its names.
        """
        layout = layout_of(topic)
        self._name = topic.name
        self._shape = (topic.width,)
        self._content = bytearray(layout.template.tobytes())
        self._seconds = layout.seconds
        first, count, self._places = _grid(layout, topic.fields)
        self._numbers = np.frombuffer(self._content, "<f8", count, first)

    def encode(self, stamp_ns: int, row: Array) -> bytes:
        """Return the message's bytes: those of `Layout.encode` for this stamp and row.

        Args:
            stamp_ns: instant at which the row is valid [ns].
            row: shape (width,), units as the topic says; numbers of any kind, also NaN.

        Raises:
            InputError: a stamp outside what a ROS stamp can hold, or a row of another shape.
        """
        seconds, nanoseconds = divmod(stamp_ns, NANOSECONDS)
        if not -LATEST_SECOND - 1 <= seconds <= LATEST_SECOND:
            raise InputError(
                f"{self._name}: stamp {stamp_ns} ns, allowed: ±{LATEST_SECOND} s (int32 seconds)"
            )
        numbers = np.asarray(row, dtype=np.float64)
        if numbers.shape != self._shape:
            raise InputError(
                f"{self._name}: a row of shape {numbers.shape}, allowed: {self._shape}"
            )
        _STAMP.pack_into(self._content, self._seconds, seconds, nanoseconds)
        self._numbers[self._places] = numbers
        return bytes(self._content)


class WireReader:
    """Reads a topic's messages from CDR bytes, whoever wrote them."""

    def __init__(self, topic: Topic) -> None:
        """Prepare what the messages of `topic` are compared with.

        Raises:
            InputError: the topic's type carries no row, or its columns do not fit its names.
        """
        self._layout = layout = layout_of(topic)
        self._mask = mask_of(layout)
        self._masked = (layout.template & self._mask).tobytes()
        self._dtype = layout.dtype
        self._runs = [name for name in layout.dtype.names or () if name.startswith("run")]
        self._topic = topic
        self._has_pose = topic.fields[: len(POSE)] == POSE
        self._most_bytes = 4 * layout.size + _SPARE_BYTES
        self._contract = _Form(layout, topic)
        self._last = self._contract
        self._forms = {topic: self._contract}

    def decode(self, payload: bytes) -> tuple[int, Array]:
        """Return stamp [ns] and row, shape (width,), of one message; the row is the caller's.

        Accepted is what carries the contract's numbers: in a JointState any frame and more parts
        than asked for (they are not looked at), either byte order, uninitialised padding, and up to
        8 bytes that some serialisers append. The bytes do not name their type: that twist and
        wrench are distinguished is up to the middleware.

        Raises:
            InputError: no message of the topic's type, another frame, other names or another order
                of them, a part missing or of another length, a trajectory of more than one
                instant, a stamp before zero or with too many nanoseconds, a number that is not
                finite, or a quaternion whose length is not 1.
        """
        form = self._last
        if not form.fits(payload):
            form, payload = self._recognise(payload)
        seconds, nanoseconds = _STAMP.unpack_from(payload, form.seconds)
        if seconds < 0 or nanoseconds >= NANOSECONDS:
            raise InputError(
                f"{self._topic.name}: stamp of {seconds} s and {nanoseconds} ns, allowed: 0 s and"
                f" more, 0 to {NANOSECONDS - 1} ns"
            )
        row = form.row(payload)
        values = row.tolist()
        # One number that is not finite makes the sum so; the reverse is not true.
        if not math.isfinite(sum(values)):
            _check_finite(self._topic, values)
        if self._has_pose:
            length = math.hypot(*values[3:7])
            if abs(length - 1.0) > UNIT_LENGTH_TOLERANCE:
                raise InputError(
                    f"{self._topic.name}: a quaternion of length {length:.6g}, allowed: 1 within"
                    f" {UNIT_LENGTH_TOLERANCE}"
                )
        return seconds * NANOSECONDS + nanoseconds, row

    def decode_block(self, payloads: Sequence[bytes]) -> tuple[list[int], Array] | None:
        """Return stamps [ns] and rows, shape (n, width), of messages that need no second look.

        None where any is not in the contract's own bytes or would be refused: then `decode` each.
        """
        size, content = self._layout.size, b"".join(payloads)
        if set(map(len, payloads)) != {size}:
            return None
        block = np.frombuffer(content, dtype=np.uint8).reshape(-1, size)
        if (block & self._mask).tobytes() != self._masked * len(payloads):
            return None
        records = block.view(self._dtype)[:, 0]
        seconds, nanoseconds = records["sec"].tolist(), records["nanosec"].tolist()
        if min(seconds) < 0 or max(nanoseconds) >= NANOSECONDS:
            return None
        runs = [records[name] for name in self._runs] or [np.empty((len(payloads), 0))]
        rows = np.concatenate(runs, axis=1, dtype=np.float64)
        if not np.isfinite(rows).all() or (self._has_pose and not _is_unit(rows[:, 3:7])):
            return None
        stamps = [s * NANOSECONDS + n for s, n in zip(seconds, nanoseconds, strict=True)]
        return stamps, rows

    def _recognise(self, payload: bytes) -> tuple[_Form, bytes]:
        """Return a form and the bytes to read by it, the payload's own if its form is known."""
        for form in self._forms.values():
            if form.fits(payload):
                self._last = form
                return form, payload
        message = self._deserialize(payload)
        sender = _sender_of(self._topic, message)
        extra = len(payload) - len(serialize(message))
        if extra > _MOST_EXTRA_BYTES:
            raise InputError(
                f"{self._topic.name}: {extra} bytes after the message, allowed: at most"
                f" {_MOST_EXTRA_BYTES}"
            )
        content = serialize(_as_contract(message, self._topic, sender))
        if sender not in self._forms and len(self._forms) <= _MOST_FORMS:
            self._forms[sender] = _Form(find_layout(sender), self._topic)
        return self._contract, content

    def _deserialize(self, payload: bytes) -> Any:  # noqa: ANN401 - generated classes
        topic = self._topic
        if len(payload) > self._most_bytes:
            raise InputError(
                f"{topic.name}: a message of {len(payload)} bytes, allowed: at most"
                f" {self._most_bytes} (it carries {topic.width} numbers)"
            )
        try:
            return deserialize(payload, topic.ros_type)
        except InputError:
            raise InputError(
                f"{topic.name}: {len(payload)} bytes that are no {topic.ros_type}, allowed: the"
                " CDR bytes of one"
            ) from None


class _Form:
    """The bytes of one sender's messages of a topic, and where the topic's numbers stand in them.

    Attributes:
        seconds: offset of the stamp's seconds; its nanoseconds follow.
    """

    def __init__(self, layout: Layout, topic: Topic) -> None:
        self.seconds = layout.seconds
        self._size = layout.size
        mask = mask_of(layout)
        # One long integer compares all constant bytes at once, however padding divides them.
        self._mask = int.from_bytes(mask.tobytes(), "little")
        self._constant = int.from_bytes((layout.template & mask).tobytes(), "little")
        self._first, self._count, self._places = _grid(layout, topic.fields)

    def fits(self, payload: bytes) -> bool:
        """Return whether these bytes are a message of this form."""
        size = self._size
        return (
            0 <= len(payload) - size <= _MOST_EXTRA_BYTES
            and int.from_bytes(payload[:size], "little") & self._mask == self._constant
        )

    def row(self, payload: bytes) -> Array:
        """Return the topic's numbers, shape (width,), of bytes that fit."""
        return np.frombuffer(payload, "<f8", self._count, self._first)[self._places]


def _grid(layout: Layout, fields: Sequence[str]) -> tuple[int, int, NDArray[np.intp]]:
    """Return where `fields` stand when the message is seen as an array of float64.

    CDR aligns every float64 to 8 bytes, so they all stand on one grid.

    Returns:
        the grid's first offset [bytes], its number of places, and the places of the fields.
    """
    offsets = [offset + 8 * i for offset, count in layout.runs for i in range(count)]
    wanted = [offsets[layout.topic.fields.index(field)] for field in fields]
    first = offsets[0] % 8 if offsets else 0
    places = (np.array(wanted, dtype=np.intp) - first) // 8
    return first, (layout.size - first) // 8, places


def _as_contract(message: Any, topic: Topic, sender: Topic) -> Any:  # noqa: ANN401 - generated
    """Return the sender's message with the contract's frame and no parts beyond the contract's."""
    if sender.frame_id != topic.frame_id:
        message.header.frame_id = topic.frame_id
    for part in sender.parts:
        if part not in topic.parts:
            setattr(message, part, np.zeros(0))
    return message


def mask_of(layout: Layout) -> NDArray[np.uint8]:
    """Return 255 for each byte that all of a sender's messages share, else 0, shape (size,)."""
    mask = np.zeros(layout.size, dtype=np.uint8)
    mask[layout.constant] = 0xFF
    return mask


def _is_unit(quaternions: Array) -> bool:
    lengths = np.sqrt(np.einsum("ij,ij->i", quaternions, quaternions))
    return bool((np.abs(lengths - 1.0) <= UNIT_LENGTH_TOLERANCE).all())


def _sender_of(topic: Topic, message: Any) -> Topic:  # noqa: ANN401 - generated classes
    """Return the topic as the message's sender writes it, if it has all that is required."""
    for part in ("name", "joint_names"):
        if hasattr(message, part):
            _check_names(topic, getattr(message, part))
    sender = topic_of(topic.name, message)
    for part in topic.parts:
        if part not in sender.parts:
            raise InputError(
                f"{topic.name}: {part} is empty, allowed: one value for each of"
                f" {len(topic.joint_names)} names"
            )
    _check_frame(topic, sender.frame_id)
    if len(sender.frame_id) > _MOST_FRAME_CHARACTERS:
        raise InputError(
            f"{topic.name}: a frame_id of {len(sender.frame_id)} characters, allowed: at most"
            f" {_MOST_FRAME_CHARACTERS}"
        )
    if hasattr(message, "points"):
        _check_start(topic, message.points[0].time_from_start)
    return sender


def _check_frame(topic: Topic, frame: str) -> None:
    # What carries no vector has no use for a frame.
    if topic.frame_id and frame != topic.frame_id:
        raise InputError(
            f"{topic.name}: frame {_quoted(frame)}, allowed: {topic.frame_id!r} (z down)"
        )


def _check_start(topic: Topic, start: Any) -> None:  # noqa: ANN401 - generated classes
    if start.sec or start.nanosec:
        raise InputError(
            f"{topic.name}: time_from_start {start.sec} s and {start.nanosec} ns, allowed: 0 (the"
            " header's stamp is the instant)"
        )


def _check_names(topic: Topic, found: Sequence[str]) -> None:
    wanted = topic.joint_names
    if tuple(found) == wanted:
        return
    allowed = f"allowed: {_listed(wanted)} in this order"
    if len(found) != len(wanted):
        raise InputError(f"{topic.name}: {len(found)} names, {allowed}")
    i = next(i for i in range(len(wanted)) if found[i] != wanted[i])
    what = "names in a wrong order, " if sorted(found) == sorted(wanted) else ""
    raise InputError(f"{topic.name}: {what}name {i + 1} is {_quoted(found[i])}, {allowed}")


def _check_finite(topic: Topic, values: Sequence[float]) -> None:
    for field, value in zip(topic.fields, values, strict=True):
        if not math.isfinite(value):
            part, _, joint = field.partition("/")
            what = f"{part} of {joint}" if topic.parts else field
            raise InputError(f"{topic.name}: {what} is {value}, allowed: finite numbers")


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(map(_quoted, names[:_MOST_NAMES_SHOWN]))
    return shown if len(names) <= _MOST_NAMES_SHOWN else f"{shown}, … ({len(names)} names)"


def _quoted(text: str) -> str:
    cut = text[:_MOST_CHARACTERS_SHOWN]
    return repr(cut) + ("…" if len(text) > len(cut) else "")
