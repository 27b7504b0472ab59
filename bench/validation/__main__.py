"""Measure all that `make validate` measures, and write results/validation-runs.md."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from rich.console import Console

from bench.markdown import markdown_table
from bench.performance.host import describe_machine
from bench.validation import blind_slice, coverage_check, generated_pages
from bench.validation.check import Check, Finding

PAGE = Path(__file__).resolve().parents[2] / "results" / "validation-runs.md"
CHECKS = (*coverage_check.CHECKS, *blind_slice.CHECKS, *generated_pages.CHECKS)
_HEAD = """\
# Validation runs

Measurements over many runs, with bounds that were fixed beforehand. `make validate` makes them anew
and writes this page; it fails where a bound does not hold. The tests hold a smaller case of each.
Other measurements have pages of their own: [speed](performance.md), [results](../docs/results.md),
[the blind benchmark](sealed/README.md), [intervals](intervals.md).
"""


class Measured(NamedTuple):
    """A check, what it found and how long it took [s]."""

    check: Check
    findings: Sequence[Finding]
    seconds: float


def page_of(measured: Sequence[Measured]) -> str:
    """Return the page in Markdown."""
    machine = describe_machine()
    parts = [_HEAD, f"Measured {machine['date']} on {machine['processor']}; {machine['software']}."]
    for check, findings, seconds in measured:
        rows = [
            (quantity, found, allowed, "yes" if holds else "**no**")
            for quantity, found, allowed, holds in findings
        ]
        table = markdown_table(("quantity", "found", "allowed", "holds"), rows)
        parts += [f"\n## {check.name}\n", f"{check.what}. {seconds / 60.0:.1f} minutes.\n", table]
    return "\n".join(parts) + "\n"


def main() -> int:
    """Run the command line; return 1 if a bound does not hold."""
    parser = argparse.ArgumentParser(prog="python -m bench.validation", description=__doc__)
    parser.add_argument("words", nargs="*", metavar="WORD", help="only checks with it in the name")
    words = parser.parse_args().words
    console, measured = Console(), []
    for check in CHECKS:
        if words and not any(word in check.name for word in words):
            continue
        begun = time.monotonic()
        findings = check.measure()
        measured.append(Measured(check, findings, time.monotonic() - begun))
        for finding in findings:
            mark = "[green]holds[/]" if finding.holds else "[red]does not hold[/]"
            console.print(f"{mark}  {finding.quantity}: {finding.found}, allowed {finding.allowed}")
    if not words:
        PAGE.write_text(page_of(measured), encoding="utf-8")
    return int(not all(finding.holds for each in measured for finding in each.findings))


if __name__ == "__main__":
    sys.exit(main())
