"""The command line `cspm`."""

from __future__ import annotations

import sys
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from cspm_bringup.library import find_scenario, scenario_names
from cspm_msgs_py.errors import CspmError, InputError

app = typer.Typer(
    help="A cable-suspended test-bed in software. Begin with `cspm run worst_case`.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
RUN_FAILED = 1

Json = Annotated[
    Path | None, typer.Option("--json", metavar="FILE", help="Also write what is printed as JSON.")
]


def main() -> None:
    """Run the command line; every error of ours is one line on stderr and an exit code."""
    try:
        app()
    except CspmError as err:
        print(f"cspm: {err}", file=sys.stderr)  # noqa: T201 - the command line's voice
        sys.exit(err.exit_code)


@app.command(
    epilog=f"Scenarios: {', '.join(scenario_names())}. Any scenario file works as well.",
)
def run(
    scenario: Annotated[str, typer.Argument(help="A scenario's name, or a scenario file.")],
    mode: Annotated[str, typer.Option(help="How to run: inprocess.")] = "inprocess",
    duration: Annotated[
        float | None, typer.Option(help="Simulated time [s], instead of the scenario's.")
    ] = None,
    seed: Annotated[
        int | None, typer.Option(help="Seed of waves and sensors, instead of the scenario's.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for the recording [default: recordings/SCENARIO-DATE-TIME]."),
    ] = None,
    record: Annotated[bool, typer.Option(help="Whether to record.")] = True,
    overrides: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="Put a scenario key first, such as target.motion.peak_period=2; may be repeated.",
        ),
    ] = None,
    json: Json = None,
) -> None:
    """Simulate a scenario: record it, draw it, and tell how well the bar followed."""
    if mode != "inprocess":
        raise InputError(f"--mode {mode}: allowed: inprocess")
    from cspm_bringup.commands import run_command

    settings = [f"duration={duration}"] * (duration is not None)
    settings += [f"seed={seed}"] * (seed is not None)
    folder = out if out is not None else _new_folder(Path(scenario).stem)
    path = find_scenario(scenario)
    finished = run_command(path, [*(overrides or []), *settings], folder if record else None, json)
    raise typer.Exit(0 if finished else RUN_FAILED)


def _new_folder(name: str) -> Path:
    return Path("recordings") / f"{name}-{datetime.now():%Y%m%d-%H%M%S}"


@app.command()
def info(
    bag: Annotated[Path, typer.Argument(help="A recording: its folder or its file.")],
    json: Json = None,
) -> None:
    """Show a recording's topics, rates, gaps, duration and scenario."""
    from cspm_bringup.commands import info_command

    info_command(bag, json)


@app.command()
def recover(
    bag: Annotated[Path, typer.Argument(help="A recording that was cut short.")],
    out: Annotated[
        Path | None, typer.Option(help="Where to write instead of mending in place.")
    ] = None,
    json: Json = None,
) -> None:
    """Restore a recording whose writer was killed, with its index and metadata."""
    from cspm_bringup.commands import recover_command

    recover_command(bag, out, json)


@app.command()
def resim(
    bag: Annotated[Path, typer.Argument(help="A recording made by cspm.")], json: Json = None
) -> None:
    """Repeat a run from its recording alone, and say whether every message is identical."""
    from cspm_bringup.commands import resim_command

    raise typer.Exit(0 if resim_command(bag, json) else RUN_FAILED)
