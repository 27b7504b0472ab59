"""The command `cspm diagnose`."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from rich import box
from rich.console import Console
from rich.table import Table

from cspm.commands.data_look_lines import print_data_look
from cspm.commands.progress_shown import shown
from cspm.diagnosis import diagnose
from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.reporting.completeness import completeness_sentence
from cspm_ident.diagnosis.reporting.empirical_statement import stage_errors, stage_names
from cspm_ident.diagnosis.reporting.finding_statement import (
    calibrated_words,
    consequence_words,
    considered_words,
    statement_of,
)
from cspm_ident.diagnosis.reporting.statement import (
    channel_of,
    drive_of,
    extrapolation_statement,
    line_statement,
    remainder_statement,
    simulated_statement,
    tension_statement,
    unit_of,
    unknown_statement,
)
from cspm_ident.diagnosis.reporting.verdict import (
    SENTENCES,
    named_in,
    verdict_of,
)
from cspm_ident.diagnosis.validation.closed_loop import ClosedLoopFit
from cspm_ident.diagnosis.validation.controller_parity import Parity
from cspm_msgs_py.testbed import Testbed
from cspm_run.library import named_testbed
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json
from cspm_sim.effects import catalogue


@dataclass(frozen=True)
class DiagnoseRequest:
    """Options of the command.

    Attributes:
        recordings: to search.
        held_out: for the hold-out test; none for the last part of each recording.
        testbed: file of the assumed machine, instead of the recorded one.
        out: a new folder for the results; None writes nothing.
        closed_loop: whether to simulate the closed loop again with the findings.
        leave_out_regimes: whether to leave out stretches that do not belong to the rest.
    """

    recordings: Sequence[Path]
    held_out: Sequence[Path]
    testbed: Path | None
    out: Path | None
    closed_loop: bool = True
    leave_out_regimes: bool = False


def diagnose_command(request: DiagnoseRequest, json: Path | None) -> None:
    """Diagnose, print the results, and write the requested files.

    Raises:
        InputError: recordings, test-bed or options cannot be used.
    """
    console = make_console()
    with shown(console, "reading") as progress:
        found = diagnose(
            request.recordings,
            testbed=None if request.testbed is None else named_testbed(request.testbed),
            held_out=request.held_out,
            closed_loop=request.closed_loop,
            leave_out_regimes=request.leave_out_regimes,
            progress=progress,
        )
        if request.out is not None:
            found.write(request.out, progress)
    print_data_look(console, found.data["data_checks"])
    say(console, believed_line(found.result.searched[0].machine, request.testbed))
    print_diagnosis(console, found.result, found.data, request.out)
    _print_parity(console, found.parity)
    if found.closed_loop:
        console.print(_loop_table(found.closed_loop))
    if request.out is not None:
        say(console, f"written {request.out}")
        words = ("view", str(request.recordings[0]), "--diagnosis", str(request.out))
        say(console, f"next: cspm {shlex.join(words)}")
    if json is not None:
        write_json(json, found.data)


def believed_line(machine: Testbed, file: Path | None) -> str:
    """Return which description the verdict is about.

    A simulated recording carries the machine that was simulated, whose effects are then believed.
    """
    if file is not None:
        place = "" if str(file) == machine.name else f" ({file})"
        return f"compared with the test-bed {machine.name}{place}"
    own = f"compared with the test-bed {machine.name}, which the recording carries"
    if not machine.effects:
        return own
    names = ", ".join(dict.fromkeys(entry.effect for entry in machine.effects))
    return (
        f"{own}, with its {names}: these are believed, not looked for; --testbed FILE compares with"
        " another, such as the one without them"
    )


def _print_cut_short(console: Console, found: Diagnosis) -> None:
    """Print which recordings were cut short because their writer was killed, or read in part."""
    for each in (*found.searched, *found.held_out):
        if not each.complete:
            say(console, f"{each.path}: was not closed; {each.duration:.1f} s of it are readable")
        for line in each.left_out:
            say(console, line)


def _print_parity(console: Console, parity: Sequence[Parity]) -> None:
    """Print which recorded commands differ from those of the described controllers."""
    for each in parity:
        if each.different:
            say(
                console,
                f"• {each.topic}: {each.different} of {each.compared} commands are not what the"
                f" described {each.node} makes of the recorded measurements (up to"
                f" {each.largest:.2g})",
            )


def _print_named(
    console: Console,
    found: Diagnosis,
    entries: Sequence[Mapping[str, Any]],
    experiments: Sequence[Sequence[str]],
) -> None:
    for finding, entry, own in zip(found.reported, entries, experiments, strict=True):
        cost = consequence_words(entry.get("consequence"))
        say(console, f"• {statement_of(found, finding)}{cost}")
        for rival, experiment in zip(finding.alternatives, own, strict=True):
            say(console, f"  as well explained by {rival.words}; to distinguish: {experiment}")


def _experiments(found: Diagnosis, data: Mapping[str, Any], folder: Path | None) -> list[list[str]]:
    """Return the separating experiment of every alternative, by finding."""
    return [
        [
            f"cspm run {folder / entry['separating_experiment']}"
            if folder is not None and entry["separating_experiment"]
            else rival.hypothesis.effect.description.separating_experiment
            for rival, entry in zip(finding.alternatives, reported["alternatives"], strict=True)
        ]
        for finding, reported in zip(found.reported, named_in(data), strict=True)
    ]


def print_diagnosis(
    console: Console, found: Diagnosis, data: Mapping[str, Any], folder: Path | None
) -> None:
    """Print the verdict, the findings and the change of fit on held-out data.

    Args:
        console: where to print.
        found: the diagnosis.
        data: contents of its `diagnosis.json`.
        folder: folder of the planned experiments; None if they were not written.
    """
    verdict = verdict_of(found)
    console.print(f"verdict: [bold]{verdict.value}[/]")
    if not data["findings"]:
        say(console, SENTENCES[verdict])
    experiments = _experiments(found, data, folder)
    _print_cut_short(console, found)
    _print_named(console, found, named_in(data), experiments)
    if complete := completeness_sentence(found):
        say(console, complete)
    for each in found.unexplained:
        say(console, f"• {unknown_statement(found, each)}")
    for entry in data["empirical"]:
        say(console, f"  {entry['statement']}")
    for line in found.lines:
        say(console, f"• {line_statement(line)}")
    for left in found.undescribed[:_MOST_REMAINDERS]:
        say(console, f"• {remainder_statement(left)}")
    if not (found.reported or found.unexplained or found.lines or found.undescribed):
        for fit in found.simulated_beyond[:1]:
            say(console, f"• {simulated_statement(fit)}")
    for finding in found.considered:
        say(console, f"not named, {considered_words(finding)}: {finding.reason_not_kept}")
    for finding in found.calibrated:
        say(console, f"calibrated within the accuracy of a survey: {calibrated_words(finding)}")
    for finding in (each for each in found.negligible if each not in found.calibrated):
        say(
            console,
            f"taken into account, too small to matter: {finding.hypothesis.words}",
        )
    drawn = tension_statement(found)
    if drawn is not None:
        say(console, drawn)
    for beyond in found.extrapolated:
        say(console, extrapolation_statement(beyond))
    _print_fits(console, found)
    for name, elements in found.not_excited:
        if elements:
            shown = catalogue()[name].description.separating_experiment
            say(console, f"not testable here: {name} on {', '.join(elements)}; would show: {shown}")
    without = ", ".join(name for name, elements in found.not_excited if not elements)
    if without:
        say(console, f"not testable with the sensors and parts of these recordings: {without}")
    reported = sorted({limit.effect for limit in found.limits if limit.possible})
    if reported:
        say(
            console,
            f"Detection limits of {len(reported)} effects: see detection_limits in diagnosis.json.",
        )


class _Row(NamedTuple):
    """One line of a table of fits: RMS errors of the stages, of others, and the noise."""

    name: str
    numbers: tuple[float, ...]
    unit: str
    at_noise: bool

    def changes(self, stages: int) -> bool:
        """Return whether the root mean square differs among so many stages."""
        numbers = self.numbers[:stages]
        return max(numbers) > _CHANGED * min(numbers)


def _print_fits(console: Console, found: Diagnosis) -> None:
    """Print fits that changed or are well above their noise, and the count of the others."""
    judged = "held-out recordings" if found.held_out else "the last part, not searched"
    stages, limits = stage_names(found), found.thresholds
    rows = [
        _Row(
            channel_of(f),
            (*stage_errors(found, f), f.ceiling, f.noise),
            unit_of(f),
            f.is_at_noise(limits) is not False,
        )
        for f in found.fit
    ]
    headings = (*stages, "black box", "noise")
    _print_table(console, f"residuals of the equations, {judged}", headings, len(stages), rows)
    rows = [
        _Row(
            f"{f.output.name}, from measured {drive_of(f)}",
            (*stage_errors(found, f), f.floor),
            f.output.unit,
            f.after <= limits.noise_floor_ratio * f.floor,
        )
        for f in found.simulated
    ]
    if rows:
        _print_table(
            console, f"errors of simulations, {judged}", (*stages, "noise"), len(stages), rows
        )


def _print_table(
    console: Console,
    title: str,
    headings: Sequence[str],
    stages: int,
    rows: Sequence[_Row],
) -> None:
    shown = [row for row in rows if not row.at_noise or row.changes(stages)]
    table = Table(title=f"{title}: root mean square", box=box.SIMPLE_HEAD)
    for heading in ("", *headings, "unit"):
        table.add_column(heading, justify="left" if heading in ("", "unit") else "right")
    for name, numbers, unit, _ in shown:
        table.add_row(name, *(f"{number:.3g}" for number in numbers), unit)
    if shown:
        console.print(table)
    others = len(rows) - len(shown)
    say(console, f"{title}: {others} of {len(rows)} at their noise, before and after")


# Smaller changes of a root mean square are not printed where it is at the noise.
_CHANGED = 1.05
# Remainders that are printed; `diagnosis.json` has all.
_MOST_REMAINDERS = 3


def _loop_table(loop: Sequence[ClosedLoopFit]) -> Table:
    table = Table(title="closed loop simulated again: RMS difference", box=box.SIMPLE_HEAD)
    for heading in ("", "before", "after", "unit"):
        table.add_column(heading, justify="left" if heading in ("", "unit") else "right")
    for fit in loop:
        table.add_row(fit.name, f"{fit.before:.3g}", f"{fit.after:.3g}", fit.unit)
    return table
