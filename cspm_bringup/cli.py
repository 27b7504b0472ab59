"""The command line `cspm`."""

from __future__ import annotations

import sys
from datetime import datetime
from itertools import chain, count
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from cspm_bringup.library import find_scenario, scenario_names
from cspm_msgs_py.errors import CspmError, InputError

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
RUN_FAILED = 1
BAD_USAGE = 2
INTERRUPTED = 130
# Typer exports few of the errors that wrong usage gives; this is the class of all.
_UsageError: type[typer.BadParameter] = typer.BadParameter.__bases__[0]


def _usable_json(path: Path | None) -> Path | None:
    """Refuse a file that cannot be written before the work that fills it."""
    if path is not None and (path.is_dir() or not path.absolute().parent.is_dir()):
        raise InputError(f"--json {path}: allowed: a file in a folder that exists")
    return path


Json = Annotated[
    Path | None,
    typer.Option(
        "--json",
        metavar="FILE",
        help="Also write as JSON what is printed.",
        callback=_usable_json,
    ),
]


def main() -> None:
    """Run the command line; every error is one line on stderr and an exit code."""
    try:
        code = typer.main.get_command(app).main(prog_name="cspm", standalone_mode=False)
    except CspmError as err:
        _fail(str(err), err.exit_code)
    except _UsageError as err:
        command = err.ctx.command_path if err.ctx else "cspm"
        _fail(f"{err.format_message().rstrip('.')}; see `{command} --help`", BAD_USAGE)
    except OSError as err:
        _fail(f"{err.filename or 'system'}: {err.strerror or err}", RUN_FAILED)
    except typer.Abort:
        code = INTERRUPTED
    sys.exit(code)


def _fail(text: str, code: int) -> NoReturn:
    print(f"cspm: {' '.join(text.split())}", file=sys.stderr)  # noqa: T201 - the command line's voice
    sys.exit(code)


@app.callback(invoke_without_command=True)
def overview(context: typer.Context) -> None:
    """A cable-suspended test-bed in software: 8 elastic cables carry a bar below moving winches.

    Begin with `cspm run worst_case`. `cspm COMMAND --help` explains a command.
    """
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


@app.command(
    epilog=f"""Scenarios: {", ".join(scenario_names())}; any scenario file works as well.

Examples:

cspm run calm --duration 60 --out calm_60s

cspm run my_scenario.yaml --seed 2 --no-record --json result.json

cspm run worst_case --set sensors=ideal --set rates.motion_controller=100

Exit code: 0 done, 1 diverged or interrupted, 2 unusable input.""",
)
def run(
    scenario: Annotated[
        str, typer.Argument(metavar="SCENARIO", help="A scenario's name, or a scenario file.")
    ],
    mode: Annotated[
        str, typer.Option(metavar="MODE", help="How to run: inprocess, all in one process.")
    ] = "inprocess",
    plant: Annotated[
        str,
        typer.Option(
            metavar="PLANT",
            help="Whose equations to simulate: sim, or mujoco, a second implementation on the"
            " MuJoCo engine.",
        ),
    ] = "sim",
    duration: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", help="Simulated time, instead of the scenario's."),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(
            metavar="NUMBER",
            help="Seed of waves and sensor noise, instead of the scenario's. The same seed gives"
            " the same run, bit for bit.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="A new folder for the recording, its summary.json and its run.png;"
            " otherwise recordings/SCENARIO-DATE-TIME.",
        ),
    ] = None,
    record: Annotated[bool, typer.Option(help="Whether to record.")] = True,
    overrides: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="Replace a value of the scenario, in its units (SI, rad), such as"
            " target.motion.peak_period=2; may be repeated.",
        ),
    ] = None,
    json: Json = None,
) -> None:
    """Simulate a scenario: record it, draw it, and tell how well the bar followed.

    Ctrl-C ends the run early with a complete recording.
    """
    if mode != "inprocess":
        raise InputError(f"--mode {mode}: allowed: inprocess")
    from cspm_bringup.commands import run_command
    from cspm_bringup.plants import PLANTS

    if plant not in PLANTS:
        raise InputError(f"--plant {plant}: allowed: {', '.join(PLANTS)}")
    settings = [f"duration={duration}"] * (duration is not None)
    settings += [f"seed={seed}"] * (seed is not None)
    folder = out if out is not None else _new_folder(Path(scenario).stem)
    path = find_scenario(scenario)
    place = folder if record else None
    finished = run_command(path, [*(overrides or []), *settings], place, json, plant)
    raise typer.Exit(0 if finished else RUN_FAILED)


def _new_folder(name: str) -> Path:
    first = Path("recordings") / f"{name}-{datetime.now():%Y%m%d-%H%M%S}"
    later = (first.with_name(f"{first.name}-{number}") for number in count(2))
    return next(folder for folder in chain([first], later) if not folder.exists())


@app.command(epilog="Example: cspm info recordings/calm-20260131-120000")
def info(
    bag: Annotated[
        Path, typer.Argument(metavar="BAG", help="A recording: its folder or its MCAP file.")
    ],
    json: Json = None,
) -> None:
    """Show a recording's topics, rates in Hz, longest gaps in ms, duration and scenario."""
    from cspm_bringup.commands import info_command

    info_command(bag, json)


@app.command(epilog="Example: cspm recover recordings/calm-20260131-120000 --out restored")
def recover(
    bag: Annotated[
        Path,
        typer.Argument(
            metavar="BAG", help="A recording that was cut short: its folder or its MCAP file."
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="A new folder to write to. Otherwise the recording is mended in place, and the"
            " original is kept with .broken added to its name.",
        ),
    ] = None,
    json: Json = None,
) -> None:
    """Restore a recording whose writer was killed, with its index and metadata.

    At most the last 0.2 s before the kill are lost.
    """
    from cspm_bringup.commands import recover_command

    recover_command(bag, out, json)


@app.command(
    epilog="""Example: cspm resim recordings/calm-20260131-120000

Exit code: 0 identical, 1 different, 2 no recording made by cspm."""
)
def resim(
    bag: Annotated[
        Path, typer.Argument(metavar="BAG", help="A recording made by cspm: its folder or file.")
    ],
    json: Json = None,
) -> None:
    """Repeat a run from its recording alone, and say whether every message is identical.

    Bit for bit, in every field. Otherwise the first difference is told: topic, message, field.
    """
    from cspm_bringup.commands import resim_command

    raise typer.Exit(0 if resim_command(bag, json) else RUN_FAILED)
