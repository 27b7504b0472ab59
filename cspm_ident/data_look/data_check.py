"""One thing that was looked at in a recording before any model."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

Stretch = tuple[float, float]


class DataCheck(NamedTuple):
    """What a check found in a recording.

    Attributes:
        check: its name.
        recording: path.
        ok: whether there is nothing that may mislead.
        what: in words, with numbers.
        remedy: what to do about it; empty where all is well.
        stretches: begin and end of what does not belong to the rest [s]; only of such checks.
    """

    check: str
    recording: Path
    ok: bool
    what: str
    remedy: str = ""
    stretches: tuple[Stretch, ...] = ()

    @property
    def text(self) -> str:
        """One line: recording, what was found and what to do."""
        return f"{self.recording.name}: {self.what}" + (f"; {self.remedy}" if self.remedy else "")

    def data(self) -> dict[str, Any]:
        """Return it as plain data for JSON."""
        stretches = [list(each) for each in self.stretches]
        return {**self._asdict(), "recording": str(self.recording), "stretches": stretches}


def check_of(check: str, recording: Path, found: list[str], well: str, remedy: str) -> DataCheck:
    """Return a check that is well where nothing was found."""
    if not found:
        return DataCheck(check, recording, True, well)
    return DataCheck(check, recording, False, ", ".join(found), remedy)
