"""The C structures by which ROS 2 Jazzy's middleware knows a message type.

They are those of rosidl's public headers: `message_type_support_struct.h`,
`message_introspection.h`, `type_hash.h`, `type_description__struct.h` and, for Fast DDS,
`rosidl_typesupport_fastrtps_cpp/message_type_support.h`.
"""

from __future__ import annotations

import ctypes

HASH_BYTES = 32


class TypeSupport(ctypes.Structure):
    """`rosidl_message_type_support_t`."""

    _fields_ = [
        ("identifier", ctypes.c_void_p),
        ("data", ctypes.c_void_p),
        ("find", ctypes.c_void_p),
        ("hash", ctypes.c_void_p),
        ("description", ctypes.c_void_p),
        ("sources", ctypes.c_void_p),
    ]


class Callbacks(ctypes.Structure):
    """`message_type_support_callbacks_t` of Fast DDS."""

    _fields_ = [
        ("namespace", ctypes.c_char_p),
        ("name", ctypes.c_char_p),
        ("serialize", ctypes.c_void_p),
        ("deserialize", ctypes.c_void_p),
        ("size", ctypes.c_void_p),
        ("largest_size", ctypes.c_void_p),
        ("key", ctypes.c_void_p),
    ]


class Member(ctypes.Structure):
    """`rosidl_typesupport_introspection_c__MessageMember`."""

    _fields_ = [
        ("name", ctypes.c_char_p),
        ("type_id", ctypes.c_uint8),
        ("string_bound", ctypes.c_size_t),
        ("members", ctypes.c_void_p),
        ("is_key", ctypes.c_bool),
        ("is_array", ctypes.c_bool),
        ("array_size", ctypes.c_size_t),
        ("is_bounded", ctypes.c_bool),
        ("offset", ctypes.c_uint32),
        ("default", ctypes.c_void_p),
        *[(f"function{i}", ctypes.c_void_p) for i in range(6)],
    ]


class Members(ctypes.Structure):
    """`rosidl_typesupport_introspection_c__MessageMembers`."""

    _fields_ = [
        ("namespace", ctypes.c_char_p),
        ("name", ctypes.c_char_p),
        ("count", ctypes.c_uint32),
        ("size", ctypes.c_size_t),
        ("has_key", ctypes.c_bool),
        ("members", ctypes.c_void_p),
        ("begin", ctypes.c_void_p),
        ("end", ctypes.c_void_p),
    ]


class TypeHash(ctypes.Structure):
    """`rosidl_type_hash_t`."""

    _fields_ = [("version", ctypes.c_uint8), ("value", ctypes.c_uint8 * HASH_BYTES)]


class Text(ctypes.Structure):
    """`rosidl_runtime_c__String`."""

    _fields_ = [
        ("data", ctypes.c_char_p),
        ("size", ctypes.c_size_t),
        ("capacity", ctypes.c_size_t),
    ]


class Sequence(ctypes.Structure):
    """Any `…__Sequence` of rosidl."""

    _fields_ = [
        ("data", ctypes.c_void_p),
        ("size", ctypes.c_size_t),
        ("capacity", ctypes.c_size_t),
    ]


class Description(ctypes.Structure):
    """`rosidl_runtime_c__type_description__TypeDescription`."""

    _fields_ = [("type_name", Text), ("fields", Sequence), ("referenced", Sequence)]
