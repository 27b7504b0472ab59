"""The command `cspm identify winch`."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from cspm.commands.identify_outcome import hand_out, interval_text
from cspm.identification import identify_winch
from cspm_ident.winch.identify_winches import (
    IdentifiedWinch,
    WinchesResult,
)
from cspm_msgs_py.new_folder import refuse_existing
from cspm_msgs_py.testbed import load_testbed
from cspm_run.console import make_console, say

# Unit at the shaft to unit at the drum's rim, and the power of the radius that converts them.
_AT_RIM = {"kg·m²": ("kg", 2), "N·m·s/rad": ("N·s/m", 2), "N·m": ("N", 1)}


@dataclass(frozen=True)
class WinchRequest:
    """Options of the command line.

    Attributes:
        recordings: to fit.
        held_out: for validation only.
        testbed: the machine's file, instead of the recorded one.
        winches: names of their cables; none for all.
        effects: to fit beside the inertia; none for the default ones.
        torque_age: see `WinchSignals` [s]; None for the first recording's.
        reversals: whether windows with a reversal of the shaft count.
        band: frequency band of the torque errors [Hz]; None for the default one.
        out: a new folder for pictures and fitted test-bed; None writes nothing.
    """

    recordings: tuple[Path, ...]
    held_out: tuple[Path, ...]
    testbed: Path | None
    winches: tuple[str, ...]
    effects: tuple[str, ...]
    torque_age: float | None
    reversals: bool
    band: float | None
    out: Path | None


def identify_winch_command(asked: WinchRequest, json: Path | None) -> None:
    """Identify winches, print the results, and write the requested files.

    Raises:
        InputError: recordings, test-bed or options cannot be used.
    """
    refuse_existing(asked.out)
    with make_console().status("") as status:
        found = identify_winch(
            asked.recordings,
            held_out=asked.held_out,
            testbed=None if asked.testbed is None else load_testbed(asked.testbed),
            winches=asked.winches,
            effects=asked.effects,
            torque_age=asked.torque_age,
            reversals=asked.reversals,
            band=asked.band,
            progress=lambda _, what: status.update(escape(what)),
        )
    hand_out(found, print_winches, asked.out, json)


def print_winches(console: Console, result: WinchesResult) -> None:
    """Print parameters with intervals, parameters not excited, and the fit of the torques."""
    for winch in result.winches:
        console.print(_table(winch))
        for direction in winch.fit.estimate.unexcited:
            say(console, f"not excited: {direction.name}; its values are no result")
        if winch.torn:
            say(console, _torn_text(winch, result.reversals))
    say(console, f"torque taken to act {1e3 * result.torque_age:g} ms before its stamp")
    console.print(_error_table(result))


def _torn_text(winch: IdentifiedWinch, reversals: bool) -> str:
    other = winch.otherwise
    values = [f"{name} {other.estimate.value(name):.5g}" for name in winch.torn] if other else []
    role = "left out" if reversals else "counted"
    return (
        f"with windows {role} in which the shaft turns round: {', '.join(values)}. Dry friction"
        " sticks there, and these windows say something else than the rest"
        + (": consider --without-reversals" if reversals else "")
    )


def _table(winch: IdentifiedWinch) -> Table:
    estimate = winch.fit.estimate
    title = f"{winch.name}: {estimate.method}, 95 % intervals"
    table = Table(title=escape(title), box=box.SIMPLE)
    for column in ("parameter", "unit", "described", "found", "found at the drum's rim"):
        table.add_column(column, justify="right" if column == "described" else "left")
    for name, unit in zip(estimate.names, estimate.units, strict=True):
        value, ends = estimate.value(name), estimate.interval(name)
        seen = all(isfinite(end) for end in ends)
        text = interval_text(value, ends, 5) if seen else f"{value:.5g}, not excited"
        rim = ""
        if seen and unit in _AT_RIM:
            rim_unit, power = _AT_RIM[unit]
            factor = winch.radius**-power
            low, high = (factor * end for end in ends)
            rim = f"{interval_text(factor * value, (low, high), 5)} {rim_unit}"
        table.add_row(name, unit, f"{winch.described[name]:.5g}", text, rim)
    return table


def _error_table(result: WinchesResult) -> Table:
    title = f"error of the torque below {result.band:g} Hz, 100·|τ − τ̂|/|τ|"
    table = Table(title=escape(title), box=box.SIMPLE)
    for column in ("winch", "recording", "described %", "fitted %"):
        table.add_column(column, justify="right" if column.endswith("%") else "left")
    for winch in result.winches:
        for each in winch.judgements:
            name = escape(each.measurement.path.name) + (", held out" if each.held_out else "")
            shares = (f"{found.percent:.2f}" for found in each.errors.values())
            table.add_row(winch.name, name, *shares)
    return table
