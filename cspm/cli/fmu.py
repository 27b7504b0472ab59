"""The command that hands a plant to other simulators."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cspm.cli.app import Json, app
from cspm.cli.shared_options import Effects, Overrides
from cspm_run.library import find_scenario, find_testbed


@app.command(
    epilog="""Examples:

cspm fmu calm --out crane.fmu

cspm fmu worst_case --set seed=2 --out crane.fmu

cspm run calm --plant crane.fmu

Exit code: 0 done, 2 unusable input, 130 interrupted."""
)
def fmu(
    scenario: Annotated[
        str, typer.Argument(metavar="SCENARIO", help="A scenario's name, or a scenario file.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="A new file; otherwise SCENARIO.fmu in this folder.",
        ),
    ] = None,
    testbed: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The machine, instead of the scenario's."),
    ] = None,
    overrides: Overrides = None,
    effects: Effects = None,
    json: Json = None,
) -> None:
    """Write a scenario's plant as an FMU. A unit of FMI 2 for co-simulation.

    Inputs are motor torques and a brake, outputs pose, motor angles and tensions. It starts at rest
    where the scenario does, and its winch frame moves with the scenario's sea.
    """
    path = find_scenario(scenario)
    if testbed is not None:
        find_testbed(str(testbed))
    from cspm.commands.exchange.fmu_command import fmu_command

    fmu_command(path, out, overrides or (), testbed, effects or (), json)
