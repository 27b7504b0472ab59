"""Messages of types that ROS 2 Jazzy has not, or has otherwise, read by the bag's definitions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from cspm_msgs_py.bag.conversion import HEADER, Convert, from_cdr, from_ros1
from cspm_msgs_py.bag.ros1_runs import ENCODING as ROS1_ENCODING
from cspm_msgs_py.bag.run import StoredChannel
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.ros_types import MESSAGE_ENCODING, definitions_in, typestore

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore


class OwnType(NamedTuple):
    """How a channel's messages are read: the definitions, and what makes them CDR."""

    store: Typestore
    convert: Convert


def own_type(channel: StoredChannel, ros_type: str) -> OwnType:
    """Return how a channel's messages are read by the definition that the bag holds.

    Args:
        channel: with its definition.
        ros_type: its type as ROS 2 names it.

    Raises:
        InputError: there is no definition, or it cannot be read.
    """
    if not channel.definition:
        raise InputError(
            f"{ros_type} is unknown and recorded without its definition, allowed: recorded where"
            " its package is built and sourced"
        )
    if channel.encoding not in (MESSAGE_ENCODING, ROS1_ENCODING):
        raise InputError(
            f"messages are encoded as {channel.encoding!r}, allowed: {MESSAGE_ENCODING},"
            f" {ROS1_ENCODING}"
        )
    store = _store(channel, ros_type)
    convert = from_cdr if channel.encoding == MESSAGE_ENCODING else from_ros1
    return OwnType(store, convert(ros_type, store))


def _store(channel: StoredChannel, ros_type: str) -> Typestore:
    from rosbags.typesys import Stores, get_typestore

    found = definitions_in(ros_type, channel.schema_encoding, channel.definition)
    store = get_typestore(Stores.EMPTY)
    known = typestore().fielddefs
    if channel.encoding == ROS1_ENCODING:
        # On the way to CDR it loses its sequence number.
        found.pop(HEADER, None)
    # Some writers leave out what they think everybody has.
    missing = {name: known[name] for name in known if name not in found}
    if undefined := _named_in(found) - found.keys() - missing.keys():
        raise InputError(
            f"schema of {ros_type} lacks the definition of {', '.join(sorted(undefined))}, allowed:"
            " those of all types in it"
        )
    try:
        store.register({**missing, **found})
    except Exception as err:
        raise InputError(
            f"schema of {ros_type} cannot be used ({' '.join(str(err).split())})"
        ) from None
    return store


def _named_in(definitions: Mapping[str, Any]) -> set[str]:
    """Return the types of which fields are, alone or in arrays and sequences."""
    from rosbags.interfaces import Nodetype

    kinds = [kind for _, fields in definitions.values() for _, kind in fields]
    inner = [
        kind[1][0] if kind[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE) else kind for kind in kinds
    ]
    return {kind[1] for kind in inner if kind[0] == Nodetype.NAME}
