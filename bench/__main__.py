"""Measure everything and print one table."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from bench.performance.closed_loop import measure_closed_loop
from bench.performance.figure_table import print_report
from bench.performance.graph_speed import measure_graph
from bench.performance.host import describe_machine, is_busy
from bench.performance.loop_share import measure_loop_share
from bench.performance.measured_figure import Advance, Figure
from bench.performance.memory import measure_memory
from bench.performance.plant_speed import measure_against_mujoco, measure_plant
from bench.performance.reaction import print_reactions
from bench.performance.start_up import measure_start_up
from bench.performance.volume import QUICK, USUAL, Volume, full
from cspm_msgs_py.errors import InputError
from cspm_ros.runtime.ros_install import find_ros


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m bench", description=__doc__)
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="half a minute: fewer, shorter runs")
    size.add_argument(
        "--full",
        action="store_true",
        help="record the whole hour: 6 GB on disk; 10 minutes in real time",
    )
    size.add_argument("--reactions", type=int, metavar="N", help="kill and stop nodes N times each")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures as JSON")
    arguments = parser.parse_args()
    if arguments.reactions:
        print_reactions(Console(), arguments.reactions)
        return
    volume = QUICK if arguments.quick else full(USUAL) if arguments.full else USUAL
    console = Console()
    machine = describe_machine()
    if is_busy():
        console.print("[yellow]other programs are at work[/]: the figures will be too low")
    figures = _measure(volume, console)
    print_report(console, machine, figures)
    if arguments.json is not None:
        data = {"machine": machine, "figures": [figure.data() for figure in figures]}
        arguments.json.write_text(json.dumps(data, indent=2, ensure_ascii=False) + "\n")


def _measure(volume: Volume, console: Console) -> list[Figure]:
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=console,
        transient=True,
    ) as progress:
        task = progress.add_task("building", total=volume.parts)

        def advance(group: str) -> None:
            progress.update(task, description=group, advance=1)

        return _figures(volume, advance)


def _figures(volume: Volume, advance: Advance) -> list[Figure]:
    return [
        *measure_plant(volume.plant, advance),
        *measure_against_mujoco(volume.plant, advance),
        *measure_closed_loop(volume.loops, volume.loop_duration, advance),
        *measure_loop_share(volume.loops, volume.share_duration, advance),
        *_graph(volume, advance),
        *measure_start_up(volume.first_runs, volume.later_runs, advance),
        *measure_memory(volume.silent_duration, False, advance),
        *measure_memory(volume.recorded_duration, True, advance),
    ]


def _graph(volume: Volume, advance: Advance) -> list[Figure]:
    try:
        find_ros("bench")
    except InputError:
        return []
    return measure_graph(volume.graphs, volume.graph_duration, volume.realtime_duration, advance)


if __name__ == "__main__":
    main()
