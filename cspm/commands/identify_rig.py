"""What both identifications of single cables share: what is asked for, read and written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from cspm_ident.fitted_testbed import FittedNumber, with_fitted
from cspm_ident.rig.specimen import Specimen, read_specimens, recorded_testbed, with_stiffness
from cspm_msgs_py.new_folder import refuse_existing
from cspm_msgs_py.testbed import TestbedFile, load_testbed

FITTED = "fitted_testbed.yaml"


@dataclass(frozen=True)
class RigRequest:
    """What was asked for on the command line.

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
    testbed: Path | None
    cables: tuple[str, ...]
    verify: tuple[str, ...]
    stiffness: Path | None
    into: Path | None
    into_cables: tuple[str, ...]
    cutoff: float | None
    out: Path | None

    def specimens(self) -> list[Specimen]:
        """Read what was recorded.

        Raises:
            InputError: the folder to write to exists, or see `read_specimens`.
        """
        refuse_existing(self.out)
        given = load_testbed(self.testbed) if self.testbed else None
        found = read_specimens(self.recordings, given, self.cables)
        return with_stiffness(found, load_testbed(self.stiffness)) if self.stiffness else found

    def _target(self) -> tuple[TestbedFile, str]:
        path = self.into or self.stiffness or self.testbed
        if path is not None:
            return load_testbed(path), str(path)
        return recorded_testbed(self.recordings[0]), str(self.recordings[0])

    def write_fitted(
        self,
        folder: Path,
        specimens: Sequence[Specimen],
        block: str,
        numbers: Mapping[str, FittedNumber | float | str],
    ) -> Path:
        """Write the test-bed file with the law in every cable of the kind; return its path.

        Raises:
            InputError: the file has no such cables.
        """
        target, source = self._target()
        names = self.into_cables or tuple(dict.fromkeys(one.cable.name for one in specimens))
        changed = with_fitted(target.text, source, {name: {block: numbers} for name in names})
        path = folder / FITTED
        path.write_text(changed.text, encoding="utf-8")
        return path


def provenance(
    specimens: Sequence[Specimen],
) -> tuple[tuple[str, ...], tuple[tuple[float, float], ...]]:
    """Return the recordings' SHA-256, and the window of time used of each."""
    windows = {one.sha256: one.window for one in specimens}
    return tuple(windows), tuple(windows.values())


def interval_text(value: float, interval: tuple[float, float], digits: int = 6) -> str:
    """Return a number and its interval as a table writes them."""
    low, high = (f"{end:.{digits}g}" for end in interval)
    return f"{value:.{digits}g} ({low} … {high})"
