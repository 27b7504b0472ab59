"""A run's summary, for people and for programs."""

from __future__ import annotations

from typing import Any

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.scenario import Requirement
from cspm_msgs_py.stepping.delay_histogram import UP_TO_MS, DelayHistogram
from cspm_run.output.console import say
from cspm_run.run_result import RunResult

# Of the bounds by which delays are counted.
_SHOWN_MS = (1.0, 2.0, 5.0, 20.0)


def summary_data(result: RunResult) -> dict[str, Any]:
    """Return the content of `summary.json`; errors in m and rad, tensions in N."""
    statistics = result.statistics
    low, high = statistics.tension_range
    errors = zip(DOFS, statistics.max_error, statistics.rms_error, strict=True)
    found = {
        "scenario": result.scenario,
        "seed": result.seed,
        "mode": result.mode,
        "duration_s": result.simulated,
        "real_time_factor": result.real_time_factor,
        "errors": {dof: {"max": float(peak), "rms": float(rms)} for dof, peak, rms in errors},
        "tension": {"min": low, "max": high},
        "slack_share": statistics.slack_share,
        "infeasible_share": statistics.infeasible_share,
        "saturation": {
            each.drive: {"share": each.share, "longest_s": each.longest}
            for each in result.saturation
        },
        "controlled": list(result.controlled),
        "messages": result.messages,
        "warnings": warned(result),
    }
    if result.timing:
        found["realtime"] = result.timing
    if result.delays is not None:
        found["torque_delays"] = {"up_to_ms": [*UP_TO_MS, None], "commands": result.delays.counts}
    return found


def warned(result: RunResult) -> list[str]:
    """Return all that a run warns of, a line each."""
    return [*result.warnings, *([result.limits_met] if result.limits_met else [])]


def print_summary(console: Console, result: RunResult, requirement: Requirement) -> None:
    """Print pose errors (against the requirement where a controller ran), tensions and speed.

    And what the run warns of.
    """
    data = summary_data(result)
    if result.has_bar and result.statistics.steps:
        console.print(_error_table(result, data["errors"], requirement))
    if result.timing:
        console.print(_timing_table(result.timing))
    if result.delays is not None and result.delays.total:
        console.print(_delays(result.delays), soft_wrap=True)
    tension = f"tensions {data['tension']['min']:.2f} to {data['tension']['max']:.2f} N"
    console.print(
        f"{tension} · any cable slack {data['slack_share']:.2%} of the time · commanded wrench"
        f" infeasible (tension limits) {data['infeasible_share']:.1%} of the time",
        soft_wrap=True,
    )
    for line in warned(result):
        say(console, f"warning: {line}")
    console.print(f"simulated {result.simulated:g} s at {result.real_time_factor:.1f} × real time")


def _error_table(
    result: RunResult, errors: dict[str, dict[str, float]], requirement: Requirement
) -> Table:
    what = "reference − pose" if result.controlled else "mean pose − pose, nothing controls it"
    table = Table(title=f"{escape(result.scenario)}, seed {result.seed}: {what}")
    columns = ["", "max", "RMS"] + ["required", "within"] * bool(result.controlled)
    for column in columns:
        table.add_column(column, justify="right" if column else "left")
    for i, dof in enumerate(DOFS):
        limit, unit = (requirement.position, "mm") if i < 3 else (requirement.angle, "mrad")
        cells = [dof] + [f"{1e3 * errors[dof][kind]:.3f} {unit}" for kind in ("max", "rms")]
        if result.controlled:
            cells += [f"± {1e3 * limit:g} {unit}", _verdict(errors[dof], limit)]
        table.add_row(*cells)
    return table


def _timing_table(timing: dict[str, dict[str, float]]) -> Table:
    """Return what each node reported of its deadlines; a cell is empty where it has none."""
    table = Table(title="real time: totals of the run", box=box.SIMPLE, pad_edge=False)
    keys = list(dict.fromkeys(key for reported in timing.values() for key in reported))
    table.add_column("node", no_wrap=True)
    for key in keys:
        # Two lines each, so that all columns fit into 80 characters.
        heading = key.replace("_", "\n", 1).replace("latency_ms", "late, ms")
        table.add_column(heading, justify="right", no_wrap=True)
    for node, reported in timing.items():
        table.add_row(node, *(f"{reported[key]:g}" if key in reported else "" for key in keys))
    return table


def _delays(delays: DelayHistogram) -> str:
    """Return in words how late torque commands came."""
    within = [f"{1.0 - delays.share_above(bound):.2%} within {bound:g} ms" for bound in _SHOWN_MS]
    return f"torque commands after their measurement: {', '.join(within)}"


def _verdict(error: dict[str, float], limit: float) -> str:
    if error["max"] <= limit:
        return "[green]always[/]"
    return "[yellow]RMS only[/]" if error["rms"] <= limit else "[red]no[/]"
