"""The files of a bag, opened by what their first bytes say, decompressed where that is needed."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path

import zstandard

from cspm_msgs_py.bag import sqlite_runs
from cspm_msgs_py.bag.mcap_runs import McapRuns
from cspm_msgs_py.bag.ros1_runs import Ros1Runs
from cspm_msgs_py.bag.run import StoredFile, StoredMessage, StoredRun
from cspm_msgs_py.bag.sqlite_runs import SqliteRuns
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.recording.chunk import LARGEST_CHUNK
from cspm_msgs_py.recording.mcap_file import BareFileError
from cspm_msgs_py.recording.records import MAGIC as MCAP_MAGIC
from cspm_msgs_py.recording.records import ROS1_MAGIC
from cspm_msgs_py.recording.rosbag2_metadata import read_bag

ALLOWED = "a rosbag2 folder, an .mcap or .db3 file, or a ROS 1 .bag"
_STORAGES = ("mcap", "sqlite3")
_COMPRESSIONS = ("none", "file", "message")
_READERS: dict[bytes, Callable[[Path], StoredFile]] = {
    MCAP_MAGIC: McapRuns,
    sqlite_runs.MAGIC: SqliteRuns,
    ROS1_MAGIC: Ros1Runs,
}


def open_files(
    path: Path, stack: ExitStack, *, tolerant: bool
) -> tuple[list[StoredFile], list[str]]:
    """Return the open files of a bag, in order, and what is missing in its folder.

    Files that are compressed as a whole are unpacked into a temporary folder. One of several that
    its writer left without a message is left out.

    Args:
        path: a rosbag2 folder or a file of a bag.
        stack: gets what closes the files and removes the folder.
        tolerant: leave out what is damaged in MCAP files, and list it in their `faults`.

    Raises:
        InputError: it is missing, not a bag, or damaged.
    """
    if not path.exists():
        raise InputError(f"{path}: no such file or folder")
    if not path.is_dir():
        return [_unpacked(_open(path, stack, tolerant=tolerant), None)], []
    bag = read_bag(path, compressions=_COMPRESSIONS)
    if bag.storage not in _STORAGES:
        raise InputError(f"{path}: stored as {bag.storage}, allowed: {', '.join(_STORAGES)}")
    paths = bag.files
    if bag.compression == "file":
        folder = stack.enter_context(ScratchFolder("bag"))
        paths = [_unpack_file(file, folder / file.stem) for file in paths]
    files, faults = [], list(bag.faults)
    for file in paths:
        try:
            files.append(_unpacked(_open(file, stack, tolerant=tolerant), bag.compression))
        except BareFileError as err:
            if len(faults) - len(bag.faults) + 1 == len(paths):
                raise
            faults.append(f"{err}: left out")
    return files, faults


def _unpacked(file: StoredFile, compression: str | None) -> StoredFile:
    """Return a file whose messages are decompressed, where they are compressed one by one.

    Where nothing says so, the first message shows it: none of CDR begins as zstd does.
    """
    if compression is None:
        everything = [channel.id for channel in file.channels]
        first = next(iter(run.read(everything, 0) for run in file.runs), iter(()))
        payload = next(first, (0, 0, b""))[2]
        return Unpacked(file) if payload.startswith(zstandard.FRAME_HEADER) else file
    return Unpacked(file) if compression == "message" else file


def _open(path: Path, stack: ExitStack, *, tolerant: bool) -> StoredFile:
    try:
        with path.open("rb") as file:
            start = file.read(max(map(len, _READERS)))
    except OSError as err:
        raise InputError(f"{path}: unreadable ({err.strerror})") from None
    if not start:
        raise BareFileError(f"{path}: an empty file, allowed: {ALLOWED}")
    for magic, reader in _READERS.items():
        if start.startswith(magic):
            opened = McapRuns(path, tolerant=tolerant) if reader is McapRuns else reader(path)
            stack.callback(opened.close)
            return opened
    raise InputError(f"{path}: not a bag (by its first bytes), allowed: {ALLOWED}")


def _unpack_file(path: Path, target: Path) -> Path:
    try:
        with path.open("rb") as packed, target.open("wb") as file:
            zstandard.ZstdDecompressor().copy_stream(packed, file)
    except zstandard.ZstdError as err:
        raise InputError(f"{path}: damaged zstd data ({err})") from None
    except OSError as err:
        raise InputError(f"{path}: cannot be unpacked to {target} ({err.strerror})") from None
    return target


class Unpacked:
    """A file whose messages are compressed one by one; see `StoredFile`."""

    def __init__(self, file: StoredFile) -> None:
        """Take over an open file.

        Raises:
            InputError: a sample of a channel is damaged.
        """
        self.path = file.path
        self.faults = file.faults
        self.channels = [
            replace(channel, sample=self._unpack(channel.sample)) if channel.sample else channel
            for channel in file.channels
        ]
        self.runs = [run._replace(read=partial(self._read, run)) for run in file.runs]
        self.close = file.close

    def _read(
        self, run: StoredRun, channels: Collection[int], start_ns: int
    ) -> Iterator[StoredMessage]:
        return (
            (log, channel, self._unpack(payload))
            for log, channel, payload in run.read(channels, start_ns)
        )

    def _unpack(self, payload: bytes) -> bytes:
        unpacker = zstandard.ZstdDecompressor()
        try:
            return bytes(unpacker.decompress(payload, max_output_size=LARGEST_CHUNK))
        except (zstandard.ZstdError, MemoryError) as err:
            reason = " ".join(str(err).split())
            raise InputError(f"{self.path}: a damaged compressed message ({reason})") from None
