"""The folder of a campaign: one row a run, kept as soon as it ends."""

from __future__ import annotations

import fcntl
import json
import os
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from cspm_msgs_py.errors import InputError

JOURNAL, TABLE, DESCRIPTION = "runs.jsonl", "runs.parquet", "campaign.json"
PAGE, RECORDINGS = "campaign.html", "recordings"
NUMBER = "run"
_LOCK = ".lock"
# How old the table may be while runs end [s]; the journal has all.
_TABLE_AGE_S = 30.0
Row = dict[str, Any]


class CampaignFolder:
    """Keeps the rows of one campaign, whatever ends the program.

    Each row is a line of the journal, written before the next run is handed out. The table is
    written anew now and then, and at the end. One program at a time may hold the folder.

    Attributes:
        rows: what is there, by the number of the run.
    """

    def __init__(self, path: Path, description: dict[str, Any]) -> None:
        """Open a folder, new or of the same campaign.

        Args:
            path: of the folder.
            description: plain data that two campaigns share only if they are the same.

        Raises:
            InputError: another campaign's, in use, or not writable.
        """
        self.path = path
        try:
            path.mkdir(parents=True, exist_ok=True)
            self._lock = (path / _LOCK).open("a")
        except OSError as err:
            raise InputError(f"{path}: {err.strerror}, allowed: a folder to write to") from None
        try:
            self._hold()
            self._check(description)
        except InputError:
            self._lock.close()
            raise
        self.rows: dict[int, Row] = {row[NUMBER]: row for row in self._journalled()}
        self._journal = (path / JOURNAL).open("a", encoding="utf-8")
        self._written = time.monotonic()

    def __enter__(self) -> CampaignFolder:
        return self

    def __exit__(self, *_: object) -> None:
        self.write_table()
        self._journal.close()
        self._lock.close()

    def keep(self, number: int, row: Row) -> None:
        """Keep the row of a run."""
        whole = {NUMBER: number, **row}
        self._journal.write(json.dumps(whole) + "\n")
        self._journal.flush()
        self.rows[number] = whole
        if time.monotonic() - self._written > _TABLE_AGE_S:
            self.write_table()

    def write_table(self) -> None:
        """Write all rows as Parquet, in one step, in the order of their numbers."""
        if not self.rows:
            return
        import pyarrow as pa
        from pyarrow import parquet

        columns = columns_of(self.rows[each] for each in sorted(self.rows))
        arrays = {
            # Without a value a column is one of texts, such as why runs failed.
            name: pa.array(each, pa.string() if {*each} == {None} else None)
            for name, each in columns.items()
        }
        table = pa.table(arrays)
        beside = self.path / f".{TABLE}"
        parquet.write_table(table, beside, compression="zstd")
        os.replace(beside, self.path / TABLE)
        self._written = time.monotonic()

    def _hold(self) -> None:
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(
                f"{self.path}: another campaign is writing to it, allowed: another folder, by --out"
            ) from None

    def _check(self, description: dict[str, Any]) -> None:
        place = self.path / DESCRIPTION
        if not place.exists():
            others = [each.name for each in self.path.iterdir() if each.name != _LOCK]
            if others:
                raise InputError(f"{self.path}: holds {others[0]}, allowed: a new or empty folder")
            place.write_text(json.dumps(description, indent=2) + "\n", encoding="utf-8")
            return
        found = json.loads(place.read_text(encoding="utf-8"))
        differing = [key for key, value in description.items() if found.get(key) != value]
        if differing:
            raise InputError(
                f"{self.path}: begun with another {differing[0].replace('_', ' ')}, allowed: a new"
                " folder, by --out"
            )

    def _journalled(self) -> list[Row]:
        """Return the journal's rows, without a last line that was cut, which is removed."""
        place = self.path / JOURNAL
        if not place.exists():
            return []
        content = place.read_bytes()
        whole = content[: content.rfind(b"\n") + 1]
        if len(whole) < len(content):
            place.write_bytes(whole)
        return [json.loads(line) for line in whole.splitlines()]


def columns_of(rows: Iterable[Row]) -> dict[str, list[Any]]:
    """Return rows as columns of one kind each: what is of several kinds becomes text."""
    listed = [*rows]
    names = dict.fromkeys(name for row in listed for name in row)
    found = {}
    for name in names:
        values = [row.get(name) for row in listed]
        kinds = {type(value) for value in values if value is not None}
        if kinds == {int, float}:
            values = [None if value is None else float(value) for value in values]
        elif len(kinds) > 1 or kinds & {dict, list}:
            values = [
                None if v is None else v if isinstance(v, str) else json.dumps(v) for v in values
            ]
        found[name] = values
    return found
