"""`metadata.yaml`: what the folder says about the files in it, in the words of rosbag2."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.topics import QOS_DEPTH, QOS_RELIABILITY
from cspm_msgs_py.yaml_file import dump_yaml, read_yaml

FILE_NAME = "metadata.yaml"
ROS_DISTRO = "jazzy"
_VERSION = 9
_REMEDY = "`cspm recover` writes it"
_INFINITE = {"sec": 9223372036, "nsec": 854775807}


@dataclass(frozen=True)
class TopicEntry:
    """One topic of a bag.

    Attributes:
        name: topic name.
        ros_type: `package/msg/Type`.
        type_hash: `RIHS01_…`, empty where unknown.
        qos: what the publishers offered, a list of profiles as rosbag2 writes them.
        count: number of messages.
        encoding: of the messages, such as `cdr`.
    """

    name: str
    ros_type: str
    type_hash: str
    qos: list[dict[str, Any]]
    count: int
    encoding: str = "cdr"


@dataclass(frozen=True)
class FileEntry:
    """One file of a bag: its name, first and last log time [ns], number of messages."""

    name: str
    first_ns: int
    last_ns: int
    count: int


def contract_qos(*, latched: bool = False) -> list[dict[str, Any]]:
    """Return the QoS profile of the contract's topics as rosbag2 writes it."""
    return [
        {
            "history": "keep_last",
            "depth": QOS_DEPTH,
            "reliability": QOS_RELIABILITY,
            "durability": "transient_local" if latched else "volatile",
            "deadline": dict(_INFINITE),
            "lifespan": dict(_INFINITE),
            "liveliness": "automatic",
            "liveliness_lease_duration": dict(_INFINITE),
            "avoid_ros_namespace_conventions": False,
        }
    ]


def metadata_text(
    topics: Sequence[TopicEntry], files: Sequence[FileEntry], *, message_zstd: bool = False
) -> str:
    """Return the text of `metadata.yaml`; messages may be compressed with zstd one by one."""
    filled = [file for file in files if file.count]
    first = min((file.first_ns for file in filled), default=0)
    last = max((file.last_ns for file in filled), default=0)
    return dump_yaml(
        {
            "rosbag2_bagfile_information": {
                "version": _VERSION,
                "storage_identifier": "mcap",
                "duration": {"nanoseconds": last - first},
                "starting_time": {"nanoseconds_since_epoch": first},
                "message_count": sum(file.count for file in files),
                "topics_with_message_count": [_topic(topic) for topic in topics],
                "compression_format": "zstd" if message_zstd else "",
                "compression_mode": "MESSAGE" if message_zstd else "",
                "relative_file_paths": [file.name for file in files],
                "files": [_file(file) for file in files],
                "custom_data": None,
                "ros_distro": ROS_DISTRO,
            }
        }
    )


def _topic(topic: TopicEntry) -> dict[str, Any]:
    return {
        "topic_metadata": {
            "name": topic.name,
            "type": topic.ros_type,
            "serialization_format": topic.encoding,
            "offered_qos_profiles": deepcopy(topic.qos),  # the same list twice makes an alias
            "type_description_hash": topic.type_hash,
        },
        "message_count": topic.count,
    }


def _file(file: FileEntry) -> dict[str, Any]:
    return {
        "path": file.name,
        "starting_time": {"nanoseconds_since_epoch": file.first_ns},
        "duration": {"nanoseconds": file.last_ns - file.first_ns},
        "message_count": file.count,
    }


def write_metadata(
    folder: Path,
    topics: Sequence[TopicEntry],
    files: Sequence[FileEntry],
    *,
    message_zstd: bool = False,
) -> None:
    """Write `metadata.yaml` so that at every instant an old or a new one is there.

    Raises:
        OSError: the folder cannot be written.
    """
    beside = folder / (FILE_NAME + ".new")
    beside.write_text(metadata_text(topics, files, message_zstd=message_zstd), encoding="utf-8")
    os.replace(beside, folder / FILE_NAME)


@dataclass(frozen=True)
class Bag:
    """What a folder's `metadata.yaml` names: how the messages are stored, and in which files.

    Attributes:
        storage: `mcap` or `sqlite3`, or what else it names.
        files: in order.
        compression: `none`, or what is compressed with zstd: `file` or `message`; None where
            nothing says it. The chunks of an MCAP file may be compressed in any case.
        faults: what is missing in the metadata, and was found from the files.
    """

    storage: str
    files: list[Path]
    compression: str | None = "none"
    faults: tuple[str, ...] = ()


def read_bag(folder: Path, *, compressions: Sequence[str] = ("none",)) -> Bag:
    """Return the storage and files of a bag.

    Args:
        folder: the bag's folder.
        compressions: which of `none`, `file` and `message` the caller can read.

    Raises:
        InputError: unusable `metadata.yaml`, a file that it names is missing, or neither metadata
            nor files of a bag.
    """
    path = folder / FILE_NAME
    if not path.exists():
        return _bag_of_files(folder)
    content = read_yaml(path)
    try:
        bag = content["rosbag2_bagfile_information"]
        storage, names = (
            str(bag["storage_identifier"] or ""),
            [str(n) for n in bag["relative_file_paths"]],
        )
        mode = str(bag.get("compression_mode") or "none").lower()
        method = str(bag.get("compression_format"))
    except (KeyError, TypeError, AttributeError):
        raise InputError(f"{path}: not the metadata of a rosbag2 folder") from None
    if mode not in compressions:
        raise InputError(
            f"{path}: compression_mode {mode!r}, allowed: {', '.join(compressions)} (chunks may be"
            " compressed)"
        )
    if mode != "none" and method != "zstd":
        raise InputError(f"{path}: compression_format {method!r}, allowed: zstd")
    files = [folder / Path(name).name for name in names]
    if not files:
        raise InputError(f"{path}: names no file")
    for file in files:
        if not file.is_file():
            raise InputError(f"{file}: no such file, but {FILE_NAME} names it")
    if storage:
        return Bag(storage, files, mode)
    fault = f"{path}: names no storage_identifier, taken from the files; {_REMEDY}"
    return Bag(_storage_of(files[0]), files, mode, (fault,))


def _bag_of_files(folder: Path) -> Bag:
    """Return the bag that the files of a folder without metadata make, by the numbers in names."""
    for suffix in ("*.mcap", "*.db3"):
        if files := sorted(folder.glob(suffix), key=_numbered):
            fault = f"{folder}: {FILE_NAME} is missing, its {len(files)} files are read by the"
            fault += f" numbers in their names; {_REMEDY}"
            return Bag(_storage_of(files[0]), files, None, (fault,))
    raise InputError(
        f"{folder}: a folder without {FILE_NAME}, allowed: a rosbag2 folder or an .mcap file"
    )


def _numbered(path: Path) -> list[tuple[int, str]]:
    parts = re.split(r"(\d+)", path.name)
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts]


def _storage_of(path: Path) -> str:
    try:
        with path.open("rb") as file:
            start = file.read(16)
    except OSError as err:
        raise InputError(f"{path}: unreadable ({err.strerror})") from None
    return "sqlite3" if start.startswith(b"SQLite format 3") else "mcap"
