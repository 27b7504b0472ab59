"""Commands that analyse a machine and its controllers: analyze linear, workspace and so on."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cspm.cli.app import MARKUP, Json, app
from cspm.cli.early_checks import check_analysed

analyze = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=MARKUP,
    help="Say what a machine can do. With its controllers, beside what the thesis says of its own.",
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

Exit code: 0 done, 1 the bar cannot hang there, 2 unusable input, 130 interrupted."""
)
def linear(
    scenario: ScenarioName = DEFAULT_SCENARIO,
    testbed: MachineFile = None,
    pose: At = None,
    out: Folder = None,
    json: Json = None,
) -> None:
    """Linearise about rest. Modes, damping, singular values, relative gains, condition numbers.

    Once with cable directions held, as the thesis does, and once exactly.
    """
    check_analysed(scenario, testbed, out)
    from cspm.commands.analysis.analyze_linear_command import analyze_linear_command
    from cspm.commands.analysis.analyzed_machine import read_machine

    analyze_linear_command(read_machine(scenario, testbed, pose), out, json)


@analyze.command(
    epilog="""Examples:

cspm analyze workspace --coarse 4

cspm analyze workspace --out workspace --json workspace.json

cspm analyze workspace --acceleration 0.2,0.2,0.5,0,0.2,0.2 --pose 0,0,3,0,0,0

Exit code: 0 done, 2 unusable input, 130 interrupted: nothing is written."""
)
def workspace(
    scenario: ScenarioName = DEFAULT_SCENARIO,
    testbed: MachineFile = None,
    pose: At = None,
    acceleration: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z,φ,θ,ψ",
            help="What the bar has to accelerate either way, in all at once, in m/s² and rad/s²;"
            " otherwise the RMS of the scenario's reference.",
        ),
    ] = None,
    coarse: Annotated[
        int,
        typer.Option(
            metavar="N",
            min=1,
            max=14,
            help="Take every N-th value of each DOF of the thesis's whole grids, 28.6 million"
            " poses in all, for a quick look. Limits and maps stay as fine.",
        ),
    ] = 1,
    out: Folder = None,
    json: Json = None,
) -> None:
    """Find where cables can hold the bar. By the thesis's algorithms 1 and 2, and beyond.

    Beyond: tensions from their lowest limit, room for an acceleration, conditioning,
    manipulability.
    """
    check_analysed(scenario, testbed, out)
    from cspm.commands.analysis.analyze_workspace_command import analyze_workspace_command
    from cspm.commands.analysis.analyzed_machine import read_acceleration, read_machine

    required = None if acceleration is None else read_acceleration(acceleration)
    machine = read_machine(scenario, testbed, pose)
    analyze_workspace_command(machine, required, coarse, out, json)


@analyze.command(
    epilog="""Examples:

cspm analyze manipulability

cspm analyze manipulability --pose 0.1,0,1,0,0.2,0 --out manipulability --json found.json

Exit code: 0 done, 2 unusable input, 130 interrupted."""
)
def manipulability(
    scenario: ScenarioName = DEFAULT_SCENARIO,
    testbed: MachineFile = None,
    pose: At = None,
    out: Folder = None,
    json: Json = None,
) -> None:
    """Say how well cables move the bar. At a pose, by Yoshikawa's measure and ellipsoids.

    And what acceleration gravity and the cables' limits leave in each DOF.
    """
    check_analysed(scenario, testbed, out)
    from cspm.commands.analysis.analyze_manipulability_command import analyze_manipulability_command
    from cspm.commands.analysis.analyzed_machine import read_machine

    analyze_manipulability_command(read_machine(scenario, testbed, pose), out, json)


@analyze.command(
    epilog="""Examples:

cspm analyze reference calm --out reference

cspm analyze reference my_scenario.yaml --set target.motion.scale=0.5 --json reference.json

Exit code: 0 done, 2 unusable input, 130 interrupted."""
)
def reference(
    scenario: ScenarioName = DEFAULT_SCENARIO,
    overrides: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KEY=VALUE", help="A value of the scenario or test-bed; repeated."
        ),
    ] = None,
    testbed: MachineFile = None,
    out: Folder = None,
    json: Json = None,
) -> None:
    """Check that the reference is feasible. Wrench, tensions, speeds and torques.

    As if bar and cables followed it exactly; the picture shades where no tensions will do.
    """
    check_analysed(scenario, testbed, out)
    from cspm.commands.analysis.analyze_reference_command import analyze_reference_command
    from cspm_run.library import find_scenario

    path = find_scenario(scenario)
    analyze_reference_command(path, overrides or [], testbed, out, json)


@analyze.command(
    epilog="""Examples:

cspm analyze sag --linear-density 0.001

cspm analyze sag cogiro --linear-density 0.05 --pose 2,0,1,0,0,0 --json sag.json

Exit code: 0 done, 1 no tensions hold bar and cables, 2 unusable input, 130 interrupted."""
)
def sag(
    scenario: ScenarioName = DEFAULT_SCENARIO,
    testbed: MachineFile = None,
    pose: At = None,
    linear_density: Annotated[
        float | None,
        typer.Option(
            metavar="KG/M",
            help="Of all cables; otherwise that of the test-bed's effect cable_sag.",
        ),
    ] = None,
    json: Json = None,
) -> None:
    """Report sag of heavy cables at rest. Their tensions, shape and remaining stiffness.

    Beside the tensions of straight cables without weight, which controllers assume.
    """
    check_analysed(scenario, testbed)
    from cspm.commands.analysis.analyze_sag_command import analyze_sag_command
    from cspm.commands.analysis.analyzed_machine import read_machine

    analyze_sag_command(read_machine(scenario, testbed, pose), linear_density, json)


@analyze.command(
    epilog="""Examples:

cspm analyze design --out design

cspm analyze design calm --computing 0.002 --json design.json

cspm analyze design my_scenario.yaml --pose 0,0,4,0,0,0

Exit code: 0 done, 1 the bar cannot hang there, 2 unusable input, 130 interrupted."""
)
def design(
    scenario: ScenarioName = DEFAULT_SCENARIO,
    testbed: MachineFile = None,
    pose: At = None,
    computing: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            min=0.0,
            max=1.0,
            help="From a measurement to its torque, a whole number of the plant's periods;"
            " otherwise one period of the force controllers, as of drives that act in their next"
            " cycle.",
        ),
    ] = None,
    out: Folder = None,
    json: Json = None,
) -> None:
    """Look at the control loops. Margins as designed, as sampled, and as they cascade.

    Gains that the scenario does not give are designed first, at its design pose; the loops are
    looked at where --pose says.
    """
    check_analysed(scenario, testbed, out)
    from cspm.commands.analysis.analyze_design_command import analyze_design_command
    from cspm.commands.analysis.analyzed_machine import read_machine

    analyze_design_command(read_machine(scenario, testbed, pose), computing, out, json)
