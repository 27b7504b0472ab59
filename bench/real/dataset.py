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

    def imported(self, place: Path, work: Path) -> tuple[list[Path], list[Path]]:
        """Import the recordings into a folder; return those to search and those held out."""
        testbed = self._testbed(place, work)
        folders = []
        for file in (*self.search, *self.held_out):
            out = work / Path(file).stem
            mapping = _file(place, self.mapping)
            cspm.import_recording(place / file, out, mapping=mapping, testbed=testbed)
            folders.append(out)
        return folders[: len(self.search)], folders[len(self.search) :]

    def _testbed(self, place: Path, work: Path) -> Path:
        content: dict[str, Any] = yaml.safe_load(_file(place, self.testbed).read_text("utf-8"))
        kept = [each for each in content.get("effects", ()) if each["effect"] not in self.without]
        content["effects"] = kept
        path = work / "testbed.yaml"
        path.write_text(dump_yaml(content), "utf-8")
        return path


def datasets() -> list[Dataset]:
    """Return all data sets of `datasets.yaml`."""
    content = yaml.safe_load((HERE / "datasets.yaml").read_text("utf-8"))
    return [Dataset(**each) for each in content]


def _file(place: Path, name: str) -> Path:
    return REPOSITORY / name.removeprefix(_OURS) if name.startswith(_OURS) else place / name
