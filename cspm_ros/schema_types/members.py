"""The fields of a message type as rosidl's introspection describes them to the middleware."""

from __future__ import annotations

import ctypes
from typing import TYPE_CHECKING, Any

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.ros.rcl.rcl_message import rcl_library
from cspm_ros.schema_types.c_structures import Member, Members, TypeSupport

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

INTROSPECTION = b"rosidl_typesupport_introspection_c"
# `field_types.h`; what ROS calls char is an unsigned byte.
_TYPE_IDS = {
    "float32": 1,
    "float64": 2,
    "float128": 3,
    "bool": 6,
    "octet": 7,
    "byte": 7,
    "char": 8,
    "uint8": 8,
    "int8": 9,
    "uint16": 10,
    "int16": 11,
    "uint32": 12,
    "int32": 13,
    "uint64": 14,
    "int64": 15,
    "string": 16,
    "wstring": 17,
}
_MESSAGE = 18


class Introspection:
    """Describes types of one store, each once; what it returned lives as long as it does."""

    def __init__(self, store: Typestore) -> None:
        self._fields = store.fielddefs
        # It is known by its address, not by what it says.
        library = rcl_library("librosidl_typesupport_introspection_c.so")
        self._identifier = ctypes.c_void_p.in_dll(library, f"{INTROSPECTION.decode()}__identifier")
        self._find = rcl_library("librosidl_runtime_c.so").get_message_typesupport_handle_function
        self._made: dict[str, tuple[TypeSupport, object]] = {}

    def support(self, ros_type: str) -> TypeSupport:
        """Return the description of `package/msg/Type`.

        Raises:
            InputError: the store lacks it or a type in it, or it holds itself.
        """
        return self._support(ros_type, ())

    def _support(self, ros_type: str, above: tuple[str, ...]) -> TypeSupport:
        if ros_type in self._made:
            return self._made[ros_type][0]
        if ros_type not in self._fields or ros_type in above:
            what = "holds itself" if ros_type in above else "is not defined"
            raise InputError(f"{ros_type} {what}, allowed: types with their whole definition")
        fields = self._fields[ros_type][1]
        found = [self._member(name, node, (*above, ros_type)) for name, node in fields]
        array = (Member * len(found))(*found)
        package, kind, name = ros_type.split("/")
        whole = Members(f"{package}__{kind}".encode(), name.encode(), len(found))
        whole.members = ctypes.addressof(array)
        support = TypeSupport(self._identifier, ctypes.addressof(whole))
        support.find = ctypes.cast(self._find, ctypes.c_void_p)
        self._made[ros_type] = support, (array, whole)
        return support

    def _member(self, name: str, node: Any, above: tuple[str, ...]) -> Member:  # noqa: ANN401
        from rosbags.interfaces import Nodetype

        kind, what = node
        member = Member(name.encode())
        if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
            (kind, what), size = what
            member.is_array, member.array_size = True, size
            member.is_bounded = node[0] == Nodetype.SEQUENCE and size > 0
        if kind == Nodetype.NAME:
            member.type_id = _MESSAGE
            member.members = ctypes.addressof(self._support(what, above))
        else:
            member.type_id, member.string_bound = _TYPE_IDS[what[0]], what[1]
        return member
