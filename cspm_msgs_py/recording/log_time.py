"""The latest log time that can be used; everything that reads leaves out what was logged later.

Only MCAP has room for such times, 64 bits without sign: a driver's negative time ends up there.
"""

from __future__ import annotations

from pathlib import Path

from cspm_msgs_py.recording.chunk import ChunkIndex, Messages, scan_messages
from cspm_msgs_py.recording.records import Opcode, spans_in

LATEST_NS = 2**63 - 1


def left_out(path: Path, count: int) -> list[str]:
    """Return the line that says how many messages are left out; none where none are."""
    messages = "1 message" if count == 1 else f"{count} messages"
    return [f"{path}: {messages} logged later than {LATEST_NS} ns left out"] if count else []


def index_in_time(index: ChunkIndex) -> ChunkIndex:
    """Return an index without the messages that are left out."""
    return {channel: table[table[:, 0] <= LATEST_NS] for channel, table in index.items()}


def in_time(messages: Messages) -> Messages:
    """Return a chunk's messages but those that are left out; the content holds them still."""
    kept = messages.prefixes["log"] <= LATEST_NS
    if kept.all():
        return messages
    return Messages(messages.content, messages.offsets[kept], messages.prefixes[kept])


def rewritten(messages: Messages, where: str) -> Messages:
    """Return a chunk's messages with a content that holds no others; `where` names the chunk."""
    content, kept = messages.content, set(messages.offsets.tolist())
    spans = (s for s in spans_in(content) if s.opcode != Opcode.MESSAGE or s.offset in kept)
    return scan_messages(b"".join(content[s.offset : s.end] for s in spans), where)
