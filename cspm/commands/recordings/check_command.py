"""The command `cspm check`: what looks wrong in a recording or a log, and what mends it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path

from rich.console import Console

from cspm.commands.import_tables import suspicions_by_text
from cspm_checks.columns import recorded_columns
from cspm_checks.look import look_at
from cspm_checks.pace import Pace, pace_of
from cspm_checks.suspicion import Suspicion
from cspm_ident.importing.column_store import ColumnStore
from cspm_ident.importing.mapping import MappingFile, load_mapping
from cspm_ident.importing.mended_mapping import mended_mapping
from cspm_ident.importing.preparation import prepare
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording import Recording
from cspm_msgs_py.recording.attached_testbed import attached_testbed
from cspm_msgs_py.testbed import TestbedFile
from cspm_run.library import find_mapping, named_testbed
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json

_HARMLESS = ("unset", "late_part", "unmeasured", "paired", "mended")
"""Kinds that say what was done, and leave nothing to do."""


@dataclass(frozen=True)
class Check:
    """Options of the command line."""

    source: Path
    mapping: Path | None
    testbed: Path | None
    page: Path | None
    fix: Path | None


@dataclass(frozen=True)
class Checked:
    """What was looked at, and what was found.

    Attributes:
        paces: stamps of each topic, by name.
        suspicions: what looks wrong.
        notes: what a person should know.
        origin_s: the first stamp of all, from which times count [s].
    """

    paces: dict[str, Pace]
    suspicions: list[Suspicion]
    notes: list[str]
    origin_s: float

    @property
    def wrong(self) -> list[Suspicion]:
        """What leaves something to do."""
        return [one for one in self.suspicions if one.kind not in _HARMLESS]


def check_command(request: Check, json: Path | None) -> bool:
    """Print what looks wrong, write page and mended mapping; return whether all is well.

    Raises:
        InputError: the source, the mapping or the test-bed cannot be used, or a file exists.
    """
    console = make_console()
    for path in (request.page, request.fix):
        if path is not None and path.exists():
            raise InputError(f"{path}: already exists, allowed: a new file")
    if request.mapping is None:
        if request.fix is not None:
            raise InputError(f"--fix {request.fix}: without --mapping, allowed: with one to mend")
        found, changed = _of_recording(request.source, request.testbed), list[str]()
    else:
        mapping = load_mapping(find_mapping(str(request.mapping)))
        if request.testbed is None:
            raise InputError("--mapping: without --testbed, allowed: with the machine's file")
        machine = named_testbed(request.testbed)
        found = _of_log(request.source, mapping, machine)
        changed = [] if request.fix is None else _mend(request, mapping, machine, found, console)
    _print(console, request.source, found)
    if request.page is not None:
        _write_page(request.page, request.source, found)
        say(console, f"page {request.page}")
    if json is not None:
        write_json(json, {**asdict(found), "changed": changed, "ok": not found.wrong})
    return not found.wrong


def _of_recording(path: Path, testbed: Path | None) -> Checked:
    """Look at a recording of cspm.

    Raises:
        InputError: it is none, carries no test-bed and none was given, or has no sensor's topic.
    """
    with Recording(path) as opened:
        if testbed is None:
            machine = attached_testbed(opened.attachments, path)
        else:
            machine = named_testbed(testbed)
        log, left_out = recorded_columns(opened), opened.left_out
    if not log:
        raise InputError(f"{path}: no topic of a sensor, allowed: at least one; or --mapping FILE")
    origin = min(int(one.stamp_ns.min()) for one in log.values())
    found = look_at(log, machine.testbed, origin, {})
    paces = {name: pace_of(one.stamp_ns, origin) for name, one in log.items()}
    return Checked(paces, found.suspicions, [*left_out, *found.unjudged], origin * 1e-9)


def _of_log(path: Path, mapping: MappingFile, testbed: TestbedFile) -> Checked:
    """Look at a log of others, as an import would read it."""
    with ColumnStore() as store:
        report = prepare(path, mapping, testbed, store, lambda _: None, trial=True).report
    paces = {topic.topic: topic.pace for topic in report.topics}
    return Checked(paces, report.suspicions, report.notes, report.origin_ns * 1e-9)


def _mend(
    request: Check,
    mapping: MappingFile,
    testbed: TestbedFile,
    found: Checked,
    console: Console,
) -> list[str]:
    """Write the mended mapping, look again with it, and say what changed and what is left."""
    assert request.fix is not None
    earliest = {name: found.origin_s + pace.first_s for name, pace in found.paces.items()}
    text, changed = mended_mapping(mapping, found.suspicions, earliest)
    if not changed:
        say(console, "nothing that a mapping can mend: no file written")
        return []
    if request.fix.absolute().parent != mapping.path.absolute().parent and mapping.mapping.files:
        raise InputError(
            f"--fix {request.fix}: allowed: in {mapping.path.parent}, from which its files are seen"
        )
    request.fix.write_text(text, encoding="utf-8")
    for line in changed:
        say(console, f"mended: {line}")
    left = _of_log(request.source, load_mapping(request.fix), testbed).wrong
    kinds = ", ".join(dict.fromkeys(one.kind for one in left)) or "none"
    say(console, f"mapping {request.fix}: {len(left)} suspicions with it ({kinds})")
    return changed


def _print(console: Console, source: Path, found: Checked) -> None:
    for name, pace in found.paces.items():
        say(console, f"{name}: {_looked_at(pace)}")
    for note in found.notes:
        say(console, f"note: {note}")
    for (text, remedy), places in suspicions_by_text(found.suspicions).items():
        say(console, f"suspicion: {', '.join(places)}: {text}; remedy: {remedy}")
    count = len(found.wrong)
    say(console, f"{source}: {f'{count} suspicions' if count else 'nothing looks wrong'}")


def _looked_at(pace: Pace) -> str:
    rate = f", {pace.rate_hz:.6g} Hz" if pace.rate_hz else ""
    return f"{pace.messages} messages from {pace.first_s:.6g} to {pace.last_s:.6g} s{rate}"


def _write_page(path: Path, source: Path, found: Checked) -> None:
    """Write what was looked at, what is wrong, when, and the key that mends it."""
    # Plotly, whose script a page may hold, loads for a page alone.
    from cspm_ident.offline_page import table_html, write_offline_page

    looked = [(name, _looked_at(pace)) for name, pace in found.paces.items()]
    wrong = [
        (one.where, one.kind, one.text, ", ".join(f"{at:.6g}" for at in one.at_s), one.remedy)
        for one in found.suspicions
    ]
    parts = [
        f"<p class=verdict>{len(found.wrong) or 'no'} suspicions</p>",
        "<h2>Looked at</h2>",
        table_html(("topic", "messages"), looked, "what was looked at"),
        "<h2>What looks wrong</h2>" if wrong else "",
        table_html(("where", "kind", "what", "when [s]", "remedy"), wrong, "what looks wrong")
        if wrong
        else "",
        table_html(("note",), [(note,) for note in found.notes], "notes") if found.notes else "",
    ]
    write_offline_page(path, f"Check of {source.name}", filter(None, parts))
