"""The command that begins: new."""

from __future__ import annotations

from typing import Annotated

import typer

from cspm.cli.app import Json, app
from cspm_msgs_py.errors import InputError


@app.command(
    epilog="""Kinds: suspended, a plate on four cables; point, four cables that meet in a point;
crossed, eight cables from above; held, eight cables from above and below; planar, four cables in
a plane.

Examples:

cspm new my_robot

cspm new gantry --kind crossed --size 4,3,2.5 --mass 12

cspm new wall --kind planar --size 3,2

cspm new surveyed --survey-accuracy 0.0005 --mass-accuracy 0.01

Exit code: 0 done, 2 unusable input, 130 interrupted."""
)
def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="The robot's name.")],
    kind: Annotated[str, typer.Option(metavar="KIND", help="How its cables run.")] = "suspended",
    size: Annotated[
        str,
        typer.Option(
            metavar="X,Y,Z", help="The frame that carries the winches, in m; planar: X,Z."
        ),
    ] = "2,2,2",
    mass: Annotated[float, typer.Option(metavar="KG", help="Mass of the platform.")] = 5.0,
    survey_accuracy: Annotated[
        float | None,
        typer.Option(
            metavar="M",
            help="Standard deviation of each coordinate of exits and attachments, which a diagnosis"
            " takes for healthy; usually 0.001.",
        ),
    ] = None,
    mass_accuracy: Annotated[
        float | None,
        typer.Option(metavar="KG", help="Standard deviation of the mass, likewise."),
    ] = None,
    run: Annotated[bool, typer.Option(help="Whether to run the scenario.")] = True,
    json: Json = None,
) -> None:
    """Begin a robot of your own. Write its test-bed and scenario, check, draw and run them."""
    from cspm.commands.new_command import new_command
    from cspm.new.files import Accuracies

    known = Accuracies(survey_accuracy, mass_accuracy)
    new_command(name, kind, _frame(size, kind), mass, json, known, run=run)


def _frame(size: str, kind: str) -> tuple[float, float, float]:
    """Return x y z of the frame [m]; a planar robot has no y: its x is taken."""
    planar = kind == "planar"
    try:
        numbers = [float(value) for value in size.split(",")]
        x, y, z = [numbers[0], *numbers] if planar and len(numbers) == 2 else numbers
    except ValueError:
        few = "two or " if planar else ""
        raise InputError(
            f"--size {size}: allowed: {few}three numbers in m, such as 2,2,2"
        ) from None
    return x, y, z
