"""A run's summary, for people and for programs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from cspm_bringup.run import MODE, RunResult
from cspm_msgs_py.scenario import DOFS, Requirement


def summary_data(result: RunResult) -> dict[str, Any]:
    """Return the content of `summary.json`; errors in m and rad, tensions in N."""
    tally = result.tally
    low, high = tally.tension_range
    errors = zip(DOFS, tally.max_error, tally.rms_error, strict=True)
    return {
        "scenario": result.scenario,
        "seed": result.seed,
        "mode": MODE,
        "duration_s": result.simulated,
        "real_time_factor": result.real_time_factor,
        "errors": {dof: {"max": float(peak), "rms": float(rms)} for dof, peak, rms in errors},
        "tension": {"min": low, "max": high},
        "slack_share": tally.slack_share,
        "infeasible_share": tally.infeasible_share,
        "messages": result.messages,
    }


def write_json(path: Path, data: Any) -> None:  # noqa: ANN401 - any plain data
    """Write plain data as JSON."""
    path.write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8")


def print_summary(console: Console, result: RunResult, requirement: Requirement) -> None:
    """Print errors against the requirement, tensions and speed."""
    data = summary_data(result)
    table = Table(title=f"{result.scenario}, seed {result.seed}, {result.simulated:g} s")
    for column in ("", "max error", "RMS error", "required", "RMS within"):
        table.add_column(column, justify="left" if not column else "right")
    for i, dof in enumerate(DOFS):
        error, limit, scale, unit = data["errors"][dof], requirement.angle, 1e3, "mrad"
        if i < 3:
            limit, unit = requirement.position, "mm"
        table.add_row(
            dof,
            f"{error['max'] * scale:.3f} {unit}",
            f"{error['rms'] * scale:.3f} {unit}",
            f"± {limit * scale:g} {unit}",
            "[green]yes[/]" if error["rms"] <= limit else "[red]no[/]",
        )
    if result.tally.steps:
        console.print(table)
    console.print(
        f"tensions {data['tension']['min']:.2f} to {data['tension']['max']:.2f} N · any cable slack"
        f" {data['slack_share']:.2%} of the time · wrench infeasible"
        f" {data['infeasible_share']:.1%} · {result.real_time_factor:.1f} × real time"
    )
