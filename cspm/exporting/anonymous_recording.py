"""A copy of a recording without names of people, places, files and machines."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from heapq import merge
from itertools import repeat
from pathlib import Path
from typing import Any, NamedTuple

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.message import carries_row
from cspm_msgs_py.recording import Recording, RecordingWriter, Rows
from cspm_msgs_py.recording.attached_testbed import TESTBED
from cspm_msgs_py.recording.run_record import OWN_CONTROLLERS, RECORD_NAME
from cspm_msgs_py.topics import Topic
from cspm_msgs_py.yaml_file import dump_yaml, parse_yaml
from cspm_run.bundle import SCENARIO, read_bundle

MACHINE, RUN = "machine", "run"
# Of a recording's record: how it was made, and nobody's name.
_KEPT = ("contract_version", "mode", "plant", "seed", "package_version", OWN_CONTROLLERS)


class _Described(NamedTuple):
    """What a recording carries beside its messages."""

    attachments: dict[str, bytes]
    record: dict[str, str]


def copy_without_names(source: Path, folder: Path, topics: Mapping[str, Topic]) -> tuple[str, ...]:
    """Write the numbers of a recording to a new one, bit for bit; return the code it carries.

    Names of cables stay, since a verdict is about them. Left out are statuses, what is for viewers
    alone, comments, notes, and files that the run did not read.

    Args:
        source: the recording.
        folder: a new folder.
        topics: of the machine, by name.

    Raises:
        InputError: it cannot be read, has none of the topics, or the folder exists.
    """
    with Recording(source) as reader:
        names = [
            name
            for name, info in reader.topics.items()
            if name in topics and info.count and carries_row(info.ros_type)
        ]
        if not names:
            raise InputError(f"{source}: no topic of the machine, allowed: a recording of it")
        rows, found = reader.rows_of(names), {name: reader.topic(name) for name in names}
        about = _described(reader, str(source))
    with RecordingWriter(
        folder, found, attachments=about.attachments, metadata=about.record
    ) as writer:
        _append(writer, rows)
    return tuple(name for name in about.attachments if name.endswith(".py"))


def without_names(text: str, source: str, name: str) -> str:
    """Return a test-bed's or scenario's YAML text without comments, notes and its own name.

    Args:
        text: the file's.
        source: names it in errors.
        name: instead of its own.

    Raises:
        InputError: the text is not YAML.
    """

    def walk(node: Any) -> Any:  # noqa: ANN401 - any YAML
        if isinstance(node, list):
            return [walk(each) for each in node]
        if not isinstance(node, dict):
            return node
        left_out = {"note"} if "provenance" in node else set()
        return {key: walk(value) for key, value in node.items() if key not in left_out}

    content = walk(parse_yaml(text, source))
    content.pop("description", None)
    return dump_yaml(content | {"name": name})


def _described(reader: Recording, source: str) -> _Described:
    """Return what the copy carries: of files, those that the run read."""
    kept = {}
    carried = reader.attachments
    if TESTBED in carried:
        text = carried[TESTBED].decode(errors="replace")
        kept[TESTBED] = without_names(text, source, MACHINE).encode()
    with suppress(InputError):
        bundle = read_bundle(carried, source)
        text = carried[SCENARIO].decode(errors="replace")
        kept[SCENARIO] = without_names(text, source, RUN).encode()
        kept |= bundle.files
    record = reader.metadata.get(RECORD_NAME, {})
    return _Described(kept, {key: record[key] for key in _KEPT if key in record})


def _append(writer: RecordingWriter, rows: Mapping[str, Rows]) -> None:
    """Append messages in the order in which they were recorded."""
    appends = [writer.channel(name).append for name in rows]
    each = list(rows.values())
    streams = [
        zip(of.log_ns.tolist(), repeat(at), range(len(of.log_ns)), strict=False)
        for at, of in enumerate(each)
    ]
    for log_ns, at, i in merge(*streams):
        appends[at](log_ns, int(each[at].stamp_ns[i]), each[at].rows[i])
