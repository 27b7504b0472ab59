"""Findings about drivers, for people and for programs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from cspm_ros.check_drivers.driver_observation import Finding, Observation
from cspm_ros.check_drivers.pull_response import PullVerdict

OK, WARNING, ERROR = "ok", "warning", "error"
_COLOURS = {OK: "green", WARNING: "yellow", ERROR: "red"}
# The text of a topic without faults.
_TELLING = ("rate", "delay", "qos", "hearers", "publishers", "ticks")
_PIPE_WIDTH = 1000


def drivers_console() -> Console:
    """Return a console that breaks no line where nobody looks."""
    console = Console()
    return console if console.is_terminal else Console(width=_PIPE_WIDTH)


def verdict_of(findings: Iterable[Finding]) -> str:
    """Return `error` if anything is wrong, `warning` if anything is odd or cannot be decided."""
    found = [finding.ok for finding in findings]
    return ERROR if False in found else WARNING if None in found else OK


def by_topic(findings: Iterable[Finding], order: Sequence[str]) -> dict[str, list[Finding]]:
    """Return the findings by topic, those of `order` first and in that order."""
    found: dict[str, list[Finding]] = {name: [] for name in order}
    for finding in findings:
        found.setdefault(finding.topic, []).append(finding)
    return {name: each for name, each in found.items() if each}


def topic_table(title: str, topics: Mapping[str, Sequence[Finding]]) -> Table:
    """Return a table with a line for each topic, or for each thing that is wrong or odd with it."""
    table = Table(title=escape(title), box=box.SIMPLE, title_justify="left")
    table.add_column("topic", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    table.add_column("what was found")
    for name, findings in topics.items():
        lines = _problems(findings) or [(OK, _summary(findings))]
        for i, (verdict, text) in enumerate(lines):
            table.add_row(escape(name) * (i == 0), _coloured(verdict), escape(text))
    return table


def print_findings(console: Console, findings: Iterable[Finding]) -> None:
    """Print a line for each finding, errors first."""
    for finding in sorted(findings, key=_gravity):
        text = f"{_coloured(verdict_of([finding])):>7} {escape(finding.text)}"
        console.print(f"  {text}", highlight=False, soft_wrap=True)


def count_line(topics: Mapping[str, Sequence[Finding]]) -> str:
    """Return how many errors and warnings there are."""
    found = [finding.ok for findings in topics.values() for finding in findings]
    return f"{_count(found.count(False), ERROR)}, {_count(found.count(None), WARNING)}"


def topics_data(
    topics: Mapping[str, Sequence[Finding]], observations: Iterable[Observation]
) -> dict[str, Any]:
    """Return what is known of each topic, as plain data."""
    heard = {each.topic_name: each for each in observations}
    return {
        name: {
            "verdict": verdict_of(findings),
            "type": heard[name].ros_type if name in heard else "",
            "publishers": heard[name].publishers if name in heard else 0,
            "messages": len(heard[name].samples) if name in heard else 0,
            "findings": findings_data(findings),
        }
        for name, findings in topics.items()
    }


def pulls_data(verdicts: Iterable[PullVerdict]) -> list[dict[str, Any]]:
    """Return what each pull showed, as plain data."""
    return [
        {
            "cable": each.cable,
            "ok": each.ok,
            "answered": dict(each.answered),
            "findings": findings_data(each.findings),
        }
        for each in verdicts
    ]


def findings_data(findings: Iterable[Finding]) -> list[dict[str, Any]]:
    """Return findings as plain data."""
    return [asdict(finding) for finding in findings]


def _problems(findings: Sequence[Finding]) -> list[tuple[str, str]]:
    found = [finding for finding in findings if not finding.ok]
    return [(verdict_of([finding]), finding.text) for finding in sorted(found, key=_gravity)]


def _gravity(finding: Finding) -> int:
    return (False, None, True).index(finding.ok)


def _summary(findings: Sequence[Finding]) -> str:
    texts = {finding.check: finding.text for finding in findings}
    return "; ".join(texts[check] for check in _TELLING if check in texts)


def _coloured(verdict: str) -> str:
    return f"[{_COLOURS[verdict]}]{verdict}[/]"


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'s' * (number != 1)}"
