"""Diagnosing recordings: what the described machine lacks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from cspm.measured import read_for
from cspm.parameters import Parameter, Parameters
from cspm.progress import Progress, by_steps, shows_progress, silent
from cspm.recorded import AnyRecording
from cspm.testbed import AnyTestbed, Testbed, as_file
from cspm_ident.data_look.look import look_at, without_regimes
from cspm_ident.diagnosis.diagnose import diagnose as diagnose_measurements
from cspm_ident.diagnosis.diagnosis import Diagnosis as Result
from cspm_ident.diagnosis.finding import Finding as FoundEffect
from cspm_ident.diagnosis.finding import Status
from cspm_ident.diagnosis.reporting.improved_file import improved_testbed
from cspm_ident.diagnosis.reporting.verdict import diagnosis_data, named_in
from cspm_ident.diagnosis.thresholds import thresholds_of
from cspm_ident.diagnosis.validation.closed_loop import (
    ClosedLoopFit,
    SimulatedLoop,
    simulate_closed_loop,
)
from cspm_ident.diagnosis.validation.controller_parity import Parity, controller_parity
from cspm_ident.diagnosis_file import IMPROVED, REPORT
from cspm_ident.experiment.experiment_files import write_experiments
from cspm_ident.signals.measurement import Measurement
from cspm_msgs_py.new_folder import new_folder
from cspm_run.output.json_file import write_json

PICTURE = "diagnosis.png"
PAGE = "diagnosis.html"


@dataclass(frozen=True)
class Alternative:
    """What explains the data as well as a finding does.

    Attributes:
        effect: its id.
        elements: the cables or bodies that it is on.
        probability: of it, as far as the data show.
        experiment: scenario file that distinguishes it from the finding; None before `write`.
    """

    effect: str
    elements: tuple[str, ...]
    probability: float
    experiment: str | None


@dataclass(frozen=True)
class Finding:
    """Something that the described machine lacks, or was suspected of.

    Attributes:
        status: `reported`; `tied`, alternatives explain the data as well; `doubtful`, its interval
            contains zero; `rejected`, held-out data do not confirm it; `negligible`, it is there,
            but too small to matter.
        effect: id from the catalogue, or `unknown`.
        elements: the cables or bodies that have it.
        subsystem: `winch`, `cable`, `bar`, `frame` or `sensor`.
        probability: that it is right; None where nothing is known of that.
        statement: what it is, in one sentence.
        parameters: its numbers, `parameters["torque"].value`; of several elements
            `parameters["torque", "sway_3"]`.
        alternatives: what explains the data as well.
        onset: when it began [s]; None where it was there all the time.
        region: where in the signals it shows; empty where it does everywhere.
        reason: why it is rejected or doubtful; empty where it is neither.
    """

    status: str
    effect: str
    elements: tuple[str, ...]
    subsystem: str
    probability: float | None = None
    statement: str = ""
    parameters: Parameters = field(default_factory=Parameters)
    alternatives: tuple[Alternative, ...] = ()
    onset: float | None = None
    region: Mapping[str, Any] | None = None
    reason: str = ""


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What recordings say of the described machine.

    Attributes:
        result: the diagnosis itself, internal.
        data: what `diagnosis.json` holds; see `docs/reference/contract.md`.
        closed_loop: differences of the closed loop simulated again, before and after.
        parity: commands against what the described controllers make of the measurements.
    """

    result: Result
    data: dict[str, Any]
    closed_loop: tuple[ClosedLoopFit, ...]
    parity: tuple[Parity, ...]

    @property
    def verdict(self) -> str:
        """In a word: consistent, effect, parameter, tie, unknown or not_excited."""
        return str(self.data["verdict"])

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What the machine lacks, the most important first."""
        status = {(each.effect, each.elements): each.status for each in self.result.reported}
        return tuple(
            _finding(each, status.get((each["effect"], tuple(each["elements"])), Status.REPORTED))
            for each in self.data["findings"]
        )

    @property
    def rejected(self) -> tuple[Finding, ...]:
        """What was suspected and is not confirmed on held-out data."""
        return tuple(_without_numbers(each) for each in self.result.rejected)

    @property
    def doubtful(self) -> tuple[Finding, ...]:
        """What is in the improved machine, and too uncertain to be named."""
        return tuple(_without_numbers(each) for each in self.result.doubtful)

    @property
    def negligible(self) -> tuple[Finding, ...]:
        """What is there, too small to matter."""
        return tuple(_without_numbers(each) for each in self.result.negligible)

    def __repr__(self) -> str:
        """Return the verdict and what was found where."""
        found = (f"{each.effect} on {', '.join(each.elements)}" for each in self.findings)
        return f"<Diagnosis: {'; '.join((self.verdict, *found))}>"

    def _repr_html_(self) -> str:
        """Show the verdict and what was found as a table in a notebook."""
        from cspm.notebook import table

        heads = ("effect", "on", "status", "probability", "statement")
        rows = (
            (
                each.effect,
                ", ".join(each.elements),
                each.status,
                "" if each.probability is None else f"{100 * each.probability:.0f} %",
                each.statement,
            )
            for each in self.findings
        )
        return table(f"Diagnosis: {self.verdict}", heads, rows)

    @cached_property
    def improved_testbed(self) -> Testbed | None:
        """The machine with all that was found; None where nothing was."""
        if not self.result.in_model:
            return None
        return Testbed(improved_testbed(self.result, IMPROVED))

    def write(self, folder: str | Path, progress: Progress = silent) -> Path:
        """Write diagnosis.json, .html and .png, experiments and the improved test-bed.

        Args:
            folder: a new one.
            progress: called now and then with an estimate of the share and what is being done.

        Raises:
            InputError: the folder exists.
        """
        place = new_folder(folder)
        write_experiments(place, self.result, self.data, by_steps(progress))
        # Drawing takes a second to load that a verdict alone need not wait for.
        from cspm.plots.diagnosis_figure import draw_diagnosis
        from cspm_ident.diagnosis.reporting.diagnosis_page import write_diagnosis_page

        write_json(place / REPORT, self.data)
        draw_diagnosis(place / PICTURE, self.result)
        write_diagnosis_page(place / PAGE, self.result, self.data)
        if self.result.in_model:
            improved = improved_testbed(self.result, str(place / IMPROVED))
            (place / IMPROVED).write_text(improved.text, encoding="utf-8")
        return place


@shows_progress("reading")
def diagnose(
    recordings: AnyRecording | Iterable[AnyRecording],
    *,
    testbed: AnyTestbed | None = None,
    held_out: AnyRecording | Iterable[AnyRecording] = (),
    closed_loop: bool = True,
    leave_out_regimes: bool = False,
    thresholds: Mapping[str, float] | None = None,
    progress: Progress = silent,
) -> Diagnosis:
    """Find what the described machine lacks: `cspm diagnose`.

    Every residual is driven by what was measured, so that feedback cannot hide an effect. What is
    found is judged on data that was not searched.

    Args:
        recordings: one or several of one machine, in which to look.
        testbed: the machine as it is believed to be: a name, a file or a `Testbed`; None: the one
            that the recordings carry.
        held_out: on which to judge what was found; none: the last three tenths of each recording.
        closed_loop: whether to simulate the recorded closed loop again with what was found.
        leave_out_regimes: whether to leave out the stretches that obey another equation than the
            rest of their recording; `data["data_checks"]` names them.
        thresholds: those that are not the defaults, by name, such as `{"material_share": 0.1}`;
            `docs/reference/thresholds.md` lists all with units and ranges.
        progress: called now and then with an estimate of the share that is done and what is done;
            none: a bar in a terminal, lines in a notebook.

    Raises:
        InputError: naming what is wrong in recordings, test-bed or thresholds.

    Examples:
        >>> import cspm
        >>> verdict = cspm.diagnose("friction_30", testbed="thesis")  # doctest: +SKIP
        >>> verdict.findings[0].parameters["torque"].ci95  # doctest: +SKIP
        (0.0297, 0.0304)
    """
    limits = thresholds_of(thresholds or {})
    step = by_steps(progress)
    searched, judged = read_for(recordings, held_out, testbed, step=step)
    # Neither needs what is found: another thread makes them meanwhile.
    with ThreadPoolExecutor(1) as aside:
        look = aside.submit(look_at, searched, judged)
        stepped = aside.submit(controller_parity, searched[0].path)
        if leave_out_regimes:
            step("looking at the data")
            searched, judged = (without_regimes(each, look.result()) for each in (searched, judged))
        found = diagnose_measurements(searched, judged, step, thresholds=limits)
        measured = (judged or searched)[0]
        loop = _closed_loop(found, measured, step) if closed_loop else SimulatedLoop()
        step("controllers")
        checks, parity = look.result(), tuple(stepped.result())
    data = diagnosis_data(found, _path(testbed)) | {
        "data_checks": [each.data() for each in checks],
        "closed_loop": [each._asdict() for each in loop.fits],
        "controllers": [each._asdict() for each in parity],
    }
    _add_consequences(data, loop)
    progress(1.0, "done")
    return Diagnosis(found, data, loop.fits, parity)


def _closed_loop(
    found: Result, measurement: Measurement, step: Callable[[str], None]
) -> SimulatedLoop:
    """Return a recording simulated again with the machine as found; empty without findings."""
    if not found.in_model:
        return SimulatedLoop()
    fewer = [improved_testbed(found, IMPROVED, without=each) for each in found.reported]
    return simulate_closed_loop(measurement, improved_testbed(found, IMPROVED), fewer, step)


def _add_consequences(data: dict[str, Any], loop: SimulatedLoop) -> None:
    """Add to each finding that names an effect the tracking error with and without it."""
    tracked = loop.without or [None] * len(named_in(data))
    for entry, without in zip(named_in(data), tracked, strict=True):
        entry["consequence"] = None
        if loop.tracking is not None and without is not None:
            both = {"with": loop.tracking, "without": without}
            entry["consequence"] = {name: each._asdict() for name, each in both.items()}


def _path(testbed: AnyTestbed | None) -> Path | None:
    """Return where a given test-bed comes from, as `diagnosis.json` names it."""
    if isinstance(testbed, Path) or testbed is None:
        return testbed
    return Path(as_file(testbed).source)


def _finding(entry: Mapping[str, Any], status: Status) -> Finding:
    """Return one finding of `diagnosis.json`."""
    return Finding(
        status.value,
        entry["effect"],
        tuple(entry["elements"]),
        entry["subsystem"],
        entry["probability"],
        entry["statement"],
        Parameters(
            Parameter(
                p["name"],
                p["element"],
                float(p["value"]),
                p["unit"],
                None if p["ci95"] is None else (float(p["ci95"][0]), float(p["ci95"][1])),
            )
            for p in entry["parameters"]
        ),
        tuple(
            Alternative(
                a["effect"], tuple(a["elements"]), a["probability"], a["separating_experiment"]
            )
            for a in entry["alternatives"]
        ),
        entry["onset_s"],
        entry["region"],
    )


def _without_numbers(found: FoundEffect) -> Finding:
    status, subsystem = found.status.value, found.hypothesis.effect.block.value
    return Finding(status, found.effect, found.elements, subsystem, reason=found.reason_not_kept)
