"""A sqlite3 file of rosbag2 as one run of messages.

Tables: https://github.com/ros2/rosbag2, package `rosbag2_storage_sqlite3`. The readers of `rosbags`
leave the order of messages with equal log time to the query planner, which is why the query is
here.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from cspm_msgs_py.bag.run import StoredChannel, StoredMessage, StoredRun
from cspm_msgs_py.errors import InputError

MAGIC = b"SQLite format 3\x00"
_TABLES = {"topics", "messages"}


class SqliteRuns:
    """A `.db3` file of rosbag2; see `StoredFile`."""

    def __init__(self, path: Path) -> None:
        """Open the file.

        Raises:
            InputError: it is not a bag, or damaged.
        """
        self.path = path
        self.faults: list[str] = []
        with self._errors():
            self._database = sqlite3.connect(_uri(path), uri=True, check_same_thread=False)
        try:
            with self._errors():
                self.channels = self._channels()
                self.runs = self._runs()
        except BaseException:
            self._database.close()
            raise

    @contextmanager
    def _errors(self) -> Iterator[None]:
        try:
            yield
        except (sqlite3.Error, TypeError, ValueError) as err:
            reason = " ".join(str(err).split())
            raise InputError(f"{self.path}: not a readable sqlite3 bag ({reason})") from None

    def _channels(self) -> list[StoredChannel]:
        tables = {name for (name,) in self._database.execute("SELECT name FROM sqlite_master")}
        if not tables >= _TABLES:
            raise InputError(
                f"{self.path}: no bag: it lacks the tables {', '.join(sorted(_TABLES - tables))}"
            )
        definitions = self._definitions() if "message_definitions" in tables else {}
        counts = {
            topic: (int(count), int(first))
            for topic, count, first in self._database.execute(
                "SELECT topic_id, COUNT(*), MIN(id) FROM messages GROUP BY topic_id"
            )
        }
        channels = []
        for id_, name, ros_type, encoding in self._database.execute(
            "SELECT id, name, type, serialization_format FROM topics ORDER BY id"
        ):
            count, first = counts.pop(id_, (0, None))
            schema_encoding, text = definitions.get(ros_type, ("", ""))
            sample = None if text or first is None else self._payload(first)
            channels.append(
                StoredChannel(
                    int(id_),
                    str(name),
                    str(ros_type),
                    count,
                    str(encoding),
                    str(schema_encoding),
                    str(text),
                    sample,
                )
            )
        if counts:
            raise InputError(
                f"{self.path}: messages of topic {next(iter(counts))}, which no row describes"
            )
        return channels

    def _definitions(self) -> dict[str, tuple[str, str]]:
        """Return encoding and text of each type's definition."""
        rows = self._database.execute(
            "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
        )
        return {name: (encoding, text) for name, encoding, text in rows}

    def _payload(self, id_: int) -> bytes:
        ((payload,),) = self._database.execute("SELECT data FROM messages WHERE id = ?", (id_,))
        return bytes(payload)

    def _runs(self) -> list[StoredRun]:
        ((first, last),) = self._database.execute(
            "SELECT (SELECT MIN(timestamp) FROM messages), (SELECT MAX(timestamp) FROM messages)"
        )
        return [] if first is None else [StoredRun(int(first), int(last), self._read)]

    def _read(self, channels: Collection[int], start_ns: int) -> Iterator[StoredMessage]:
        marks = ", ".join("?" * len(channels))
        latest = start_ns
        with self._errors():
            for topic, log, payload in self._database.execute(
                "SELECT topic_id, timestamp, data FROM messages"
                f" WHERE timestamp >= ? AND topic_id IN ({marks}) ORDER BY timestamp, id",
                (start_ns, *channels),
            ):
                if not (isinstance(log, int) and isinstance(payload, bytes)):
                    raise InputError(f"{self.path}: a message without log time or content")
                if log < latest:
                    raise InputError(f"{self.path}: damaged index of log times")
                latest = log
                yield log, topic, payload

    def close(self) -> None:
        """Close the file."""
        self._database.close()


def _uri(path: Path) -> str:
    """Return how to open the file: untouched, unless the log beside it holds the last messages.

    That is so while its writer runs and after it was killed; sqlite then needs a file to lock.
    """
    log = Path(f"{path}-wal")
    live = log.exists() and log.stat().st_size > 0
    return f"{path.absolute().as_uri()}?{'mode=ro' if live else 'immutable=1'}"
