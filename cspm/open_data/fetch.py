"""A folder of published recordings: tables, licence, citation, test-bed files and mappings."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from cspm.open_data.download import SERVER, downloaded, sha256_of
from cspm.open_data.source import MACHINES, PublishedFile, Source
from cspm.open_data.tables import make_table
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.yaml_file import dump_yaml, read_yaml

ABOUT = "source.yaml"

Tell = Callable[[float], None]


def fetch(
    name: str,
    source: Source,
    folder: Path,
    there: Path | None = None,
    tell: Tell = lambda share: None,
    mirror: str | None = None,
) -> bool:
    """Make the folder of published recordings; return whether it was there already.

    Args:
        name: of the recordings.
        source: what is known of them.
        folder: to make; it is there whole or not at all.
        there: a folder with the publisher's files, or with tables made of them; None: download.
        tell: called with the share that is done.
        mirror: a server laid out as the publisher's, in its place.

    Raises:
        InputError: something else is in the folder, or `there` lacks a file.
        CspmError: a download failed.
    """
    about = _about(source)
    if folder.exists():
        if not _is_whole(folder, source, about):
            raise InputError(f"{folder}: already exists, allowed: a new folder, or that of {name}")
        return True
    found = _local(there, source) if there is not None else _from(mirror or SERVER, source, tell)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent) as room:
        part = Path(room) / folder.name
        part.mkdir()
        for table in source.tables:
            if table.name in found:
                shutil.copyfile(found[table.name], part / table.name)
            else:
                make_table(table, found[table.source], part / table.name)
        shutil.copyfile(found[source.licence_file], part / Path(source.licence_file).name)
        for file in (MACHINES / name).iterdir():
            shutil.copyfile(file, part / file.name)
        (part / ABOUT).write_text(dump_yaml(about), encoding="utf-8")
        part.replace(folder)
    return False


def _about(source: Source) -> dict[str, Any]:
    """Return whose the recordings are, as it is stored beside them."""
    return {
        "title": source.title,
        "publisher": f"https://github.com/{source.repository}",
        "commit": source.commit,
        "licence": source.licence,
        "licence_text": Path(source.licence_file).name,
        "citation": source.citation,
        "files": {file.path: file.sha256 for file in source.files},
    }


def _is_whole(folder: Path, source: Source, about: Mapping[str, Any]) -> bool:
    names = [Path(source.licence_file).name, *(table.name for table in source.tables)]
    whole = all((folder / name).is_file() for name in (ABOUT, *names))
    return whole and read_yaml(folder / ABOUT) == about


def _from(server: str, source: Source, tell: Tell) -> dict[str, Path]:
    """Return published files in the cache by path."""
    found, before = {}, 0
    for file in source.files:

        def show(count: int, before: int = before) -> None:
            tell((before + count) / source.size)

        found[file.path] = downloaded(file, source.address(file, server), show)
        before += file.bytes
    return found


def _local(there: Path, source: Source) -> dict[str, Path]:
    """Return published files by path, and tables by name, that a folder has.

    Raises:
        InputError: no such folder, or a file is in it in neither form.
    """
    if not there.is_dir():
        raise InputError(f"--from {there}: no such folder, allowed: one with the published files")
    found = {}
    for file in source.files:
        place = _having(there, Path(file.path).name, file.sha256)
        if place is not None:
            found[file.path] = place
    for table in source.tables:
        place = None if table.source in found else _having(there, table.name, table.sha256)
        if place is not None:
            found[table.name] = place
    lacking = [file for file in source.files if not _is_served(file, source, found)]
    if lacking:
        raise InputError(
            f"--from {there}: no {lacking[0].path} of SHA-256 {lacking[0].sha256}, allowed: the"
            " published files, or the tables of `cspm data get`, as they were"
        )
    return found


def _is_served(file: PublishedFile, source: Source, found: Mapping[str, Path]) -> bool:
    made = [table.name for table in source.tables if table.source == file.path]
    return file.path in found or (bool(made) and all(name in found for name in made))


def _having(there: Path, name: str, sha256: str) -> Path | None:
    """Return the file of a name and hash, at any depth."""
    places = (place for place in sorted(there.rglob(name)) if place.is_file())
    return next((place for place in places if sha256_of(place) == sha256), None)
