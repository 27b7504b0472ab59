"""ROS 2 message classes and definitions without ROS, loaded when first needed.

The definitions are those of ROS 2 Jazzy as `rosbags` ships them. Loading takes about 0.1 s, which
is why nothing here happens at import.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

from cspm_msgs_py.errors import InputError

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

SCHEMA_ENCODING = "ros2msg"
IDL_ENCODING = "ros2idl"
ROS1_SCHEMA_ENCODING = "ros1msg"
MESSAGE_ENCODING = "cdr"
NO_FIELDS = "structure_needs_at_least_one_member"
"""Name of the byte that CDR has in place of a message without fields."""

_IDL_SECTION = re.compile(r"^={80}\nIDL: .*$", re.MULTILINE)
_EXTRA_BYTES = (0, 4, 8)  # rclpy's serialiser appends up to 8 bytes, rosbags overlooks up to 3


@cache
def typestore() -> Typestore:
    """Return the message classes of ROS 2 Jazzy."""
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS2_JAZZY)


def message_class(ros_type: str) -> Any:  # noqa: ANN401 - classes are generated at run time
    """Return the class of `package/msg/Type`.

    Raises:
        InputError: ROS 2 Jazzy has no such type.
    """
    try:
        return typestore().types[ros_type]
    except KeyError:
        raise InputError(
            f"message type {ros_type!r} is unknown, allowed: the common interfaces of ROS 2 Jazzy"
        ) from None


def definition(ros_type: str) -> str:
    """Return the definition with those of all nested types, as the encoding `ros2msg` wants it.

    Raises:
        InputError: ROS 2 Jazzy has no such type.
    """
    message_class(ros_type)
    return typestore().generate_msgdef(ros_type, ros_version=2)[0]


def type_hash(ros_type: str) -> str:
    """Return the type's hash `RIHS01_…` as rosbag2 keeps it.

    Raises:
        InputError: ROS 2 Jazzy has no such type.
    """
    message_class(ros_type)
    return typestore().hash_rihs01(ros_type)


def serialize(message: Any, store: Typestore | None = None) -> bytes:  # noqa: ANN401 - generated
    """Return a message's CDR bytes, little endian, padding zero; `store` as for `deserialize`."""
    return bytes((store or typestore()).serialize_cdr(message, message.__msgtype__))


def deserialize(payload: bytes, ros_type: str, store: Typestore | None = None) -> Any:  # noqa: ANN401 - see message_class
    """Return the message that CDR bytes hold.

    Args:
        payload: the bytes.
        ros_type: `package/msg/Type`.
        store: classes to read it by, those of ROS 2 Jazzy unless given.

    Raises:
        InputError: the type is unknown or the bytes do not hold it.
    """
    if store is None:
        message_class(ros_type)
        store = typestore()
    reason = ""
    for extra in _EXTRA_BYTES:
        try:
            return store.deserialize_cdr(payload[: len(payload) - extra], ros_type)
        except Exception as err:
            reason = reason or type(err).__name__
    raise InputError(f"{len(payload)} bytes that are no {ros_type} ({reason})")


def check_definition(ros_type: str, encoding: str, text: str) -> None:
    """Refuse a recorded definition whose fields are not those of ROS 2 Jazzy.

    Raises:
        InputError: another schema encoding, an unknown type, or other fields.
    """
    message_class(ros_type)
    found = definitions_in(ros_type, encoding, text)
    known = typestore().fielddefs
    for name, (_, fields) in found.items():
        if name not in known or _real(known[name][1]) != _real(fields):
            raise InputError(f"schema of {ros_type}: {name} has other fields than in ROS 2 Jazzy")


def definitions_in(ros_type: str, encoding: str, text: str) -> dict[str, Any]:
    """Return the definitions by type that a recorded schema holds.

    Raises:
        InputError: another schema encoding, no definition, or that of another type.
    """
    from rosbags.typesys import get_types_from_idl, get_types_from_msg

    if encoding not in (SCHEMA_ENCODING, ROS1_SCHEMA_ENCODING, IDL_ENCODING):
        raise InputError(
            f"schema of {ros_type} has the encoding {encoding!r}, allowed: {SCHEMA_ENCODING}"
        )
    try:
        if encoding == IDL_ENCODING:
            found: dict[str, Any] = {}
            for section in _IDL_SECTION.split(text):
                found.update(get_types_from_idl(section) if section.strip() else {})
        else:
            found = dict(get_types_from_msg(text, ros_type))
    except Exception:
        raise InputError(f"schema of {ros_type} is not a message definition") from None
    if ros_type not in found:
        raise InputError(f"schema of {ros_type} defines another type")
    return found


def _real(fields: Sequence[tuple[str, Any]]) -> list[tuple[str, Any]]:
    """Return the fields without the placeholder of a type that has none."""
    return [field for field in fields if field[0] != NO_FIELDS]
