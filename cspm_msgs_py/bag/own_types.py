"""Messages of types that ROS 2 Jazzy has not, or has otherwise, read by the bag's definitions."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from cspm_msgs_py.bag.ros1_runs import ENCODING as ROS1_ENCODING
from cspm_msgs_py.bag.run import StoredChannel
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.ros_types import MESSAGE_ENCODING, definitions_in, deserialize, typestore

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

Decode = Callable[[bytes], Any]
"""Returns the message that stored bytes hold; raises InputError if they do not hold its type."""


def decoder(channel: StoredChannel, ros_type: str) -> Decode:
    """Return what reads a channel's messages by the definition that the bag holds.

    Args:
        channel: with its definition.
        ros_type: its type as ROS 2 names it.

    Raises:
        InputError: there is no definition, or it cannot be read.
    """
    if not channel.definition:
        raise InputError(f"{ros_type} is unknown and recorded without its definition")
    if channel.encoding not in (MESSAGE_ENCODING, ROS1_ENCODING):
        raise InputError(
            f"messages are encoded as {channel.encoding!r}, allowed: {MESSAGE_ENCODING},"
            f" {ROS1_ENCODING}"
        )
    store = _store(channel, ros_type)
    if channel.encoding == MESSAGE_ENCODING:
        return lambda payload: deserialize(payload, ros_type, store)
    return lambda payload: _from_ros1(payload, ros_type, store)


def _store(channel: StoredChannel, ros_type: str) -> Typestore:
    from rosbags.typesys import Stores, get_typestore

    found = definitions_in(ros_type, channel.schema_encoding, channel.definition)
    store = get_typestore(Stores.EMPTY)
    known = typestore().fielddefs
    # Some writers leave out what they think everybody has.
    missing = {name: known[name] for name in known if name not in found}
    try:
        store.register({**missing, **found})
    except Exception as err:
        raise InputError(
            f"schema of {ros_type} cannot be used ({' '.join(str(err).split())})"
        ) from None
    return store


def _from_ros1(payload: bytes, ros_type: str, store: Typestore) -> Any:  # noqa: ANN401 - made at run time
    store.max_sequence_length = len(payload)
    try:
        return store.deserialize_ros1(payload, ros_type)
    except Exception as err:
        raise InputError(
            f"{len(payload)} bytes that are no {ros_type} ({type(err).__name__})"
        ) from None
