"""Records as fast as it can until it is killed; reports beforehand how far it is."""

import mmap
import struct
import sys
from pathlib import Path

import numpy as np
from recording_samples import ATTACHMENTS, METADATA, STEP_NS, TOPICS

from cspm_msgs_py.recording import RecordingWriter

NAMES = ("/clock", "/bar/pose", "/winches/state")


def main(folder: Path, progress: Path) -> None:
    with (
        progress.open("r+b") as file,
        mmap.mmap(file.fileno(), 8) as shared,
        RecordingWriter(folder, TOPICS, attachments=ATTACHMENTS, metadata=METADATA) as writer,
    ):
        channels = [(writer.channel(name), np.zeros(TOPICS[name].width)) for name in NAMES]
        for step in range(10**9):
            now = step * STEP_NS
            struct.pack_into("<q", shared, 0, now)
            for channel, row in channels:
                row[:] = step
                channel.append(now, now, row)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
