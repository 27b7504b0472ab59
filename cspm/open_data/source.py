"""What is known of published recordings: where, whose, under which licence, and their hashes."""

from __future__ import annotations

from pathlib import Path
from typing import Literal
from urllib.parse import quote

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed_keys.near_name import allowed_names
from cspm_msgs_py.yaml_file import StrictModel, read_yaml

HERE = Path(__file__).resolve().parent
MACHINES = HERE / "machines"
_LIST = HERE / "sources.yaml"


class PublishedFile(StrictModel):
    """A file of the publisher.

    Attributes:
        path: in the publisher's repository.
        bytes: its size.
        sha256: of its content, hexadecimal.
    """

    path: str
    bytes: int
    sha256: str


class Table(StrictModel):
    """A table that `cspm import` reads.

    Attributes:
        name: of its file.
        source: path of the published file that it is made of.
        make: how; see `cspm.open_data.tables`.
        axis: of a robot, from 1 on; 0 where there is none.
        sha256: of the table as it was made before.
    """

    name: str
    source: str
    make: Literal["as_it_is", "kuka_axis", "kite_winch"]
    axis: int = 0
    sha256: str


class Machine(StrictModel):
    """Test-bed files and a mapping of this project, and the tables that they are for.

    Attributes:
        testbed: as a newcomer writes it.
        known: with all terms that are known.
        mapping: of the tables.
        tables: of the same machine, independent runs.
    """

    testbed: str
    known: str
    mapping: str
    tables: list[str]


class Source(StrictModel):
    """Published recordings.

    Attributes:
        title: what they are of.
        folder: what their folder is called.
        repository, commit: where they are published.
        licence: SPDX identifier.
        licence_file: path of its text.
        citation: whose they are.
        files: what is downloaded.
        tables: what is made of it.
        machines: what belongs to the tables.
    """

    title: str
    folder: str
    repository: str
    commit: str
    licence: str
    licence_file: str
    citation: str
    files: list[PublishedFile]
    tables: list[Table]
    machines: list[Machine]

    def address(self, file: PublishedFile, server: str) -> str:
        """Return the address of a file on a server that is laid out as the publisher's."""
        return f"{server.rstrip('/')}/{self.repository}/{self.commit}/{quote(file.path)}"

    @property
    def size(self) -> int:
        """Bytes to download."""
        return sum(file.bytes for file in self.files)


def sources() -> dict[str, Source]:
    """Return all published recordings by name."""
    return {name: Source.model_validate(each) for name, each in read_yaml(_LIST).items()}


def source_of(name: str) -> Source:
    """Return the published recordings of a name.

    Raises:
        InputError: there are none; the line lists those that there are.
    """
    known = sources()
    if name not in known:
        raise InputError(f"{name}: no such recordings, {allowed_names(name, known)}")
    return known[name]
