"""Recording while a loop runs: blocks of log time go to a thread that writes them as chunks.

How much a killed process loses follows from the structure: one block being filled, one waiting and
one being written. With blocks of 0.05 s that is at most 0.15 s of log time.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from queue import SimpleQueue
from types import TracebackType

import zstandard
from mcap.records import Attachment, Header, Metadata, Schema
from mcap.records import Channel as ChannelRecord
from typing_extensions import Self

from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.layout import Layout, layout_of
from cspm_msgs_py.message import carries_row
from cspm_msgs_py.recording.block import Batch, BlockPart, compress, merge
from cspm_msgs_py.recording.channel_buffer import ChannelBuffer
from cspm_msgs_py.recording.derived import Derived
from cspm_msgs_py.recording.mcap_file import REFUSED, REFUSED_ROOT
from cspm_msgs_py.recording.rosbag2_metadata import (
    ROS_DISTRO,
    FileEntry,
    TopicEntry,
    contract_qos,
    write_metadata,
)
from cspm_msgs_py.recording.sink import McapSink
from cspm_msgs_py.ros_types import MESSAGE_ENCODING, SCHEMA_ENCODING, definition, type_hash
from cspm_msgs_py.topics import Topic
from cspm_msgs_py.yaml_file import dump_yaml

BLOCK_NS = 50_000_000
METADATA_NAME = "cspm"
_BLOCKS_UNDERWAY = 2
_COMPRESSION_LEVEL = -1
_Block = list[Batch]


class RecordingWriter:
    """Writes one recording: a rosbag2 folder with an MCAP file.

    Append from one thread only. Leaving the context closes the recording, also on an exception;
    the process may be killed at any time, see `cspm_msgs_py.recording.recover`.
    """

    def __init__(
        self,
        folder: Path,
        topics: Mapping[str, Topic],
        *,
        attachments: Mapping[str, bytes],
        metadata: Mapping[str, str],
        block_ns: int = BLOCK_NS,
        derived: Derived | None = None,
    ) -> None:
        """Create the folder and the head of the file.

        Args:
            folder: a new folder; its name becomes the recording's.
            topics: every topic that may be recorded, by name.
            attachments: files to keep in the recording, by name.
            metadata: the record named `cspm`.
            block_ns: log time per chunk [ns].
            derived: makes more messages of each block.

        Raises:
            InputError: the folder exists or cannot be created, or a topic's type is unknown.
        """
        # Compiled before the first block; those who only read need not wait for numba.
        from cspm_msgs_py.recording.row_kernel import place_rows

        self._place_rows = place_rows
        self.folder = folder = Path(folder).absolute()
        self.path = folder / f"{folder.name}_0.mcap"
        self._derived = derived
        self._topics = [*topics.values(), *(derived.topics.values() if derived else ())]
        self._hashes = [type_hash(topic.ros_type) for topic in self._topics]
        self._layouts = [_layout(topic) for topic in self._topics]
        self._block_ns = block_ns
        self._channels = [ChannelBuffer(topic.name, self._turn) for topic in self._topics]
        self._by_name = {channel.name: channel for channel in self._channels}
        self._refused: dict[str, ChannelBuffer] = {}
        self._counts = [0] * len(self._topics)
        try:
            folder.mkdir(parents=True)
            self._sink = McapSink(self.path, Header("ros2", f"cspm {version('cspm')}"))
            self._write_head(attachments, metadata)
            self._write_metadata()
        except FileExistsError:
            raise InputError(f"{folder}: already exists, allowed: a new folder") from None
        except OSError as err:
            raise InputError(f"{folder}: cannot be written ({err.strerror})") from None
        self._room = threading.Semaphore(_BLOCKS_UNDERWAY)
        self._blocks: SimpleQueue[_Block | None] = SimpleQueue()
        self._failure: str | None = None
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="recording", daemon=True)
        self._thread.start()

    def takes(self, name: str) -> bool:
        """Return whether a topic was declared."""
        return name in self._by_name

    def channel(self, name: str) -> ChannelBuffer:
        """Return the channel of a topic; keep it, looking it up costs time.

        Raises:
            InputError: the topic was not declared or carries no row of numbers.
        """
        channel = self._declared(name)
        if self._layouts[self._channels.index(channel)] is None:
            raise InputError(f"{name}: carries no row of numbers, allowed: append_payload")
        return channel

    def append_payload(self, name: str, log_ns: int, payload: bytes) -> None:
        """Record a message of a topic without rows, such as `/diagnostics`, from its CDR bytes.

        Raises:
            InputError: the topic was not declared, or its messages are rows.
            CspmError: writing failed earlier.
        """
        channel = self._declared(name)
        if self._layouts[self._channels.index(channel)] is not None:
            raise InputError(f"{name}: carries a row of numbers, allowed: channel({name!r}).append")
        channel.append_payload(log_ns, payload)

    def append_refused(self, name: str, log_ns: int, payload: bytes) -> None:
        """Record a message as it came that nobody of the run obeyed, from its CDR bytes.

        It is on `/refused` and its topic's name: who plays the topic itself sends what was obeyed.

        Raises:
            InputError: the topic was not declared.
            CspmError: writing failed earlier.
        """
        channel = self._refused.get(name)
        if channel is None:
            like = self._channels.index(self._declared(name))
            topic = replace(self._topics[like], name=f"{REFUSED_ROOT}{name}")
            channel = self._refused[name] = ChannelBuffer(topic.name, self._turn)
            self._topics.append(topic)
            self._hashes.append(self._hashes[like])
            self._counts.append(0)
            self._layouts.append(None)
            self._channels.append(channel)
        channel.append_payload(log_ns, payload)

    def _declared(self, name: str) -> ChannelBuffer:
        try:
            return self._by_name[name]
        except KeyError:
            raise InputError(
                f"{name}: not a topic of this recording, allowed: {', '.join(self._by_name)}"
            ) from None

    @property
    def counts(self) -> dict[str, int]:
        """Messages written by topic; complete once the recording is closed."""
        return dict(zip(self._by_name, self._counts, strict=False))

    def _turn(self, log_ns: int) -> None:
        """Hand the filled block to the thread and begin the one that holds `log_ns`."""
        if self._closed:
            raise CspmError(f"{self.path}: the recording is closed")
        # Waiting comes first: an interrupt while waiting leaves the block being filled as it is.
        self._room.acquire()
        if self._failure is not None:
            self._room.release()
            self._raise_failure()
        end = (log_ns // self._block_ns + 1) * self._block_ns
        self._blocks.put([channel.take(end) for channel in self._channels])

    def _raise_failure(self) -> None:
        if self._failure is not None:
            raise CspmError(f"{self.path}: recording failed ({self._failure})")

    def _run(self) -> None:
        compressor = zstandard.ZstdCompressor(level=_COMPRESSION_LEVEL)
        while (block := self._blocks.get()) is not None:
            if self._failure is None:
                try:
                    self._write_block(block, compressor)
                except InputError as err:
                    self._failure = str(err)
                except OSError as err:
                    self._failure = err.strerror or str(err)
                except Exception as err:
                    self._failure = repr(err)
            self._room.release()

    def _write_block(self, block: _Block, compressor: zstandard.ZstdCompressor) -> None:
        for i in range(self._announced, len(block)):
            self._add_channel(i, {REFUSED: "true"})
        if self._derived is not None:
            self._derive(self._derived, block)
        parts = [
            BlockPart(i + 1, self._topics[i].name, self._counts[i], batch, self._layouts[i])
            for i, batch in enumerate(block)
            if batch.logs
        ]
        if parts:
            content, index = merge(parts, self._place_rows)
            self._sink.add_chunk(compress(content, index, compressor), index)
            for part in parts:
                self._counts[part.channel - 1] += len(part.batch.logs)

    def _derive(self, derived: Derived, block: _Block) -> None:
        """Add to a block what follows from it."""
        # Messages that were refused have channels behind these.
        of_topic = dict(zip(self._by_name, block, strict=False))
        for name, log_ns, payload in derived.of(of_topic):
            of_topic[name].logs.append(log_ns)
            of_topic[name].contents.append(payload)

    def close(self) -> None:
        """Write what is left, the index and the counts; a second call does nothing.

        Raises:
            CspmError: writing failed; what was written before can be recovered.
        """
        if self._closed:
            return
        self._closed = True
        self._blocks.put([channel.take(-1) for channel in self._channels])
        self._blocks.put(None)
        self._thread.join()
        try:
            if self._failure is None:
                self._sink.finish()
                self._write_metadata()
        except OSError as err:
            self._failure = err.strerror or str(err)
        finally:
            self._sink.close()
        self._raise_failure()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            self.close()
        except CspmError:
            # What ended the block matters more than that its recording could not be closed.
            if error is None:
                raise

    def _write_head(self, attachments: Mapping[str, bytes], metadata: Mapping[str, str]) -> None:
        """Write all that a killed file must not lose before the first message."""
        self._sink.add_metadata(Metadata("rosbag2", {"ROS_DISTRO": ROS_DISTRO}))
        self._sink.add_metadata(Metadata(METADATA_NAME, dict(metadata)))
        for name, content in attachments.items():
            self._sink.add_attachment(Attachment(0, 0, name, "application/yaml", bytes(content)))
        types = list(dict.fromkeys(topic.ros_type for topic in self._topics))
        for i, ros_type in enumerate(types):
            text = definition(ros_type).encode()
            self._sink.add_schema(Schema(i + 1, text, SCHEMA_ENCODING, ros_type))
        for i in range(len(self._topics)):
            self._add_channel(i, {})

    def _add_channel(self, i: int, about: Mapping[str, str]) -> None:
        """Describe channel `i`, counted from 0, before its first message."""
        topic, types = self._topics[i], [topic.ros_type for topic in self._topics]
        qos = dump_yaml(contract_qos(latched=topic.latched))
        known = {"offered_qos_profiles": qos, "topic_type_hash": self._hashes[i], **about}
        schema = list(dict.fromkeys(types)).index(topic.ros_type) + 1
        self._sink.add_channel(ChannelRecord(i + 1, topic.name, MESSAGE_ENCODING, known, schema))
        self._announced = i + 1

    def _write_metadata(self) -> None:
        described = zip(self._topics, self._hashes, self._counts, strict=True)
        entries = [
            TopicEntry(
                topic.name, topic.ros_type, found, contract_qos(latched=topic.latched), count
            )
            for topic, found, count in described
        ]
        first, last = self._sink.span_ns
        write_metadata(
            self.folder, entries, [FileEntry(self.path.name, first, last, sum(self._counts))]
        )


def _layout(topic: Topic) -> Layout | None:
    """Return the layout of a topic's rows; None where it carries none."""
    return layout_of(topic) if carries_row(topic.ros_type) else None
