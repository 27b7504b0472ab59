"""The parts that a `diagnosis.json` points at, and when they show."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from cspm_ident.diagnosis.reporting.machine_part import Kind, Part, parts_of
from cspm_ident.diagnosis_file import FindingPart, read_diagnosis
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed
from cspm_sim.effects import catalogue

_KINDS = {"winch": Kind.WINCH, "cable": Kind.CABLE}


@dataclass(frozen=True)
class Mark:
    """A part to point at.

    Attributes:
        kind: of part, as in `machine_part`.
        element: its cable or body.
        words: its name in words.
        statement: what is found there, in a sentence.
        at: when it shows [s from the recording's start]; None where that is not known.
    """

    kind: str
    element: str
    words: str
    statement: str
    at: float | None

    def data(self) -> dict[str, Any]:
        """Return it as plain data."""
        return asdict(self)


def read_marks(path: Path, machine: Testbed, recording: str) -> tuple[Mark, ...]:
    """Return what a diagnosis points at in a machine, the most important first.

    Args:
        path: a `diagnosis.json`, or the folder that `cspm diagnose --out` wrote.
        machine: whose parts are named.
        recording: name of the recording that is shown; a time counts for its own recording only.

    Raises:
        InputError: it cannot be read, is no diagnosis, or is one of another machine.
    """
    findings = read_diagnosis(path).findings
    marks = tuple(mark for each in findings for mark in _marks(each, machine, recording))
    known = {*machine.cable_names, "bar", "winch_frame"}
    strange = next((mark.element for mark in marks if mark.element not in known), None)
    if strange is not None:
        allowed = ", ".join(sorted(known))
        raise InputError(f"{path}: about {strange}, allowed on this machine: {allowed}")
    return marks


def _marks(finding: FindingPart, machine: Testbed, recording: str) -> Iterable[Mark]:
    when, shown = finding.onset_s, finding.shows_at
    if when is None and shown is not None and Path(shown.recording).resolve().name == recording:
        when = shown.time_s
    for element in finding.elements:
        for part in _parts(finding, element, machine):
            yield Mark(part.kind.value, part.element, part.words, finding.statement, when)


def _parts(finding: FindingPart, element: str, machine: Testbed) -> Iterable[Part]:
    effect = catalogue().get(finding.effect)
    if effect is not None:
        return parts_of(effect, element, machine.cable_names)
    return [Part(_KINDS.get(finding.subsystem, Kind.BODY), element)]
