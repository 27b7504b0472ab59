"""The commands that say what a recording holds, and restore one."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from cspm_msgs_py.recording.overview import Overview, TopicOverview, overview
from cspm_msgs_py.recording.recover import recover
from cspm_msgs_py.recording.run_record import RECORD_NAME, SIM
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json

_NUMBERS = ("messages", "rate [Hz]", "longest gap [ms]", "at [s]")
# What the type of a message needs at least to be recognised, in characters.
_LEAST_TYPE = 16
_ROOM = 1000


def info_command(bag: Path, json: Path | None) -> None:
    """Print a summary of a recording."""
    console = make_console()
    found = overview(bag)
    say_topics(console, found)
    say(
        console,
        f"{found.message_count} messages over {found.duration_s:.3f} s,"
        f" {found.size_bytes / 1e6:.1f} MB, {found.storage} {found.profile}, written by"
        f" {found.library or 'unknown'}",
    )
    record = found.metadata.get(RECORD_NAME, {})
    if "source" in record:
        say(
            console,
            f"imported from {record['source']} (SHA-256 {record.get('source_sha256', 'unknown')}),"
            f" mapping {record.get('mapping', 'unknown')}, test-bed {found.testbed}",
        )
    elif found.scenario or found.testbed:
        say(
            console,
            f"scenario {found.scenario}, seed {record.get('seed', 'unknown')}, test-bed"
            f" {found.testbed}, mode {record.get('mode', 'unknown')}, plant"
            f" {record.get('plant', SIM)}",
        )
    _say_troubles(console, bag, found)
    if json is not None:
        write_json(json, dataclasses.asdict(found) | {"path": str(found.path)})


def say_topics(console: Console, found: Overview) -> None:
    """Print a table of the topics, or a paragraph each where the terminal is too narrow for it."""
    table = Table(title=escape(str(found.path)), box=box.SIMPLE)
    table.add_column("topic", no_wrap=True)
    # The one that gives way.
    table.add_column("type", overflow="ellipsis")
    for column in _NUMBERS:
        table.add_column(escape(column), justify="right", no_wrap=True)
    for topic in found.topics:
        table.add_row(escape(topic.name), escape(topic.ros_type), *_numbers(topic, found.start_ns))
    longest_type = max((len(topic.ros_type) for topic in found.topics), default=0)
    # Measured as if there were room, since a measure ends at the width of the terminal.
    whole = console.measure(table, options=console.options.update(max_width=_ROOM)).maximum
    if whole - longest_type + _LEAST_TYPE <= console.width:
        console.print(table)
        return
    say(console, str(found.path))
    for topic in found.topics:
        count, rate, gap, at = _numbers(topic, found.start_ns)
        often = f", {rate} Hz" if rate else ""
        longest_gap = f", gap ≤ {gap} ms at {at} s" if gap else ""
        say(console, f"{topic.name}\n  {topic.ros_type}\n  {count} messages{often}{longest_gap}")


def _numbers(topic: TopicOverview, start_ns: int) -> tuple[str, str, str, str]:
    return (
        str(topic.count),
        "" if topic.rate_hz is None else f"{topic.rate_hz:.1f}",
        "" if topic.gap_ns is None else f"{topic.gap_ns * 1e-6:.3f}",
        "" if topic.gap_at_ns is None else f"{(topic.gap_at_ns - start_ns) * 1e-9:.3f}",
    )


def _say_troubles(console: Console, bag: Path, found: Overview) -> None:
    for topic, count in found.refused.items():
        say(console, f"refused: {count} messages on {topic}, which no node of the run obeyed")
    for line in found.misfits:
        say(console, f"does not fit: {line}")
    for fault in found.faults:
        say(console, f"fault: {fault}")
    if found.faults and found.complete:
        say(console, f"`cspm recover {bag}` restores what can be read")
    if not found.complete:
        say(console, f"cut short: `cspm recover {bag}` restores its index")


def recover_command(bag: Path, out: Path | None, json: Path | None) -> None:
    """Restore a recording, and print what was restored."""
    console = make_console()
    report = recover(bag, out)
    if report.bare:
        names = ", ".join(path.name for path in report.bare)
        say(console, f"{names}: holds nothing, left out")
    for line in report.left_out:
        say(console, line)
    if not report.restored:
        done = "metadata.yaml was written" if report.described else "nothing to restore"
        say(console, f"{report.path}: complete, {done}")
    else:
        say(
            console,
            f"{report.path}: {report.messages} messages up to {report.end_ns * 1e-9:.3f} s,"
            f" {report.lost_bytes} bytes at the end unusable, {report.damaged} damaged chunks left"
            f" out; the original is kept as {', '.join(path.name for path in report.kept)}",
        )
    if json is not None:
        listed = ("restored", "kept", "bare")
        paths = {name: [str(p) for p in getattr(report, name)] for name in listed}
        write_json(json, dataclasses.asdict(report) | paths | {"path": str(report.path)})
