"""A bag: numbers inside messages of any type, in order of log time."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path

from cspm_ident.importing.column_store import ColumnStore
from cspm_ident.importing.sources.message_path import selector_of, split_column
from cspm_ident.importing.sources.source import Progress
from cspm_ident.importing.sources.topic_rows import SelectedRows, rows_of_topics
from cspm_msgs_py.bag import open_bag
from cspm_msgs_py.errors import InputError

PIECE = 20_000  # messages


class BagSource:
    """The numbers of a bag's messages; see `Source`.

    A column is `/topic:path`; see `MessagePath`. Rows come from the messages that have what the
    path names, so that several senders may share a topic, each with its own names.
    """

    kind = "bag"
    stamped = True

    def __init__(self, path: Path) -> None:
        """Open the bag.

        Raises:
            InputError: it is none, damaged, or empty.
        """
        self.path = path
        self.time_units: dict[str, str] = {}
        self._bag = open_bag(path, own_types=True, tolerant=True)
        self.columns = tuple(f"{name}:…" for name in self._bag.topics)
        self.notes = [f"{name} cannot be read: {why}" for name, why in self._bag.unplayable.items()]

    def stamp_column(self, column: str, stamp: str) -> str:
        """Return the column of the stamps, `header` or `log`, of another column's messages."""
        topic, what = split_column(column, self.path)
        return f"{topic}:{selector_of(what)}<{stamp}>"

    def close(self) -> None:
        """Close the bag."""
        self._bag.close()

    def read(
        self,
        numbers: Collection[str],
        times: Mapping[str, str | None],
        store: ColumnStore,
        progress: Progress,
    ) -> None:
        """Store columns; see `Source`."""
        rows = self._rows([*numbers, *times])
        total = sum(self._bag.topics[name].count for name in rows)
        places = dict.fromkeys(rows, 0)
        for count, (log_ns, topic, payload) in enumerate(self._bag.messages(list(rows)), start=1):
            message = self._bag.message(topic, payload)
            places[topic] += 1
            for selected in rows[topic]:
                selected.take(message, log_ns, places[topic])
            if count % PIECE == 0:
                _flush(rows, store)
                progress(min(count / total, 1.0))
        _flush(rows, store)
        self._conclude(rows, places)

    def _rows(self, columns: list[str]) -> dict[str, list[SelectedRows]]:
        for topic in dict.fromkeys(column.partition(":")[0] for column in columns):
            if topic not in self._bag.topics:
                reason = self._bag.unplayable.get(topic)
                raise InputError(
                    f"{self.path}: {topic} cannot be read: {reason}"
                    if reason
                    else f"{self.path}: no topic {topic}, allowed: {', '.join(self._bag.topics)}"
                )
        types = {name: topic.ros_type for name, topic in self._bag.topics.items()}
        return rows_of_topics(self.path, columns, types)

    def _conclude(self, rows: dict[str, list[SelectedRows]], places: dict[str, int]) -> None:
        self.notes += self._bag.faults
        for topic, count in places.items():
            if lost := self._bag.topics[topic].count - count:
                self.notes.append(f"{topic}: {lost} messages are in what is damaged")
        for topic, parts in rows.items():
            for part in parts:
                part.check_found()
            if passed_over := max(part.passed_over for part in parts):
                self.notes.append(f"{topic}: up to {passed_over} messages have other names")


def _flush(rows: dict[str, list[SelectedRows]], store: ColumnStore) -> None:
    for part in (part for parts in rows.values() for part in parts):
        part.flush(store)
