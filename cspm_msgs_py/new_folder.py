"""Folders that a command makes and fills."""

from __future__ import annotations

from pathlib import Path

from cspm_msgs_py.errors import InputError


def refuse_existing(folder: Path | None) -> None:
    """Refuse to write into what is there already; None, for no folder, is fine.

    Raises:
        InputError: the folder exists.
    """
    if folder is not None and folder.exists():
        raise InputError(f"{folder}: already exists, allowed: a new folder")


def new_folder(folder: str | Path) -> Path:
    """Make a folder, and those above it, and return its path.

    Raises:
        InputError: the folder exists.
    """
    place = Path(folder)
    refuse_existing(place)
    place.mkdir(parents=True)
    return place
