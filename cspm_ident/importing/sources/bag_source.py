"""A bag: numbers inside messages of any type, in order of log time."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

import numpy as np

from cspm_ident.importing.column_store import ColumnStore
from cspm_ident.importing.sources.source import Progress
from cspm_msgs_py.bag import open_bag
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.ros_types import deserialize

PIECE = 20_000  # messages
_NAME = re.compile(r"^(?P<topic>/[^:]+):(?P<path>[\w.\[\]/-]+)$")
_STEP = re.compile(r"([A-Za-z_]\w*)|\[([^\]]+)\]")
_FORM = "/TOPIC:FIELD, such as /joint_states:position[surge] or /mocap:pose.position.x"
Getter = Callable[[Any], float]


class BagSource:
    """The numbers of a bag's messages; see `Source`.

    A column is `/topic:path`. A step of the path is a field's name, a number in brackets, or for
    arrays beside an array `name` (as in JointState) a name in brackets.
    """

    kind = "bag"
    stamped = True

    def __init__(self, path: Path) -> None:
        """Open the bag.

        Raises:
            InputError: it is none, damaged, or empty.
        """
        self.path = path
        self._bag = open_bag(path)
        self.columns = tuple(f"{name}:…" for name in self._bag.topics)
        self.notes = [f"{name} cannot be read: {why}" for name, why in self._bag.unplayable.items()]

    def stamp_column(self, column: str, stamp: str) -> str:
        """Return the column of the stamps of another column's messages."""
        return f"{_topic_of(column, self.path)}:<{stamp}>"

    def close(self) -> None:
        """Close the bag."""
        self._bag.close()

    def read(
        self,
        numbers: Collection[str],
        times: Collection[str],
        store: ColumnStore,
        progress: Progress,
    ) -> None:
        """Store columns; see `Source`."""
        getters = self._getters([*numbers, *times])
        waiting: dict[str, list[Any]] = {name: [] for name in [*numbers, *times]}
        total = sum(self._bag.topics[name].count for name in getters)
        messages = self._bag.messages(list(getters))
        for count, (log_ns, topic, payload) in enumerate(messages, start=1):
            message = deserialize(payload, self._bag.topics[topic].ros_type)
            for name, getter in getters[topic].items():
                waiting[name].append(log_ns if name.endswith(":<log>") else getter(message))
            if count % PIECE == 0:
                _flush(waiting, times, store)
                progress(min(count / total, 1.0))
        _flush(waiting, times, store)

    def _getters(self, columns: list[str]) -> dict[str, dict[str, Getter]]:
        getters: dict[str, dict[str, Getter]] = {}
        for column in dict.fromkeys(columns):
            topic = _topic_of(column, self.path)
            if topic not in self._bag.topics:
                reason = self._bag.unplayable.get(topic)
                raise InputError(
                    f"{self.path}: {topic} cannot be read: {reason}"
                    if reason
                    else f"{self.path}: no topic {topic}, allowed: {', '.join(self._bag.topics)}"
                )
            ros_type = self._bag.topics[topic].ros_type
            getters.setdefault(topic, {})[column] = _getter(column, ros_type, self.path)
        return getters


def _flush(waiting: dict[str, list[Any]], times: Collection[str], store: ColumnStore) -> None:
    for name, values in waiting.items():
        kind = np.longdouble if name in times else np.float64
        store.append(name, np.array(values, dtype=np.int64 if name in times else kind).astype(kind))
        values.clear()


def _topic_of(column: str, path: Path) -> str:
    if column.endswith((":<header>", ":<log>")):
        return column.rpartition(":")[0]
    match = _NAME.match(column)
    if match is None:
        raise InputError(f"{path}: column '{column}', allowed: {_FORM}")
    return match["topic"]


def _getter(column: str, ros_type: str, path: Path) -> Getter:
    """Return what takes a column's number out of a message."""
    what = column.rpartition(":")[2]
    if what == "<log>":
        return lambda _: 0
    steps = [(name, key) for name, key in _STEP.findall(what)]

    def get(message: Any) -> float:  # noqa: ANN401 - classes are generated at run time
        try:
            if what == "<header>":
                stamp = message.header.stamp
                return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
            return float(_walk(message, steps))
        except (AttributeError, LookupError, TypeError, ValueError):
            raise InputError(
                f"{path}: {ros_type} has no number '{what}', {_allowed(message, what)}"
            ) from None

    return get


def _walk(node: Any, steps: list[tuple[str, str]]) -> Any:  # noqa: ANN401 - see _getter
    parent = node
    for name, key in steps:
        if name:
            parent, node = node, getattr(node, name)
        elif key.lstrip("-").isdigit():
            node = node[int(key)]
        else:
            node = node[list(parent.name).index(key)]
    return node


def _allowed(message: Any, what: str) -> str:  # noqa: ANN401 - see _getter
    if what == "<header>":
        return "allowed: a clock with stamp: log"
    fields = [name for name in message.__dataclass_fields__ if name != "__msgtype__"]
    joints = list(getattr(message, "name", []))
    named = f" (named {', '.join(map(str, joints))})" if joints else ""
    return f"allowed: a path from {', '.join(fields)}{named}"
