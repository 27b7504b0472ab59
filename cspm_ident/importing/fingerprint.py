"""SHA-256 of what was imported."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path

from cspm_msgs_py.errors import InputError

_PIECE = 1 << 20


def fingerprint(path: Path) -> str:
    """Return the SHA-256 of a file; of a folder that of its files' names and contents, by name.

    Raises:
        InputError: something in it cannot be read.
    """
    digest = sha256()
    files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
    for file in files:
        if path.is_dir():
            digest.update(f"{file.relative_to(path)}\n".encode())
        try:
            with file.open("rb") as stream:
                while piece := stream.read(_PIECE):
                    digest.update(piece)
        except OSError as err:
            raise InputError(f"{file}: unreadable ({err.strerror})") from None
    return digest.hexdigest()
