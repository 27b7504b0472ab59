"""The command line `cspm`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextvars import copy_context
from importlib import import_module
from importlib.metadata import version as metadata_version
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from cspm.cli.app import RUN_FAILED, Json, app, new_folder
from cspm.cli.shared_options import COMMAND, Browser, Effects, Overrides, Port, add_shared_options
from cspm_msgs_py.control_spec.motion_laws import MOTION_LAWS
from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.garbage import look_seldom
from cspm_msgs_py.new_folder import refuse_existing
from cspm_run.library import find_scenario, find_testbed, scenario_names

MODES = ("inprocess", "graph", "processes", "realtime")
BAD_USAGE = 2
INTERRUPTED = 130
# Typer exports few of the errors that wrong usage gives; this is the class of all.
_UsageError: type[typer.BadParameter] = typer.BadParameter.__bases__[0]


def main() -> None:
    """Run the command line; every error is one line on stderr and an exit code."""
    look_seldom()
    # They add their commands when they are loaded.
    import_module("cspm.cli.recordings")
    import_module("cspm.cli.data")
    import_module("cspm.cli.compare")
    import_module("cspm.cli.analyze")
    import_module("cspm.cli.diagnose")
    import_module("cspm.cli.identify")
    import_module("cspm.cli.view")
    import_module("cspm.cli.demo")
    import_module("cspm.cli.ros")
    import_module("cspm.cli.new")
    import_module("cspm.cli.campaign")
    import_module("cspm.cli.fmu")
    import_module("cspm.cli.installation")
    run_app(app, "cspm")


def run_app(commands: typer.Typer, name: str) -> NoReturn:
    """Run commands as the program `name`; every error is one line on stderr and an exit code."""
    # What a command sets, its name and about its output, ends with it.
    context = copy_context()

    def fail(text: str, code: int) -> NoReturn:
        _fail(context.get(COMMAND) or name, text, code)

    try:
        root = typer.main.get_command(commands)
        add_shared_options(root)
        code = context.run(root.main, prog_name=name, standalone_mode=False)
    except CspmError as err:
        fail(err.line, err.exit_code)
    except _UsageError as err:
        command = err.ctx.command_path if err.ctx else name
        said = err.format_message().rstrip(".")
        line = f"{said}{'' if said.endswith('?') else ';'} see `{command} --help`"
        _fail(command, line, BAD_USAGE)
    except OSError as err:
        fail(f"{err.filename or 'system'}: {err.strerror or err}", RUN_FAILED)
    except typer.Abort:
        code = INTERRUPTED
    sys.exit(code)


def _fail(command: str, text: str, code: int) -> NoReturn:
    """Print one line that begins with the command's name, and end with a code."""
    line, words = " ".join(text.split()), command.split()
    for first in range(1, len(words)):
        line = line.removeprefix(f"{' '.join(words[first:])}: ")
    print(f"{command}: {line}", file=sys.stderr)  # noqa: T201 - the command line's voice
    sys.exit(code)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"cspm {metadata_version('cspm')}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def overview(
    context: typer.Context,
    _: Annotated[
        bool,
        typer.Option(
            "--version", help="Show the version and exit.", is_eager=True, callback=_show_version
        ),
    ] = False,
) -> None:
    """A cable-suspended test-bed in software: 8 elastic cables carry a bar below moving winches.

    Begin with `cspm run worst_case worst_case_past_thesis`.
    `cspm COMMAND --help` explains a command.
    """
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


@app.command(
    epilog=f"""Scenarios: {", ".join(scenario_names())}; any scenario file works as well.

Examples:

cspm run calm --duration 60 --out calm_60s

cspm run worst_case worst_case_past_thesis

cspm run calm --controllers pid,lqr --duration 60

cspm run calm --effect winch_coulomb_friction@sway_3:torque=0.02 --out worn

cspm run my_scenario.yaml --seed 2 --no-record --json result.json

cspm run worst_case --set sensors=ideal --set rates.motion_controller=100

cspm run calm --testbed fitted/fitted_testbed.yaml

cspm run calm --mode graph

cspm run calm --view --effect winch_coulomb_friction@sway_3:torque=0.02

cspm run calm --mode realtime --plant external

cspm run rest --mode realtime --anyway

Exit code: 0 done, 1 diverged or interrupted, 2 unusable input.""",
)
def run(
    scenarios: Annotated[
        list[str],
        typer.Argument(
            metavar="SCENARIO...",
            help="A scenario's name, or a scenario file. Several run at once, a process each, and"
            " are shown side by side.",
        ),
    ],
    mode: Annotated[
        str,
        typer.Option(
            metavar="MODE",
            help="How to run: inprocess, without ROS; graph, ROS 2 nodes in one process; processes,"
            " a process per node; these three give the same messages, bit for bit. realtime:"
            " ROS 2 nodes paced by the wall clock.",
        ),
    ] = MODES[0],
    plant: Annotated[
        str,
        typer.Option(
            metavar="PLANT",
            help="Whose equations to simulate: sim, or mujoco, a second implementation on the"
            " MuJoCo engine; or those of a file, a unit of FMI 2; or external, nobody's: your"
            " drivers take the plant's place.",
        ),
    ] = "sim",
    one_process: Annotated[
        bool | None,
        typer.Option(
            "--one-process/--process-per-node",
            help="In real time: all nodes in one process, which loses no message on a small"
            " computer; or a process per node, each of which may die alone.",
            show_default="one process",
        ),
    ] = None,
    own_node: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NODE",
            help="In --mode processes: a ROS program of yours takes this controller's place, under"
            " its name. Repeat the option for several.",
        ),
    ] = None,
    anyway: Annotated[
        bool,
        typer.Option(
            "--anyway",
            help="In real time, with a simulated plant: begin though this computer may be too busy."
            " Otherwise how late it is is measured for two seconds, and what the loops do not bear"
            " is refused.",
        ),
    ] = False,
    patience: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            help="With ROS: give up when nothing moves for so long in lockstep, once the run is"
            " under way; ten times as long, or more where starting takes long, while it starts.",
            show_default="30",
        ),
    ] = None,
    testbed: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="The machine to simulate, such as one that was fitted, instead of the scenario's.",
        ),
    ] = None,
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
            help="A new folder for recording, summary.json and run.png; otherwise"
            " one in recordings/, named after scenario and time.",
        ),
    ] = None,
    record: Annotated[bool, typer.Option(help="Whether to record.")] = True,
    overrides: Overrides = None,
    effects: Effects = None,
    laws: Annotated[
        str | None,
        typer.Option(
            "--controllers",
            metavar="LAW,…",
            help="Run the scenario under several motion controllers at once, on the same seed, and"
            f" show them side by side: {', '.join(MOTION_LAWS)}.",
        ),
    ] = None,
    view: Annotated[
        bool,
        typer.Option(
            "--view",
            help="Show the run in a browser as it happens; in this process at the clock's pace,"
            " with pause, and with knobs for gains, sea and effects that begin it again.",
        ),
    ] = False,
    port: Port = None,
    browser: Browser = None,
    json: Json = None,
) -> None:
    """Simulate a scenario. Record it, draw it, and report how well the bar followed.

    Ctrl-C ends the run early with a complete recording.
    """
    # What can be refused by its name is, before the parts of a run are loaded.
    if mode not in MODES:
        raise InputError(f"--mode {mode}: allowed: {', '.join(MODES)}")
    settings = _settings(overrides or (), duration=duration, seed=seed)
    paths = [find_scenario(scenario) for scenario in scenarios]
    if testbed is not None:
        find_testbed(str(testbed))
    folder = out if out is not None else new_folder("+".join(Path(s).stem for s in scenarios))
    place = folder if record else None
    refuse_existing(place)
    from cspm.commands.run_beside_command import Settings, run_beside_command
    from cspm.commands.run_command import RunnerOptions, run_command
    from cspm.simulation import check_anyway
    from cspm_msgs_py.recording.run_record import EXTERNAL
    from cspm_run.plants import check_plant_name, check_unit_mode

    check_plant_name(plant, "--plant", more=[EXTERNAL])
    check_unit_mode(plant, mode, "--plant", MODES[0])
    check_anyway(plant, mode, "--anyway", anyway=anyway)
    if view:
        from cspm.commands.run_view_command import WatchRequest, check_watchable, run_view_command

        check_watchable(len(paths), record=record, beside=laws is not None)
        opened = sys.stdout.isatty() if browser is None else browser
        options = RunnerOptions(plant, mode, one_process, patience, own_node or (), anyway)
        more = (options, testbed, effects or (), port, opened)
        finished = run_view_command(WatchRequest(paths[0], settings, folder, json, *more))
    elif len(paths) == 1 and laws is None:
        finished = run_command(
            paths[0],
            settings,
            place,
            json,
            plant,
            mode,
            testbed,
            one_process,
            patience,
            effects or (),
            own_node or (),
            anyway,
        )
    else:
        _check_beside(mode, plant, own_node or (), under_laws=laws is not None)
        names = [] if laws is None else [name.strip() for name in laws.split(",")]
        finished = run_beside_command(
            paths, Settings(settings, place, json, plant, testbed, effects or (), names)
        )
    raise typer.Exit(0 if finished else RUN_FAILED)


def _settings(overrides: Sequence[str], **options: float | None) -> list[str]:
    """Return what overrides and options of their own set; one value must not hide another."""
    for name, value in options.items():
        twice = [each for each in overrides if each.partition("=")[0] == name]
        if twice and value is not None:
            raise InputError(f"--set {twice[0]}: --{name} sets it as well, allowed: one of both")
    given = [f"{name}={value}" for name, value in options.items() if value is not None]
    return [*overrides, *given]


def _check_beside(mode: str, plant: str, own_nodes: Sequence[str], *, under_laws: bool) -> None:
    several = "--controllers" if under_laws else "several scenarios"
    one = "one scenario, without --controllers" if under_laws else "one scenario"
    if mode != MODES[0]:
        raise InputError(f"--mode {mode}: allowed with {several}: {MODES[0]}")
    if plant == "external":
        raise InputError(f"--plant external: allowed with {one}")
    if own_nodes:
        raise InputError(f"--own-node {own_nodes[0]}: allowed with {one}")
