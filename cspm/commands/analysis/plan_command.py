"""What `cspm diagnose --plan` prints: what a motion could show, before anything is recorded."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

from rich import box
from rich.table import Table

from cspm.commands.progress_shown import shown
from cspm.diagnosis import diagnose
from cspm.scenario import load_scenario
from cspm.simulation import simulate
from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.reporting.quantity import amount_words
from cspm_ident.diagnosis.validation.detection_limits import Limit
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json
from cspm_sim.effects import catalogue

# A longer motion shows little more of what it excites.
_LONGEST_S = 60.0


def plan_command(
    scenario: str, testbed: Path | None, duration: float | None, json: Path | None
) -> None:
    """Simulate a scenario without anything concealed, and print the detection limits in it.

    Args:
        scenario: name or file.
        testbed: file of another machine to run it on; None: the scenario's own.
        duration: of the motion [s]; None: the scenario's, at most a minute.
        json: where to write the limits as data; None: nowhere.

    Raises:
        InputError: the scenario or the machine cannot be used.
    """
    console = make_console()
    with shown(console, "simulating") as progress, ScratchFolder("plan") as place:
        described = load_scenario(scenario)
        seconds = duration or min(described.description.duration, _LONGEST_S)
        run = simulate(described, testbed=testbed, duration=seconds)
        recording = run.save(place / "recording")
        found = diagnose(recording, closed_loop=False, progress=progress).result
    console.print(_table(found.limits, f"what {seconds:g} s of {described.name} show from"))
    for line in _unseen(found):
        say(console, line)
    if json is not None:
        write_json(json, [each._asdict() for each in found.limits])


def _table(limits: Sequence[Limit], title: str) -> Table:
    """Return the detection limits by parameter, the smallest and largest over the elements."""
    table = Table(title=title, box=box.SIMPLE_HEAD)
    for heading in ("effect", "parameter", "detection limit", "elements"):
        table.add_column(heading)
    rows: dict[tuple[str, str, str], list[Limit]] = defaultdict(list)
    for each in (limit for limit in limits if limit.possible):
        rows[each.effect, each.parameter, each.unit].append(each)
    for (effect, parameter, unit), own in rows.items():
        sizes = sorted(each.least for each in own)
        ends = dict.fromkeys(amount_words(each, unit) for each in (sizes[0], sizes[-1]))
        table.add_row(effect, parameter, " to ".join(ends), str(len(own)))
    return table


def _unseen(found: Diagnosis) -> Iterator[str]:
    """Yield what this motion cannot show, and what would."""
    hidden = (each for each in found.limits if not each.possible)
    if never := sorted({f"{e.effect} {e.parameter} on {e.element}" for e in hidden}):
        yield f"no size that the catalogue allows would show: {', '.join(never)}"
    for name, elements in found.not_excited:
        if elements:
            experiment = catalogue()[name].description.separating_experiment
            yield f"not moved: {name} on {', '.join(elements)}; would show: {experiment}"
    if without := [name for name, elements in found.not_excited if not elements]:
        yield f"without sensors or parts that would show it: {', '.join(without)}"
