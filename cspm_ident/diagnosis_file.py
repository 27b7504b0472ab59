"""The file `diagnosis.json`: what a reader may count on."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.yaml_file import validate

Version = Literal["cspm.diagnosis/1"]
(SCHEMA,) = get_args(Version)
# What a folder of a diagnosis holds.
REPORT, IMPROVED = "diagnosis.json", "testbed.improved.yaml"
Interval = tuple[float, float]


class _Part(BaseModel):
    """Base of all parts: a later version may add keys."""

    model_config = ConfigDict(frozen=True, extra="allow")


class RecordingPart(_Part):
    """A recording that was used, and what for."""

    path: str
    sha256: str
    role: Literal["search", "held_out"]
    complete: bool = True


class TestbedPart(_Part):
    """The machine that the recordings are compared with."""

    path: str
    sha256: str


class ParameterPart(_Part):
    """A number of a finding, with the interval that holds it with 95 % probability."""

    name: str
    value: float
    unit: str
    ci95: Interval | None
    element: str = ""


class AlternativePart(_Part):
    """What explains the data as well; `separating_experiment` is a scenario's file."""

    effect: str
    elements: tuple[str, ...]
    probability: float
    separating_experiment: str | None
    beside: str | None = None


class ShownPart(_Part):
    """Where a finding shows best: a recording, and the time [s] from its start."""

    recording: str
    time_s: float


class TrackedPart(_Part):
    """How well the bar follows its reference: RMS of the distance [m] and the rotation [rad]."""

    position_m: float
    angle_rad: float


class ConsequencePart(_Part):
    """What a finding costs in tracking error; `with` and `without` it."""

    with_: TrackedPart = Field(alias="with")
    without: TrackedPart


class ConsideredPart(_Part):
    """What was considered and is not named, with the reason and its numbers."""

    effect: str
    elements: tuple[str, ...]
    reason: str
    parameters: tuple[ParameterPart, ...]


class CalibratedPart(_Part):
    """A number of the file that is off by no more than its accuracy, one standard deviation."""

    effect: str
    element: str
    name: str
    value: float
    unit: str
    ci95: Interval | None
    accuracy: float


class ExtrapolatedPart(_Part):
    """A signal that held-out data take beyond what was searched, for a share of their rows."""

    place: str
    signal: str
    searched: Interval
    held_out: Interval
    share: float


class FindingPart(_Part):
    """Something that the described machine lacks; `effect` is `unknown` where nothing names it.

    `onset_s` is when it began [s], null where it was there from the start. `region` says where in
    the signals it shows, and is empty where it does everywhere.
    """

    subsystem: Literal["winch", "cable", "bar", "frame", "sensor"]
    elements: tuple[str, ...]
    effect: str
    probability: float | None
    statement: str
    onset_s: float | None
    region: dict[str, Any]
    parameters: tuple[ParameterPart, ...]
    alternatives: tuple[AlternativePart, ...]
    onset_ci95_s: Interval | None = None
    shows_at: ShownPart | None = None
    presence: Literal["certain", "tied"] | None = None
    consequence: ConsequencePart | None = None


class NotExcitedPart(_Part):
    """An effect that the recordings cannot show."""

    effect: str
    elements: tuple[str, ...]
    separating_experiment: str | None = None


class ErrorsPart(_Part):
    """Errors on held-out data: RMS as a share of the measured standard deviation; VAF in %."""

    vaf_before: float
    vaf_after: float
    nrmse_before: float
    nrmse_after: float
    nrmse_retuned_nominal: float
    noise_floor: float


class FitPart(_Part):
    """How well a measured quantity is predicted, driven by measured torque, winch or tension."""

    channel: str
    drive: Literal["torque", "winch", "tension"]
    held_out: ErrorsPart


class LeftPart(_Part):
    """What is left of a quantity beyond its noise, in its unit, most from `from_s` to `to_s`."""

    place: str
    unit: str
    rms: float
    noise: float
    function_of: str | None
    from_s: float
    to_s: float


class DataCheckPart(_Part):
    """What was looked at in a recording before any model."""

    check: str
    recording: str
    ok: bool
    what: str
    remedy: str


class DiagnosisFile(_Part):
    """What `cspm diagnose` writes."""

    schema_: Version = Field(alias="schema")
    recordings: tuple[RecordingPart, ...]
    testbed: TestbedPart
    verdict: Literal["consistent", "effect", "parameter", "tie", "unknown", "not_excited"]
    findings: tuple[FindingPart, ...]
    not_excited: tuple[NotExcitedPart, ...]
    fit: tuple[FitPart, ...]
    model: str | None
    thresholds: dict[str, float] = {}
    explained: float | None = None
    left: tuple[LeftPart, ...] = ()
    considered: tuple[ConsideredPart, ...] = ()
    calibrated: tuple[CalibratedPart, ...] = ()
    extrapolated: tuple[ExtrapolatedPart, ...] = ()
    data_checks: tuple[DataCheckPart, ...] = ()


def read_diagnosis(path: Path) -> DiagnosisFile:
    """Read and check a `diagnosis.json`, or that of the folder that `cspm diagnose --out` wrote.

    Raises:
        InputError: it cannot be read, is no diagnosis, or has a key with a fault.
    """
    file = path / REPORT if path.is_dir() else path
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as err:
        raise InputError(f"{file}: cannot be read as JSON ({err})") from None
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        raise InputError(f"{file}: no diagnosis, allowed: a file with schema {SCHEMA}")
    return validate(DiagnosisFile, data, str(file))
