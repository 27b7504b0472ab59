"""A published recording of another laboratory, and what is true of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import yaml

import cspm
from cspm_msgs_py.yaml_file import dump_yaml

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parents[1]
_OURS = "repository:"
SEARCH, HELD_OUT = "search", "held_out"

Range = tuple[float, float]


class Dataset(NamedTuple):
    """A data set and its truth.

    Attributes:
        name: for the table.
        source: who published it.
        folder: its folder's name.
        mapping, testbed: files in the folder, or after `repository:` of this project.
        without: effects to take out of the test-bed file.
        search, held_out: recordings.
        truth: effects that the described machine lacks, each with the known ranges of parameters.
        plausible: effects that these recordings cannot separate from the truth.
        known: how the truth is known.
    """

    name: str
    source: str
    folder: str
    mapping: str
    testbed: str
    search: Sequence[str]
    truth: Mapping[str, Mapping[str, Range]]
    known: str
    held_out: Sequence[str] = ()
    plausible: Sequence[str] = ()
    without: Sequence[str] = ()

    def place(self, roots: Sequence[Path]) -> Path | None:
        """Return the data set's folder below one of the roots; None where none has it."""
        found = (root / self.folder for root in roots)
        return next((each for each in found if each.is_dir()), None)

    def imported(
        self,
        place: Path,
        work: Path,
        tables: Path | None = None,
        description: Mapping[str, Any] | None = None,
    ) -> tuple[list[Path], list[Path]]:
        """Import the recordings into a folder; return those to search and those held out.

        Args:
            place: the data set's folder.
            work: a folder.
            tables: where the recordings are; None: in the data set's folder.
            description: contents of another test-bed file.
        """
        testbed, mapping = work / "testbed.yaml", _file(place, self.mapping)
        testbed.write_text(dump_yaml(description or self.description(place)), "utf-8")
        found = []
        for role, files in ((SEARCH, self.search), (HELD_OUT, self.held_out)):
            folders = [work / role / Path(file).stem for file in files]
            for file, out in zip(files, folders, strict=True):
                table = (tables or place) / file
                cspm.import_recording(table, out, mapping=mapping, testbed=testbed)
            found.append(folders)
        return found[0], found[1]

    def description(self, place: Path) -> dict[str, Any]:
        """Return the contents of the test-bed file."""
        content: dict[str, Any] = yaml.safe_load(_file(place, self.testbed).read_text("utf-8"))
        kept = [each for each in content.get("effects", ()) if each["effect"] not in self.without]
        return content | {"effects": kept}


def datasets() -> list[Dataset]:
    """Return all data sets of `datasets.yaml`."""
    content = yaml.safe_load((HERE / "datasets.yaml").read_text("utf-8"))
    return [Dataset(**each) for each in content]


def _file(place: Path, name: str) -> Path:
    return REPOSITORY / name.removeprefix(_OURS) if name.startswith(_OURS) else place / name
