"""The command that demonstrates: demo."""

from __future__ import annotations

import secrets
import sys
from pathlib import Path
from typing import Annotated

import typer

from cspm.cli.app import Json, app, new_folder
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.new_folder import refuse_existing

# Few enough digits to be remembered and typed again.
_SEEDS = 1000


@app.command(
    epilog="""Examples:

cspm demo

cspm demo --seed 7 --hard

cspm demo --effect winch_coulomb_friction --no-guess

cspm demo --real kuka_kr300

Exit code: 0 done, whatever was named; 2 unusable input, 130 interrupted."""
)
def demo(
    seed: Annotated[
        int | None,
        typer.Option(
            metavar="NUMBER",
            min=0,
            help="Draws what is concealed; the same seed conceals the same.",
            show_default="another one each time",
        ),
    ] = None,
    effect: Annotated[
        str | None, typer.Option(metavar="EFFECT", help="Conceal this effect, on a drawn part.")
    ] = None,
    hard: Annotated[
        bool, typer.Option("--hard", help="Conceal two effects, each half as large.")
    ] = False,
    real: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Delete a known term from the file of a real machine, of `cspm data list`; its"
            " recordings are fetched unless they are in open_data/.",
        ),
    ] = None,
    guess: Annotated[
        bool | None,
        typer.Option(help="Whether to ask for a guess.", show_default="at a terminal"),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="A new folder; otherwise recordings/demo-DATE-TIME."),
    ] = None,
    json: Json = None,
) -> None:
    """Guess and diagnose a hidden fault. In three minutes: concealed, found, revealed.

    The recording, the verdict's page and a page with the improved model beside the recording stay.
    """
    refuse_existing(out)
    from cspm.commands.demo_command import DemoRequest, demo_command

    asked = sys.stdin.isatty() and sys.stdout.isatty() if guess is None else guess
    folder = out if out is not None else new_folder("demo")
    drawn = secrets.randbelow(_SEEDS) if seed is None else seed
    if real is not None:
        from cspm.commands.recordings.demo_real_command import RealDemoRequest, demo_real_command

        if hard:
            raise InputError("--real --hard: allowed: one of both")
        demo_real_command(RealDemoRequest(real, drawn, effect, folder, asked), json)
        return
    demo_command(DemoRequest(drawn, effect, hard, folder, asked), json)
