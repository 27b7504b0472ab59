"""An MCAP file as runs of messages, one for each chunk."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from cspm_msgs_py.bag.run import StoredChannel, StoredMessage, StoredRun
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording.chunk import ChunkPlace, Messages
from cspm_msgs_py.recording.mcap_file import McapFile
from cspm_msgs_py.recording.reader import message_counts, message_type

_SpanNs = tuple[int, int]


class McapRuns:
    """An MCAP file, closed by its writer or not, chunked or not; see `StoredFile`."""

    def __init__(self, path: Path, *, tolerant: bool = False) -> None:
        """Open the file.

        Args:
            path: the file.
            tolerant: leave chunks that cannot be read out, and list why in `faults`.

        Raises:
            InputError: it is not an MCAP file, or damaged; BareFileError if it holds nothing.
        """
        self.path = path
        self.faults: list[str] = []
        self._tolerant = tolerant
        self._file = McapFile(path)
        try:
            self._file.check_not_bare()
            if not self._file.complete:
                self.faults.append(
                    f"{path}: not closed by its writer, read as far as it goes; `cspm recover`"
                    " restores its index"
                )
            spans = self._spans()
            self.faults += self._file.left_out
            self.channels = _channels(self._file)
            self.runs = [
                StoredRun(*span, partial(self._read, place, span)) for place, span in spans
            ]
        except BaseException:
            self._file.close()
            raise

    def _spans(self) -> list[tuple[ChunkPlace, _SpanNs]]:
        """Return the chunks that hold messages with their first and last log times [ns]."""
        found, readable = [], []
        for place in self._file.chunks:
            try:
                span = self._file.span(place)
                self._file.times(place)
            except InputError as err:
                self._fault(err)
                continue
            readable.append(place)
            if span is not None:
                found.append((place, span))
        self._file.chunks = readable
        return found

    def _fault(self, err: InputError) -> None:
        if not self._tolerant:
            raise err
        self.faults.append(f"{err}: left out; `cspm recover` leaves it out as well")

    def _read(
        self, place: ChunkPlace, span: _SpanNs, channels: Collection[int], start_ns: int
    ) -> Iterator[StoredMessage]:
        index = self._file.index(place)
        if index is not None and index.keys().isdisjoint(channels):
            return
        try:
            messages = self._file.messages(place, index)
            logs = messages.prefixes["log"]
            if len(logs) and not span[0] <= logs.min() <= logs.max() <= span[1]:
                raise InputError(f"{self._where(place)}: holds other times than its head says")
        except InputError as err:
            self._fault(err)
            return
        chosen = _ordered(messages.select(channels), start_ns)
        yield from zip(
            chosen.logs.tolist(), chosen.channels.tolist(), chosen.payloads(), strict=True
        )

    def _where(self, place: ChunkPlace) -> str:
        return f"{self.path}: chunk at byte {place.record.offset}"

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _channels(file: McapFile) -> list[StoredChannel]:
    counts = message_counts(file)
    channels = []
    for channel in file.admitted:
        schema = file.schemas.get(channel.schema_id)
        channels.append(
            StoredChannel(
                id=channel.id,
                topic=channel.topic,
                ros_type=message_type(file, channel),
                count=counts[channel.id],
                encoding=channel.message_encoding,
                schema_encoding=schema.encoding if schema else "",
                definition=schema.data.decode("utf-8", errors="replace") if schema else "",
            )
        )
    return channels


def _ordered(messages: Messages, start_ns: int) -> Messages:
    """Return the messages not before `start_ns` [ns] in order of log time, else as they stand."""
    logs = messages.logs
    order = np.flatnonzero(logs >= start_ns)
    if (np.diff(logs[order]) < 0).any():
        order = order[np.argsort(logs[order], kind="stable")]
    elif len(order) == len(messages):
        return messages
    return Messages(messages.content, messages.offsets[order], messages.prefixes[order])
