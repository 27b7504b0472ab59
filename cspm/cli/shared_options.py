"""What every command has: `--quiet`, and its exit codes in its help."""

from __future__ import annotations

from collections.abc import Iterator
from contextvars import ContextVar
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from cspm_run.output.console import VOICE, Voice

# Of the command that runs, with all its words; a command line runs in a context of its own.
COMMAND: ContextVar[str] = ContextVar("command", default="")
Port = Annotated[
    int | None,
    typer.Option(
        metavar="NUMBER",
        min=0,
        max=65535,
        help="Port to listen on; 0 takes any.",
        show_default="the first free one from 8080",
    ),
]
Browser = Annotated[
    bool | None,
    typer.Option(
        "--browser/--no-browser",
        help="Whether to open a browser.",
        show_default="at a terminal",
    ),
]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Replace a value of the scenario, in its units (SI, rad), such as"
        " target.motion.peak_period=2, or of its test-bed, such as"
        " testbed.cables.sway_3.drum_radius=0.026; may be repeated.",
    ),
]
Effects = Annotated[
    list[str] | None,
    typer.Option(
        "--effect",
        metavar="EFFECT",
        help="Plant physics in the machine: EFFECT@ELEMENTS:PARAMETER=VALUE, such as"
        " winch_coulomb_friction@sway_3:torque=0.02; several elements or parameters by"
        " commas; may be repeated. `cspm diagnose --explain EFFECT` describes one.",
    ),
]

_CODES = "Exit code: 0 done, 1 failed, 2 unusable input, 130 interrupted."


def add_shared_options(command: Any) -> None:  # noqa: ANN401 - a command or a group of commands
    """Give each command below `--quiet`, and exit codes where its help has none."""
    for each in _leaves(command):
        each.params.append(_quiet())
        if "Exit code" not in (each.epilog or ""):
            each.epilog = f"{each.epilog}\n\n{_CODES}" if each.epilog else _CODES


def _leaves(command: Any) -> Iterator[TyperCommand]:  # noqa: ANN401 - as above
    if isinstance(command, TyperGroup):
        for each in command.commands.values():
            yield from _leaves(each)
    else:
        yield command


def _begin(context: typer.Context, wanted: bool) -> None:
    """Note which command begins, and silence it if that is wanted."""
    COMMAND.set(context.command_path)
    if wanted:
        VOICE.set(Voice.NOWHERE)


def _quiet_alone(
    quiet: Annotated[
        bool,
        typer.Option(
            "--quiet",
            "-q",
            is_eager=True,
            callback=_begin,
            help="Print nothing but errors.",
        ),
    ] = False,
) -> None:
    """Take the option that other commands share."""


def _quiet() -> Any:  # noqa: ANN401 - an option, as Typer makes it
    alone = typer.Typer(add_completion=False)
    alone.command()(_quiet_alone)
    (option,) = typer.main.get_command(alone).params
    option.expose_value = False
    return option
