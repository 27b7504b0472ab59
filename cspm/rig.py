"""What both identifications of single cables share: what is requested, read and written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from cspm_ident.fitted_testbed import FittedNumber, with_fitted
from cspm_ident.rig.specimen import Specimen, read_specimens, recorded_testbed, with_stiffness
from cspm_msgs_py.new_folder import refuse_existing
from cspm_msgs_py.testbed import TestbedFile, load_testbed

FITTED = "fitted_testbed.yaml"
AnyFile: TypeAlias = Path | TestbedFile


@dataclass(frozen=True)
class RigRequest:
    """What is requested.

    Attributes:
        recordings: to identify from.
        testbed: the machine recorded, instead of what the recordings carry.
        cables: those to use; all where none is named.
        verify: labels of those that judge without being fitted.
        stiffness: a test-bed file whose stiffness laws to use instead of the machine's.
        into: the test-bed file that gets the law, instead of `stiffness` or the machine recorded.
        into_cables: the cables there that get it; those identified where none is named.
        cutoff: of the filter [Hz]; the identification's own where it is None.
        out: a new folder for pictures and the fitted test-bed; None writes nothing.
    """

    recordings: tuple[Path, ...]
    testbed: AnyFile | None
    cables: tuple[str, ...]
    verify: tuple[str, ...]
    stiffness: AnyFile | None
    into: AnyFile | None
    into_cables: tuple[str, ...]
    cutoff: float | None
    out: Path | None

    def specimens(self) -> list[Specimen]:
        """Read what was recorded.

        Raises:
            InputError: the folder to write to exists, or see `read_specimens`.
        """
        refuse_existing(self.out)
        given = None if self.testbed is None else _file(self.testbed)
        found = read_specimens(self.recordings, given, self.cables)
        return found if self.stiffness is None else with_stiffness(found, _file(self.stiffness))

    def _target(self) -> tuple[TestbedFile, str]:
        given = self.into or self.stiffness or self.testbed
        if given is not None:
            return _file(given), _file(given).source
        return recorded_testbed(self.recordings[0]), str(self.recordings[0])

    def fitted(
        self,
        specimens: Sequence[Specimen],
        block: str,
        numbers: Mapping[str, FittedNumber | float | str],
    ) -> TestbedFile:
        """Return the test-bed file with the law in every cable of the kind.

        Raises:
            InputError: the file has no such cables.
        """
        target, source = self._target()
        names = self.into_cables or tuple(dict.fromkeys(one.cable.name for one in specimens))
        return with_fitted(target.text, source, {name: {block: numbers} for name in names})


def _file(given: AnyFile) -> TestbedFile:
    return load_testbed(given) if isinstance(given, Path) else given


def provenance(
    specimens: Sequence[Specimen],
) -> tuple[tuple[str, ...], tuple[tuple[float, float], ...]]:
    """Return the recordings' SHA-256, and the window of time used of each."""
    windows = {one.sha256: one.window for one in specimens}
    return tuple(windows), tuple(windows.values())
