"""Commands that analyse a machine and its controllers: analyze linear, workspace and so on."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cspm_bringup.cli_app import Json, app

analyze = typer.Typer(
    no_args_is_help=True,
    help="What a machine and its controllers can do, beside what the thesis says of its own.",
)
app.add_typer(analyze, name="analyze")

ScenarioName = Annotated[
    str,
    typer.Argument(
        metavar="[SCENARIO]", help="A scenario's name or file; its machine and rates are analysed."
    ),
]
MachineFile = Annotated[
    Path | None,
    typer.Option("--testbed", metavar="FILE", help="A machine instead of the scenario's."),
]
At = Annotated[
    str | None,
    typer.Option(
        "--pose",
        metavar="X,Y,Z,φ,θ,ψ",
        help="Where the bar is, in m and rad, z down; otherwise where the scenario's controllers"
        " are designed.",
    ),
]
Folder = Annotated[
    Path | None, typer.Option("--out", metavar="FOLDER", help="A new folder for what is drawn.")
]
DEFAULT_SCENARIO = "worst_case"


@analyze.command(
    epilog="""Examples:

cspm analyze linear --out linear

cspm analyze linear worst_case_4m --pose 0,0,4,0,0,0 --json linear.json

cspm analyze linear --testbed my_rig.yaml --pose 0,0,1.5,0,0,0

Exit code: 0 done, 1 the bar cannot hang there, 2 unusable input."""
)
def linear(
    scenario: ScenarioName = DEFAULT_SCENARIO,
    testbed: MachineFile = None,
    pose: At = None,
    out: Folder = None,
    json: Json = None,
) -> None:
    """Linearise about rest: modes, damping, singular values, relative gains, condition numbers.

    Once with cable directions held, as the thesis does, and once exactly.
    """
    from cspm_bringup.analyze_linear_command import analyze_linear_command
    from cspm_bringup.analyzed_machine import read_machine

    analyze_linear_command(read_machine(scenario, testbed, pose), out, json)
