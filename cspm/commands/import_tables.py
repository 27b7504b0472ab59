"""The printed report of an import."""

from __future__ import annotations

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from cspm_checks.pace import Pace
from cspm_checks.suspicion import Suspicion
from cspm_ident.importing.report import FieldReport, ImportReport, TopicReport
from cspm_run.output.console import say


def print_report(console: Console, report: ImportReport) -> None:
    """Print each topic with its stamps, conversions and first rows, then the suspicions."""
    about = report.about
    say(console, f"{about['source']}, {report.kind}, SHA-256 {about['source_sha256']}")
    say(console, f"mapping {about['mapping']}, test-bed {about['testbed']}")
    say(console, f"t = 0 at the first stamp, {report.origin_ns} ns")
    for note in report.notes:
        say(console, f"note: {note}")
    if report.unused:
        say(console, f"columns left out: {', '.join(report.unused)}")
    for topic in report.topics:
        _print_topic(console, topic)
    if not report.suspicions:
        say(console, "suspicions: none")
    for (text, remedy), places in suspicions_by_text(report.suspicions).items():
        say(console, f"suspicion: {', '.join(places)}: {text}; remedy: {remedy}")


def suspicions_by_text(suspicions: list[Suspicion]) -> dict[tuple[str, str], list[str]]:
    """Return the places of each suspicion, as one cable's fault often concerns all cables."""
    found: dict[tuple[str, str], list[str]] = {}
    for one in suspicions:
        found.setdefault((one.text, one.remedy), []).append(one.where)
    return found


def _print_topic(console: Console, topic: TopicReport) -> None:
    say(console, "")
    say(console, f"{topic.topic}: {_pace(topic.pace)}")
    left = topic.left_out
    reasons = {
        "without time": left.no_time,
        "without partner": left.unpaired,
        "with a missing number": left.missing,
        "out of order": left.disorder,
        **{f"in drop[{i}]": count for i, count in enumerate(left.segments)},
    }
    reported = [f"{count} {reason}" for reason, count in reasons.items() if count]
    if reported:
        say(console, f"left out: {', '.join(reported)}")
    console.print(_conversions(topic.fields))
    console.print(_first_rows(topic))


def _pace(pace: Pace) -> str:
    text = f"{pace.messages} messages from {pace.first_s:.6g} s to {pace.last_s:.6g} s"
    if pace.rate_hz is None or pace.step_s is None:
        return text
    low, median, high = (1e3 * step for step in pace.step_s)
    return (
        f"{text}, {pace.rate_hz:.6g} Hz, steps {low:.6g} to {high:.6g} ms, median {median:.6g} ms,"
        f" {pace.gaps} gaps"
    )


def _conversions(fields: list[FieldReport]) -> Table:
    table = Table(box=box.SIMPLE)
    for column in ("field", "from", "conversion"):
        table.add_column(column, overflow="fold")
    for column in ("least", "largest", "mean", "deviation", "resolution"):
        table.add_column(column, justify="right", no_wrap=True)
    for field in fields:
        formula = field.formula + f", passed its end {field.turns} times" * bool(field.turns)
        numbers = (field.low, field.high, field.mean, field.deviation)
        fine = "" if field.resolution is None else f"{field.resolution:.5g}"
        table.add_row(
            escape(field.field),
            escape(field.source),
            escape(formula),
            *(f"{number:.6g}" for number in numbers),
            fine,
        )
    return table


def _first_rows(topic: TopicReport) -> Table:
    table = Table(box=box.SIMPLE)
    table.add_column("t [s]")
    for i, first in enumerate(topic.first_s):
        # Enough digits to see the first steps, however late the topic begins.
        table.add_column(f"{first:.9g}" if i else f"{first:.6g}", justify="right", no_wrap=True)
    for field in topic.fields:
        unit = f" [{field.quantity}]" if field.quantity not in ("", "1") else ""
        if field.raw:
            table.add_row(escape(f"{field.source} raw"), *(f"{x:.9g}" for x in field.raw))
        table.add_row(escape(field.field + unit), *(f"{x:.6g}" for x in field.converted))
    return table
