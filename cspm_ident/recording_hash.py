"""SHA-256 by which a fitted number names its recording."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path

from cspm_msgs_py.recording.reader import mcap_paths

_PIECE = 1 << 20


def recording_sha256(path: Path) -> str:
    """Return the SHA-256 of a recording's MCAP files, one after the other.

    What lies beside them in the folder, a summary or a picture, is no part of the recording.

    Raises:
        InputError: the recording is missing or stored otherwise.
    """
    digest = sha256()
    for file in mcap_paths(path):
        with file.open("rb") as stream:
            while piece := stream.read(_PIECE):
                digest.update(piece)
    return digest.hexdigest()
