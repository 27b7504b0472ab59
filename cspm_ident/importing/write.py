"""Messages of an import, written as a contract recording."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from cspm_ident.importing.sources.source import Progress
from cspm_ident.importing.topic_messages import TopicMessages
from cspm_msgs_py.recording import RecordingWriter

PIECE = 20_000  # messages of a topic at once


def write_messages(
    folder: Path,
    messages: Mapping[str, TopicMessages],
    attachments: Mapping[str, bytes],
    metadata: Mapping[str, str],
    progress: Progress,
) -> dict[str, int]:
    """Write a recording, whole or not at all, and return its number of messages by topic.

    Log time is the stamp: when a message arrived is not known.

    Args:
        folder: a new folder.
        messages: by topic.
        attachments: files to keep in it.
        metadata: its record.
        progress: called with the share that was written.

    Raises:
        InputError: the folder exists or cannot be created.
        CspmError: writing failed.
    """
    topics = {name: one.topic for name, one in messages.items()}
    writer = RecordingWriter(folder, topics, attachments=attachments, metadata=metadata)
    try:
        with writer:
            _append(writer, messages, progress)
    except BaseException:
        shutil.rmtree(writer.folder, ignore_errors=True)
        raise
    return writer.counts


def _append(
    writer: RecordingWriter, messages: Mapping[str, TopicMessages], progress: Progress
) -> None:
    """Append all messages in order of stamps, a piece at a time."""
    appends = [writer.channel(name).append for name in messages]
    each = list(messages.values())
    places = [0] * len(each)
    total = sum(len(one.stamp_ns) for one in each)
    while pieces := [
        one.stamp_ns[place : place + PIECE]
        for one, place in zip(each, places, strict=True)
        if place < len(one.stamp_ns)
    ]:
        until = min(int(piece.max()) for piece in pieces)
        ends = [_end(one, place, until) for one, place in zip(each, places, strict=True)]
        slices = [slice(place, end) for place, end in zip(places, ends, strict=True)]
        stamps = np.concatenate([o.stamp_ns[s] for o, s in zip(each, slices, strict=True)])
        rows = [row for o, s in zip(each, slices, strict=True) for row in o.rows(s)]
        senders = np.repeat(np.arange(len(each)), np.subtract(ends, places))
        order = np.argsort(stamps, kind="stable")
        for sender, stamp, i in zip(
            senders[order].tolist(), stamps[order].tolist(), order.tolist(), strict=True
        ):
            appends[sender](stamp, stamp, rows[i])
        places = ends
        for one in each:
            one.release()
        progress(sum(places) / total)


def _end(messages: TopicMessages, start: int, until_ns: int) -> int:
    """Return where the messages from `start` on become later than an instant, PIECE at most."""
    stamps = messages.stamp_ns[start : start + PIECE]
    later = np.flatnonzero(stamps > until_ns)
    return start + (int(later[0]) if len(later) else len(stamps))
