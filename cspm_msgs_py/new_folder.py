"""Folders that a program makes and fills: those that stay, and those that go with it."""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
import weakref
from contextlib import suppress
from functools import cache
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


class ScratchFolder:
    """A temporary folder that goes with its program, however that ends.

    It is removed at the end of a `with` block, which gives its path, or with the last reference to
    it. A process that is killed removes nothing: the next that makes such a folder does. Each holds
    a lock on its own for as long as it lives, which the system gives back.

    Attributes:
        path: of the folder.
    """

    def __init__(self, what: str) -> None:
        """Make a folder whose name begins with `what`.

        Raises:
            InputError: the folder of all such folders belongs to somebody else.
        """
        room = _own_room(Path(tempfile.gettempdir()))
        _remove_abandoned(room)
        self.path, held = _locked_folder(room, what)
        self._remove = weakref.finalize(self, _remove, self.path, held, os.getpid())

    def __enter__(self) -> Path:
        return self.path

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Remove the folder and all in it; a second time does nothing."""
        self._remove()


def _own_room(place: Path) -> Path:
    """Return the folder in which all scratch folders of this user are."""
    room = place / f"cspm-{os.getuid()}"
    room.mkdir(mode=0o700, exist_ok=True)
    # A link would have other folders swept than those that are made here.
    if room.is_symlink() or room.stat().st_uid != os.getuid():
        raise InputError(f"{room}: belongs to somebody else, allowed: a TMPDIR of one's own")
    return room


@cache
def _remove_abandoned(room: Path) -> None:
    """Remove, once in a process, the folders in `room` whose process is no more."""
    for folder in room.iterdir():
        with suppress(OSError):
            held = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
            try:
                fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(folder, ignore_errors=True)
            finally:
                os.close(held)


def _locked_folder(room: Path, what: str) -> tuple[Path, int]:
    """Make a folder and return it with what holds its lock, a descriptor."""
    while True:
        folder = Path(tempfile.mkdtemp(prefix=f"{what}-", dir=room))
        # Another process may take it for abandoned before it is locked.
        with suppress(FileNotFoundError):
            held = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
            # Some network file systems have no locks: there nobody removes what is abandoned.
            with suppress(OSError):
                fcntl.flock(held, fcntl.LOCK_SH)
            if folder.exists():
                return folder, held
            os.close(held)


def _remove(folder: Path, held: int, owner: int) -> None:
    """Remove a folder, unless this is a fork of the process that made it, and let go of it."""
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)
    os.close(held)
