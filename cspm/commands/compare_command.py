"""The command `cspm compare`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table

from cspm.commands.progress_shown import shown
from cspm.comparison import compare
from cspm_ident.block_simulation import Input
from cspm_ident.comparison.channel_fit import ChannelFit
from cspm_ident.comparison.compare import Comparison
from cspm_msgs_py.new_folder import refuse_existing
from cspm_run.library import named_testbed
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json


@dataclass(frozen=True)
class CompareRequest:
    """Options of the command.

    Attributes:
        recording: what to compare.
        testbed: the machine to simulate, instead of the recorded one.
        drive: which measured signals drive the simulation.
        horizon: longest window [s].
        delays: delays of sensors by topic [s]; None estimates them.
        repeat: a second recording of the same experiment.
        out: a new folder for the report page; None writes nothing.
    """

    recording: Path
    testbed: Path | None
    drive: Input
    horizon: float | None
    delays: Mapping[str, float] | None
    repeat: Path | None
    out: Path | None


def compare_command(request: CompareRequest, json: Path | None) -> None:
    """Compare a recording with its simulation, print, and write the requested report.

    Raises:
        InputError: recording, test-bed or options cannot be used.
    """
    console = make_console()
    refuse_existing(request.out)
    with shown(console, "reading") as progress:
        compared = compare(
            request.recording,
            testbed=None if request.testbed is None else named_testbed(request.testbed),
            drive=request.drive.value,
            horizon=request.horizon,
            delays=request.delays,
            repeat=request.repeat,
            progress=progress,
        )
        written = None if request.out is None else compared.write(request.out)
    print_comparison(console, compared.result)
    if written is not None:
        say(console, f"report {written}")
    if json is not None:
        write_json(json, compared.data() | {"report": None if written is None else str(written)})


def print_comparison(console: Console, found: Comparison) -> None:
    """Print the sensors' delays and a table of channels for the whole and each block."""
    for line in found.clocks:
        say(console, line)
    titles = {
        "whole": f"whole, from measured {found.drive.value}",
        "winch": "winches alone, from measured torques and tensions",
        "cable": "cables alone, from measured winch and bar motion",
        "bar": "bar alone, from measured tensions",
    }
    for block, title in titles.items():
        channels = [channel for channel in found.channels if channel.block == block]
        if channels:
            say(console, f"\n{title}")
            console.print(_table(channels))
    for block, reason in found.left_out.items():
        say(console, f"{block}: left out, {reason}")
    if found.windows[1]:
        say(console, f"{found.windows[1]} of {found.windows[0]} windows diverged and are left out")


def _table(channels: list[ChannelFit]) -> Table:
    table = Table(box=box.SIMPLE_HEAD, show_edge=False, padding=(0, 1, 0, 0))
    table.add_column("channel", no_wrap=True)
    for column in ("VAF %", "NRMSE", "RMS error", "floor", "bias", "lag ms"):
        table.add_column(column, justify="right", no_wrap=True)
    for c in channels:
        table.add_row(
            f"{c.name} {c.unit}",
            "at rest" if c.vaf is None else f"{c.vaf:.3f}",
            "" if c.nrmse is None else f"{c.nrmse:.4f}",
            f"{c.rms:.3g}",
            f"{c.floor:.3g}",
            f"{c.bias:.2g}",
            "" if c.lag is None else f"{round(1e3 * c.lag, 2) + 0.0:.2f}",
        )
    return table
