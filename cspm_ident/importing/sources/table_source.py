"""What sources without messages have in common: rows without stamps, no file held open."""

from __future__ import annotations

from pathlib import Path

from cspm_msgs_py.errors import InputError


class TableSource:
    """Base of the sources whose rows are no messages; see `Source`.

    Attributes:
        path: the file.
    """

    path: Path

    def stamp_column(self, column: str, stamp: str) -> str:
        """Refuse: rows of a table have no stamps of their own.

        Raises:
            InputError: always.
        """
        raise InputError(f"{self.path}: stamp {stamp}, allowed: with bags; here column or rate")

    def close(self) -> None:
        """Do nothing: no file is open between calls."""
