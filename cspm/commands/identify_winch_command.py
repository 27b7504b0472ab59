"""The command `cspm identify winch`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from cspm.commands.identify_outcome import hand_out, interval_text
from cspm.commands.progress_shown import shown
from cspm.identification.winches import identify_winch
from cspm_ident.winch.identified_winch import IdentifiedWinch, WinchesResult
from cspm_run.library import named_testbed
from cspm_run.output.console import make_console, say

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
        reversals: whether windows with a reversal of the shaft count; None: where needed.
        band: frequency band of the torque errors [Hz]; None for the default one.
        leave_out_regimes: whether to leave out stretches that do not belong to the rest.
        out: a new folder for pictures and fitted test-bed; None writes nothing.
    """

    recordings: tuple[Path, ...]
    held_out: tuple[Path, ...]
    testbed: Path | None
    winches: tuple[str, ...]
    effects: tuple[str, ...]
    torque_age: float | None
    reversals: bool | None
    band: float | None
    out: Path | None
    leave_out_regimes: bool = False


def identify_winch_command(request: WinchRequest, json: Path | None) -> bool:
    """Identify winches, print the results, and write the requested files.

    Returns whether all parameters are a result.

    Raises:
        InputError: recordings, test-bed or options cannot be used.
    """
    console = make_console()
    with shown(console, "reading") as progress:
        found = identify_winch(
            request.recordings,
            held_out=request.held_out,
            testbed=None if request.testbed is None else named_testbed(request.testbed),
            winches=request.winches,
            effects=request.effects,
            torque_age=request.torque_age,
            reversals=request.reversals,
            band=request.band,
            leave_out_regimes=request.leave_out_regimes,
            progress=progress,
        )
    return hand_out(found, print_winches, request.out, json)


def print_winches(console: Console, result: WinchesResult) -> None:
    """Print parameters with intervals, parameters not excited, and the fit of the torques."""
    for winch in result.winches:
        console.print(_table(winch))
        for direction in winch.fit.estimate.unexcited:
            say(console, f"not excited: {direction.name}; its values are no result")
        for line in _remarks(winch, result.torque_age):
            say(console, line)
    if result.standing:
        say(console, f"no motion, so nothing identified: {', '.join(result.standing)}")
    console.print(_error_table(result))


def _remarks(winch: IdentifiedWinch, torque_age: float) -> Iterator[str]:
    """Yield what was left out or taken into account."""
    for path, times in winch.jumps:
        shown = ", ".join(f"{time:.3f}" for time in times[:5]) + (", …" * (len(times) > 5))
        yield (
            f"{path.name}: the angle of {winch.name} jumps {len(times)} times, at {shown} s; left"
            " out. A counter that rolls over: `wrap` in the mapping"
        )
    if winch.from_speed:
        yield f"{winch.name}: accelerations from the drive's speed; the angle is too noisy for them"
    late = winch.lateness
    if late is None:
        yield f"torque taken to act {1e3 * torque_age:g} ms before its stamp"
    else:
        low, high = (1e3 * end for end in late.ci95)
        word = "late" if late.age > late.stated else "early"
        yield (
            f"{winch.name}: the torque acts {1e3 * late.age:.4g} ({low:.4g} … {high:.4g}) ms before"
            f" its stamp, not {1e3 * late.stated:g}: it is {word} against the angle. Taken into"
            f" account, which takes the residual from {late.error[0]:.3g} to {late.error[1]:.3g} %"
        )
    if winch.torn:
        yield _torn_text(winch)


def _torn_text(winch: IdentifiedWinch) -> str:
    other = winch.otherwise
    values = [f"{name} {other.estimate.value(name):.5g}" for name in winch.torn] if other else []
    role = "left out" if winch.reversals else "counted"
    return (
        f"with windows {role} in which the shaft reverses: {', '.join(values)}. Dry friction sticks"
        " there, and these windows say something else than the rest"
        + (": consider --without-reversals" if winch.reversals else "")
    )


def _table(winch: IdentifiedWinch) -> Table:
    estimate = winch.fit.estimate
    title = f"{winch.name}: {estimate.method}, 95 % intervals"
    table = Table(title=escape(title), box=box.SIMPLE)
    for column in ("parameter", "unit", "described", "found", "found at the drum's rim"):
        table.add_column(column, justify="right" if column == "described" else "left")
    for name, unit in zip(estimate.names, estimate.units, strict=True):
        found, rim = _cells(winch, name, unit)
        table.add_row(name, unit, f"{winch.described[name]:.5g}", found, rim)
    return table


def _cells(winch: IdentifiedWinch, name: str, unit: str) -> tuple[str, str]:
    """Return what was found of a parameter, at the shaft and at the drum's rim."""
    estimate = winch.fit.estimate
    value, ends = estimate.value(name), estimate.interval(name)
    if not all(isfinite(end) for end in ends):
        return f"{value:.5g}, not excited", ""
    if name not in winch.valid:
        return "no result", ""
    text = interval_text(value, ends, 5) + (", none seen" if name in winch.unseen else "")
    if unit not in _AT_RIM:
        return text, ""
    rim_unit, power = _AT_RIM[unit]
    factor = winch.radius**-power
    low, high = (factor * end for end in ends)
    return text, f"{interval_text(factor * value, (low, high), 5)} {rim_unit}"


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
