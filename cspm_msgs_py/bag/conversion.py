"""How a stored message becomes one of ROS 2 Jazzy, and whether it can."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from cspm_msgs_py.bag.ros1_runs import ENCODING as ROS1_ENCODING
from cspm_msgs_py.bag.run import StoredChannel
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.ros_types import (
    MESSAGE_ENCODING,
    NO_FIELDS,
    ROS1_SCHEMA_ENCODING,
    SCHEMA_ENCODING,
    check_definition,
    definition,
    deserialize,
    message_class,
    serialize,
    typestore,
)

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

Convert = Callable[[bytes], bytes]
"""Returns a stored message as little-endian CDR; raises InputError if it does not hold its type."""

_LITTLE_ENDIAN_CDR = b"\x00\x01"
HEADER = "std_msgs/msg/Header"
_SEQUENCE_NUMBER = ("seq", (1, ("uint32", 0)))


def ros2_type(channel: StoredChannel) -> str:
    """Return the name that ROS 2 gives a channel's type: `package/msg/Type`."""
    package, _, name = channel.ros_type.partition("/")
    if channel.encoding == ROS1_ENCODING and name and "/" not in name:
        return f"{package}/msg/{name}"
    return channel.ros_type


def converter(channel: StoredChannel) -> Convert:
    """Return what turns a channel's messages into those of ROS 2 Jazzy.

    The header of ROS 1 loses its sequence number, and seconds from 2³¹ on, which a stamp of ROS 2
    cannot hold, become negative.

    Raises:
        InputError: why they cannot be turned into such.
    """
    from rosbags.typesys import Stores, get_typestore

    ros_type = ros2_type(channel)
    message_class(ros_type)
    if channel.encoding == MESSAGE_ENCODING:
        _check_cdr(channel, ros_type)
        return from_cdr(ros_type)
    if channel.encoding == ROS1_ENCODING:
        _check_ros1(channel, ros_type)
        return from_ros1(ros_type, get_typestore(Stores.ROS2_JAZZY))  # its own, for its limit
    raise InputError(
        f"messages are encoded as {channel.encoding!r}, allowed: {MESSAGE_ENCODING},"
        f" {ROS1_ENCODING}"
    )


def _check_cdr(channel: StoredChannel, ros_type: str) -> None:
    """Refuse a type that has not the fields of ROS 2 Jazzy's."""
    if channel.schema_encoding:
        known = channel.schema_encoding == SCHEMA_ENCODING and (
            channel.definition == definition(ros_type)
        )
        if not known:
            check_definition(ros_type, channel.schema_encoding, channel.definition)
    elif channel.sample is not None:
        deserialize(channel.sample, ros_type)
    elif channel.count:
        raise InputError(f"{ros_type} is recorded without its definition")


def _check_ros1(channel: StoredChannel, ros_type: str) -> None:
    """Refuse a ROS 1 type whose bytes, but for headers, are not those of ROS 2 Jazzy's."""
    from rosbags.typesys import get_types_from_msg

    if channel.schema_encoding != ROS1_SCHEMA_ENCODING:
        raise InputError(
            f"schema of {ros_type} has the encoding {channel.schema_encoding!r}, allowed:"
            f" {ROS1_SCHEMA_ENCODING}"
        )
    try:
        found = get_types_from_msg(channel.definition, ros_type)
    except Exception:
        raise InputError(f"schema of {ros_type} is not a message definition") from None
    known = typestore().fielddefs
    for name, (_, fields) in found.items():
        expected = [_SEQUENCE_NUMBER] if name == HEADER else []
        expected += _compared(known[name][1]) if name in known else []
        if name not in known or _compared(fields) != expected:
            raise InputError(f"{ros_type}: {name} has other fields in ROS 2 Jazzy")


def _compared(fields: Sequence[tuple[str, Any]]) -> list[tuple[str, Any]]:
    """Return the fields as they are compared: ROS 2 writes names in lower case."""
    return [(field.lower(), kind) for field, kind in fields if field != NO_FIELDS]


def from_cdr(ros_type: str, store: Typestore | None = None) -> Convert:
    """Return what turns CDR into little-endian CDR; `store` has the type, or it is of Jazzy."""

    def convert(payload: bytes) -> bytes:
        if payload[:2] == _LITTLE_ENDIAN_CDR:
            return payload
        return serialize(deserialize(payload, ros_type, store), store)

    return convert


def from_ros1(ros_type: str, store: Typestore) -> Convert:
    """Return what turns the bytes of ROS 1 into CDR; `store` has the type and is for this only."""

    def convert(payload: bytes) -> bytes:
        # Sizing a sequence of messages does not look at their bytes: without a limit a damaged
        # length is counted up to four billion.
        store.max_sequence_length = len(payload)
        try:
            return bytes(store.ros1_to_cdr(payload, ros_type))
        except Exception as err:
            raise InputError(
                f"{len(payload)} bytes that are no {ros_type} ({type(err).__name__})"
            ) from None

    return convert
