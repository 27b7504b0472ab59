"""Downloading a file whose hash is known; what was cut off goes on where it was."""

from __future__ import annotations

import hashlib
import http.client
import os
import urllib.error
import urllib.request
from collections.abc import Callable
from pathlib import Path

from cspm.open_data.source import PublishedFile
from cspm_msgs_py.errors import CspmError, InputError

SERVER = "https://raw.githubusercontent.com"
_CHUNK = 1 << 16
_SILENT_S = 30.0
_PARTIAL, _BEYOND_THE_END = 206, 416


def cache_folder() -> Path:
    """Return where downloads are kept: `$XDG_CACHE_HOME/cspm/data`, otherwise below `~/.cache`."""
    given = os.environ.get("XDG_CACHE_HOME")
    return (Path(given) if given else Path.home() / ".cache") / "cspm" / "data"


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file, hexadecimal."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(_CHUNK):
            digest.update(block)
    return digest.hexdigest()


def downloaded(
    file: PublishedFile, address: str, tell: Callable[[int], None] = lambda count: None
) -> Path:
    """Return a published file in the cache, downloaded unless it is there.

    Args:
        file: which, with its hash.
        address: where it is.
        tell: called with the bytes that are there so far.

    Raises:
        CspmError: nobody answers, or the answer ends early; what came is kept.
        InputError: the publisher has another file there.
    """
    place = cache_folder() / file.sha256
    if place.is_file() and sha256_of(place) == file.sha256:
        tell(file.bytes)
        return place
    part = place.with_suffix(".part")
    part.parent.mkdir(parents=True, exist_ok=True)
    if part.is_file() and part.stat().st_size >= file.bytes:
        part.unlink()
    try:
        _fetch(address, part, file.bytes, tell)
    except (OSError, http.client.HTTPException) as err:
        raise CspmError(
            f"{address}: {_reason(err)}; what came is kept and the same command goes on from there,"
            " or --from DIR, a folder that has the files"
        ) from None
    found = sha256_of(part)
    if found != file.sha256:
        part.unlink()
        raise InputError(f"{address}: SHA-256 {found}, allowed: {file.sha256}")
    part.replace(place)
    return place


def _fetch(address: str, part: Path, size: int, tell: Callable[[int], None]) -> None:
    """Append to a file what it lacks; begin anew where the server cannot leave out a beginning."""
    there = part.stat().st_size if part.is_file() else 0
    request = urllib.request.Request(address, headers={"User-Agent": "cspm"})
    if there:
        request.add_header("Range", f"bytes={there}-")
    try:
        answer = urllib.request.urlopen(request, timeout=_SILENT_S)
    except urllib.error.HTTPError as err:
        # A refusal holds the connection, as an answer does.
        err.close()
        if there and err.code == _BEYOND_THE_END:
            part.unlink()
            _fetch(address, part, size, tell)
            return
        raise
    with answer:
        goes_on = there and answer.status == _PARTIAL
        done = there if goes_on else 0
        with part.open("ab" if goes_on else "wb") as file:
            # One byte more than expected is enough to see that it is another file.
            while done <= size and (block := answer.read(_CHUNK)):
                file.write(block)
                done += len(block)
                tell(done)
    if done < size:
        raise http.client.IncompleteRead(b"", size - done)


def _reason(err: Exception) -> str:
    if isinstance(err, http.client.IncompleteRead):
        return f"ended {err.expected} bytes early"
    if isinstance(err, urllib.error.HTTPError):
        return f"answers {err.code} {err.reason}"
    return f"no answer ({getattr(err, 'reason', None) or err})"
