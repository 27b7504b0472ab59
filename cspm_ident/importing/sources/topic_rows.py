"""The rows that the messages of one topic give, by what is selected of them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from cspm_ident.importing.column_store import ColumnStore
from cspm_ident.importing.sources.exact_numbers import exact_numbers
from cspm_ident.importing.sources.message_path import (
    ABSENT,
    HEADER,
    LOG,
    MessagePath,
    selector_of,
    split_column,
)
from cspm_msgs_py.errors import InputError


class SelectedRows:
    """Columns whose rows come from the same messages of a topic, among them their stamps.

    Attributes:
        passed_over: messages that have nothing of that name.
    """

    def __init__(self, file: Path, topic: str, ros_type: str, names: Iterable[str]) -> None:
        """Take the file, the topic, its type, and the names of the number columns."""
        self._file, self._topic = file, topic
        self._paths = {
            name: MessagePath(file, topic, ros_type, split_column(name, file)[1]) for name in names
        }
        self._leading = next(iter(self._paths.values()))
        self._stamps: dict[str, str] = {}
        self._waiting: dict[str, list[Any]] = {name: [] for name in self._paths}
        self._frame: str | None = None
        self.rows = self.passed_over = 0

    def add_stamps(self, name: str, kind: str) -> None:
        """Keep the stamps of the rows too, as a column; `kind` is `<header>` or `<log>`."""
        self._stamps[name] = kind
        self._waiting.setdefault(name, [])

    def take(self, message: Any, log_ns: int, number: int) -> None:  # noqa: ANN401 - any message
        """Add a message's row; pass over one that has nothing of that name.

        Raises:
            InputError: see `MessagePath`; or the message is in another frame than the first.
        """
        values = {name: path.value(message, number) for name, path in self._paths.items()}
        if ABSENT in values.values():
            self.passed_over += 1
            return
        self._check_frame(message, number)
        self.rows += 1
        for name, value in values.items():
            self._waiting[name].append(value)
        for name, kind in self._stamps.items():
            stamp = log_ns if kind == LOG else self._leading.stamp(message, number)
            self._waiting[name].append(stamp)

    def _check_frame(self, message: Any, number: int) -> None:  # noqa: ANN401 - any message
        header = getattr(message, "header", None)
        # Frames of joints have no meaning, and publishers fill them as they like.
        if header is None or not isinstance(getattr(message, "name", ""), str):
            return
        frame = f"'{header.frame_id}'"
        if child := getattr(message, "child_frame_id", ""):
            frame += f" of '{child}'"
        if self._frame is None:
            self._frame = frame
        if frame != self._frame:
            raise InputError(
                f"{self._file}: {self._topic}: message {number} is in frame {frame}, the first in"
                f" {self._frame}, allowed: one frame; import the frames from bags of their own"
            )

    def flush(self, store: ColumnStore) -> None:
        """Store what waits."""
        for name, values in self._waiting.items():
            if name in self._stamps:
                piece = np.array(values, dtype=np.int64).astype(np.longdouble)
            else:
                piece = exact_numbers(values)
            store.append(name, piece)
            values.clear()

    def check_found(self) -> None:
        """Refuse a name that no message had.

        Raises:
            InputError: naming those that there were.
        """
        if self.rows or not self.passed_over:
            return
        known = sorted(set().union(*(path.names for path in self._paths.values())))
        raise InputError(
            f"{self._file}: {self._topic}: no message has '{self._leading.what}', allowed:"
            f" {', '.join(known) or 'a name that occurs'}"
        )


def rows_of_topics(
    file: Path, columns: Iterable[str], types: dict[str, str]
) -> dict[str, list[SelectedRows]]:
    """Return by topic the rows that number and stamp columns ask for.

    Args:
        file: the bag, for errors.
        columns: of numbers, `/topic:path`, and of stamps, `/topic:SELECTOR<header>` or `…<log>`.
        types: of the topics.
    """
    numbers: dict[tuple[str, str], list[str]] = {}
    stamps: list[tuple[str, str, str, str]] = []
    for column in columns:
        topic, _, what = column.partition(":")
        kind = next((kind for kind in (HEADER, LOG) if what.endswith(kind)), None)
        if kind is None:
            numbers.setdefault((topic, selector_of(what)), []).append(column)
        else:
            stamps.append((column, topic, what.removesuffix(kind), kind))
    found = {
        key: SelectedRows(file, key[0], types[key[0]], names) for key, names in numbers.items()
    }
    for column, topic, selector, kind in stamps:
        found[topic, selector].add_stamps(column, kind)
    by_topic: dict[str, list[SelectedRows]] = {}
    for (topic, _), rows in found.items():
        by_topic.setdefault(topic, []).append(rows)
    return by_topic
