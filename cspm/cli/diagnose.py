"""The command that says where a recording and the model differ, and why: diagnose."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cspm.cli.app import Json, LeaveOutRegimes, app
from cspm.cli.early_checks import SEARCHED, SPLIT, begin_judged
from cspm.cli.held_out import OPTION, JudgedCommand
from cspm_msgs_py.errors import InputError


@app.command(
    cls=JudgedCommand,
    epilog="""Examples:

cspm diagnose today --held-out yesterday --out verdict

cspm diagnose monday tuesday --testbed my_rig.yaml --json diagnosis.json

cspm diagnose --explain winch_coulomb_friction

cspm diagnose --plan rest --duration 20

Exit code: 0 done, whatever the verdict; 2 unusable input, 130 interrupted.""",
)
def diagnose(
    recordings: Annotated[
        list[Path] | None,
        typer.Argument(metavar="REC...", help="Recordings to search, all of one machine."),
    ] = None,
    held_out: Annotated[
        list[Path] | None,
        typer.Option(
            OPTION,
            metavar="REC",
            help="A recording on which to judge what was found; may be repeated, after the"
            " recordings to search. Otherwise the last three tenths of each are kept for that.",
        ),
    ] = None,
    testbed: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="The machine as it is believed to be, instead of the one that they carry.",
        ),
    ] = None,
    explain: Annotated[
        str | None,
        typer.Option(metavar="EFFECT", help="Say what an effect is and how it shows; no more."),
    ] = None,
    plan: Annotated[
        str | None,
        typer.Option(
            metavar="SCENARIO",
            help="Say what a motion could show, before it is recorded: the detection limits.",
        ),
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS", min=1.0, help="Of --plan; otherwise the scenario's, at most 60 s."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="A new folder for diagnosis.html, .json and .png and testbed.improved.yaml.",
        ),
    ] = None,
    closed_loop: Annotated[
        bool,
        typer.Option(help="Simulate the recorded closed loop again with what was found."),
    ] = True,
    leave_out_regimes: LeaveOutRegimes = False,
    json: Json = None,
) -> None:
    """Find what physics a model lacks. Where it differs, what is missing, how the fit improves.

    Every residual is driven by what was measured, so that feedback cannot hide an effect. What is
    found is judged on data that was not searched.
    """
    if explain is not None:
        from cspm.commands.catalogue.explain_command import explain_command

        explain_command(explain)
        return
    if plan is not None:
        if recordings or held_out or out is not None:
            raise InputError("diagnose: --plan beside recordings or --out, allowed: --plan alone")
        from cspm.commands.analysis.plan_command import plan_command

        plan_command(plan, testbed, duration, json)
        return
    if duration is not None:
        raise InputError("diagnose: --duration of recordings, allowed: with --plan")
    if not recordings:
        raise InputError(
            "diagnose: no recording, allowed: one or more, --explain EFFECT or --plan SCENARIO"
        )
    role = SEARCHED if held_out else SPLIT
    begin_judged(role, recordings, held_out or (), testbed, out)
    from cspm.commands.diagnose_command import DiagnoseRequest, diagnose_command

    diagnose_command(
        DiagnoseRequest(recordings, held_out or [], testbed, out, closed_loop, leave_out_regimes),
        json,
    )
