"""Recordings for tests: every topic of the contract, filled with seeded numbers."""

from pathlib import Path

import numpy as np

from cspm_msgs_py.diagnostics import Level, encode_diagnostics
from cspm_msgs_py.recording import RecordingWriter
from cspm_msgs_py.topics import DIAGNOSTICS, Topic, contract_topics

CABLES = ["hoist_1", "surge_1", "sway_1"]
TOPICS = contract_topics(CABLES, has_bar=True, has_winch_frame=True)
ROW_TOPICS = {name: topic for name, topic in TOPICS.items() if name != DIAGNOSTICS.name}
ATTACHMENTS = {"scenario.yaml": b"name: calm\n", "testbed.yaml": "name: Prüfstand\n".encode()}
METADATA = {"seed": "7", "scenario": "calm"}
STEP_NS = 1_000_000


def numbers(topic: Topic, steps: int, seed: int = 0) -> np.ndarray:
    """Rows of a topic, shape (steps, width)."""
    rng = np.random.default_rng([seed, *topic.name.encode()])
    return np.cumsum(rng.normal(size=(steps, topic.width)), axis=0)


def write_sample(
    folder: Path,
    steps: int = 200,
    *,
    topics: dict[str, Topic] = TOPICS,
    seed: int = 0,
    change=None,
    start_ns: int = 0,
    block_ns: int = 50_000_000,
) -> dict[str, np.ndarray]:
    """Write `steps` messages per topic at 1 kHz, and a diagnostic every 10; return the rows.

    `change(name, step, row)` may return another row, or None to leave the message out.
    """
    rows = {name: numbers(topic, steps, seed) for name, topic in topics.items()}
    rows.pop(DIAGNOSTICS.name, None)
    with RecordingWriter(
        folder, topics, attachments=ATTACHMENTS, metadata=METADATA, block_ns=block_ns
    ) as writer:
        channels = {name: writer.channel(name) for name in rows}
        for step in range(steps):
            now = start_ns + step * STEP_NS
            for name, channel in channels.items():
                row = rows[name][step]
                row = row if change is None else change(name, step, row)
                if row is not None:
                    channel.append(now, now - 500, row)
            if step % 10 == 0 and DIAGNOSTICS.name in topics:
                status = [(Level.WARN, "cables/sway_1", "slack", {"step": str(step)})]
                writer.append_payload(DIAGNOSTICS.name, now, encode_diagnostics(now, status))
    return rows
