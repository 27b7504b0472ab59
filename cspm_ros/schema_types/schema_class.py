"""Classes with which rclpy sends and receives bytes of a type whose package is not installed.

Only serialised messages can be sent and received: such a class has no fields.
"""

from __future__ import annotations

import ctypes
from functools import cache
from typing import TYPE_CHECKING, Any

from rclpy.utilities import get_rmw_implementation_identifier as rmw_name

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.ros.contract_node import ros_class
from cspm_msgs_py.ros_types import typestore
from cspm_ros.schema_types.c_structures import (
    Callbacks,
    Description,
    Sequence,
    Text,
    TypeHash,
    TypeSupport,
)
from cspm_ros.schema_types.members import INTROSPECTION, Introspection

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

MIDDLEWARE = "rmw_fastrtps_cpp"
_FAST_DDS = b"rosidl_typesupport_fastrtps_cpp"
_HASH_PREFIX = "RIHS01_"
# Each takes the type support it belongs to.
_GET = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p)
_FIND = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_char_p)
_SIZE = ctypes.CFUNCTYPE(ctypes.c_uint32, ctypes.c_void_p)
_LARGEST = ctypes.CFUNCTYPE(ctypes.c_size_t, ctypes.POINTER(ctypes.c_ubyte))
_MADE_HERE = ("_CREATE_ROS_MESSAGE", "_CONVERT_FROM_PY", "_CONVERT_TO_PY", "_DESTROY_ROS_MESSAGE")


def message_class_of(ros_type: str, store: Typestore) -> Any:  # noqa: ANN401 - rosidl's classes
    """Return the installed class of a type, or else one that is made by its definition.

    Args:
        ros_type: `package/msg/Type`.
        store: with its definition.

    Raises:
        InputError: it has other fields where it is known; or it is not installed, and another
            middleware than Fast DDS is used, or its definition is not complete.
    """
    try:
        installed = ros_class(ros_type)
    except (ImportError, AttributeError):
        _check_known(ros_type, store)
        return schema_class(ros_type, store)
    # Of Jazzy's own types this is known already; the hash of a few of them is not.
    own = store is not typestore()
    if own and installed_hash(installed) != store.hash_rihs01(ros_type):
        raise InputError(f"{ros_type} has other fields where it is installed")
    return installed


def installed_hash(message_class: Any) -> str:  # noqa: ANN401 - rosidl's classes
    """Return the type's hash `RIHS01_…` of a class that rclpy can send."""
    message_class.__class__.__import_type_support__()
    pointer = ctypes.pythonapi.PyCapsule_GetPointer
    pointer.restype, pointer.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    address = pointer(message_class.__class__._TYPE_SUPPORT, None)
    found = _GET(TypeSupport.from_address(address).hash)(address)
    return _HASH_PREFIX + bytes(TypeHash.from_address(found).value).hex()


def _check_known(ros_type: str, store: Typestore) -> None:
    """Refuse a type that has other fields in ROS 2 Jazzy."""
    known = typestore()
    own = store is not known and ros_type in known.fielddefs
    if own and known.hash_rihs01(ros_type) != store.hash_rihs01(ros_type):
        raise InputError(f"{ros_type} has other fields in ROS 2 Jazzy")


@cache
def schema_class(ros_type: str, store: Typestore) -> Any:  # noqa: ANN401 - made at run time
    """Return a class made by a type's definition; see `message_class_of`.

    It lives as long as the process, as the middleware does not say when it has done with it.
    """
    found = rmw_name()
    if found != MIDDLEWARE:
        raise InputError(
            f"{ros_type} is not installed, which {found} cannot do without, allowed: {MIDDLEWARE}"
        )
    capsule = _capsule(_SchemaSupport(ros_type, store))
    package, kind, name = ros_type.split("/")
    about = {"_TYPE_SUPPORT": capsule, **dict.fromkeys(_MADE_HERE, capsule)}
    # rclpy looks for them in the class of the class.
    meta = type(f"Metaclass_{name}", (type,), about)
    return meta(name, (), {"__module__": f"{package}.{kind}._{name.lower()}"})


class _SchemaSupport:
    """What Fast DDS is given in place of generated code, and all that it points to."""

    def __init__(self, ros_type: str, store: Typestore) -> None:
        package, kind, name = ros_type.split("/")
        digest = store.hash_rihs01(ros_type).removeprefix(_HASH_PREFIX)
        self._hash = TypeHash(1, tuple(bytes.fromhex(digest)))
        text = ros_type.encode()
        self._description = Description(Text(text, len(text), len(text) + 1))
        self._sources = Sequence()
        self._introspection = Introspection(store)
        # The middleware asks for sizes to reserve room: it makes more where it has to.
        self._size, self._largest = _SIZE(lambda _: 0), _LARGEST(_unbounded)
        self._callbacks = Callbacks(f"{package}::{kind}".encode(), name.encode())
        self._callbacks.size = _address(self._size)
        self._callbacks.largest_size = _address(self._largest)
        self._identifier = ctypes.c_char_p(_FAST_DDS)
        identifier = ctypes.cast(self._identifier, ctypes.c_void_p)
        self.support = TypeSupport(identifier, ctypes.addressof(self._callbacks))
        self._by_name = {
            _FAST_DDS: self.support,
            INTROSPECTION: self._introspection.support(ros_type),
        }
        self._find = _FIND(self._found)
        self._getters = [
            _GET(lambda _, part=part: ctypes.addressof(part))
            for part in (self._hash, self._description, self._sources)
        ]
        self.support.find = _address(self._find)
        self.support.hash, self.support.description, self.support.sources = map(
            _address, self._getters
        )

    def _found(self, _: int, identifier: bytes) -> int | None:
        found = self._by_name.get(identifier)
        return None if found is None else ctypes.addressof(found)


def _unbounded(bounds: Any) -> int:  # noqa: ANN401 - a pointer of ctypes
    bounds[0] = 0
    return 0


def _address(function: Any) -> int | None:  # noqa: ANN401 - ctypes' functions
    return ctypes.cast(function, ctypes.c_void_p).value


def _capsule(made: _SchemaSupport) -> Any:  # noqa: ANN401 - Python's capsules have no type
    """Return a capsule of a type support, which lives as long as the process."""
    new = ctypes.pythonapi.PyCapsule_New
    new.restype, new.argtypes = (
        ctypes.py_object,
        [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p],
    )
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(made))
    return new(ctypes.addressof(made.support), None, None)
