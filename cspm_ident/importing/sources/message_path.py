"""The way from a message to one of its numbers: `position[surge]`, `transforms[bar].transform…`."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any, Final

import numpy as np

from cspm_msgs_py.errors import InputError

_NAME = re.compile(r"^(?P<topic>/[^:]+):(?P<path>[\w.\[\]/ -]+)$")
_STEP = re.compile(r"([A-Za-z_]\w*)|\[([^\]]+)\]")
_FORM = "/TOPIC:FIELD, such as /joint_states:position[surge] or /mocap:pose.position.x"
_JOINTS = "sensor_msgs/msg/JointState"
HEADER, LOG = "<header>", "<log>"


class _Absent:
    """Says that a message has nothing of that name, and is passed over."""


ABSENT: Final = _Absent()
Steps = tuple[tuple[str, str], ...]


def split_column(column: str, path: Path) -> tuple[str, str]:
    """Return topic and path of a column `/topic:path`; `path` of the file is for errors.

    Raises:
        InputError: the column has another form.
    """
    match = _NAME.match(column)
    if match is None:
        raise InputError(f"{path}: column '{column}', allowed: {_FORM}")
    return match["topic"], match["path"]


def selector_of(what: str) -> str:
    """Return what a path selects of a message: its keys, with the way to elements of arrays.

    Columns of one selector have their rows from the same messages.
    """
    steps = _STEP.findall(what)
    keyed = [i for i, (_, key) in enumerate(steps) if key]
    if not keyed:
        return ""
    if keyed[-1] == len(steps) - 1:
        key = steps[-1][1]
        return "" if _is_index(key) else f"[{key}]"
    return "".join(f"[{key}]" if key else f".{name}" for name, key in steps[: keyed[-1] + 1])[1:]


def _is_index(key: str) -> bool:
    return key.lstrip("-").isdigit()


class MessagePath:
    """Reads one number of each message of a topic, and holds it to one meaning.

    A number in brackets counts the elements of an array, a name is that of an array `name` beside
    (as in JointState), or of an element's `child_frame_id`, `name` or `header.frame_id`.
    """

    def __init__(self, file: Path, topic: str, ros_type: str, what: str) -> None:
        """Take the file, the topic and its type, for errors, and the path in the message."""
        self._where, self._type, self.what = f"{file}: {topic}", ros_type, what
        self._steps: Steps = tuple(_STEP.findall(what))
        self._keys: list[str] = []
        keyed = [not name and not _is_index(key) for name, key in self._steps]
        self._simple = ros_type == _JOINTS and keyed == [False, True]
        self._index = -1
        self._first: tuple[Any, ...] | None = None
        self.names: set[str] = set()

    def value(self, message: Any, number: int) -> float | _Absent:  # noqa: ANN401 - made at run time
        """Return the number; NaN where its array is empty, `ABSENT` where its name is not there.

        Args:
            message: of the topic.
            number: of the message on its topic, from 1.

        Raises:
            InputError: there is no such number, or what is there changed within the bag.
        """
        # The way of most: a number of a JointState whose names are those of the message before.
        if self._simple and message.name == self._keys and self._index >= 0:
            values = getattr(message, self._steps[0][0])
            if len(values) == len(self._keys):
                return float(values[self._index])
        try:
            node = self._walk(message, self._steps, number)
            whole = isinstance(node, int | np.integer)  # of 64 bits, which float rounds
            return node if whole or node is ABSENT else float(node)
        except (AttributeError, LookupError, TypeError, ValueError):
            raise InputError(
                f"{self._where}: {self._type} has no number '{self.what}', {_fields(message)}"
            ) from None

    def stamp(self, message: Any, number: int) -> int:  # noqa: ANN401 - made at run time
        """Return the stamp [ns] of the innermost header on the path, which the message has.

        Raises:
            InputError: there is none.
        """
        stamped, node = getattr(message, "header", None), message
        for i in range(0 if self._simple else len(self._steps)):
            node = self._walk(message, self._steps[: i + 1], number)
            stamped = getattr(node, "header", stamped)
        if stamped is None:
            raise InputError(
                f"{self._where}: {self._type} has no header, allowed: a clock with stamp: log"
            )
        return int(stamped.stamp.sec) * 1_000_000_000 + int(stamped.stamp.nanosec)

    def _walk(self, node: Any, steps: Steps, number: int) -> Any:  # noqa: ANN401 - any message
        parent = node
        for name, key in steps:
            if name:
                parent, node = node, getattr(node, name)
                continue
            names = getattr(parent, "name", None)
            beside = names is not None and not isinstance(names, str)
            if _is_index(key):
                node = self._counted(node, int(key), names if beside else None, number)
            elif beside:
                node = self._named(node, key, names, number)
            else:
                node = next((one for one in node if key in self._seen(_identity(one))), ABSENT)
            if node is ABSENT or (isinstance(node, float) and math.isnan(node)):
                return node
        return node

    def _seen(self, names: tuple[str, ...]) -> tuple[str, ...]:
        self.names.update(name for name in names if name)
        return names

    def _named(self, values: Any, key: str, names: Any, number: int) -> Any:  # noqa: ANN401
        if names != self._keys:
            self._keys = list(names)
            self.names.update(names)
            self._index = self._keys.index(key) if key in self._keys else -1
        if self._index < 0:
            return ABSENT
        if len(values) != len(names):
            if not len(values):
                return float("nan")
            raise InputError(
                f"{self._where}: message {number}: {len(values)} values in '{self.what}' for"
                f" {len(names)} names, allowed: one each, or none"
            )
        return values[self._index]

    def _counted(self, values: Any, index: int, names: Any, number: int) -> Any:  # noqa: ANN401
        """Return an element by its number, if the same is there in every message."""
        if names is not None and len(names) and not len(values):
            return float("nan")
        element = values[index]
        named = names is not None and len(names) > index
        found = (len(values), *((str(names[index]),) if named else _identity(element)))
        if self._first is None:
            self._first = found
        if found != self._first:
            raise InputError(
                f"{self._where}: message {number}: behind '{self.what}' is"
                f" {_described(found)}, in the first message {_described(self._first)}, allowed:"
                " the same in all; a name in the brackets, as [surge], follows it"
            )
        return element


def _identity(element: Any) -> tuple[str, ...]:  # noqa: ANN401 - any part of a message
    """Return the names that an element of an array calls itself."""
    header = getattr(element, "header", None)
    found = (
        getattr(element, "child_frame_id", ""),
        getattr(element, "name", ""),
        getattr(header, "frame_id", ""),
    )
    return tuple(name for name in found if isinstance(name, str) and name)


def _described(found: tuple[Any, ...]) -> str:
    count, *names = found
    return f"{' in '.join(names) or 'an unnamed number'} of {count}"


def _fields(message: Any) -> str:  # noqa: ANN401 - any message
    fields = [name for name in message.__dataclass_fields__ if name != "__msgtype__"]
    joints = list(getattr(message, "name", []))
    named = f" (named {', '.join(map(str, joints))})" if joints else ""
    return f"allowed: a path from {', '.join(fields)}{named}"
