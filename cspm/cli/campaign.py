"""The command that makes many runs: campaign."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cspm.cli.app import RUN_FAILED, Json, app
from cspm_msgs_py.yaml_file import read_text


@app.command(
    epilog="""A campaign's file:

    scenario: worst_case
    set: {duration: 60}
    grid:
      seed: {from: 1, to: 20}
      testbed.bar.mass: [3.6, 4.06, 4.5]

Examples:

cspm campaign robustness.yaml

cspm campaign robustness.yaml --list

cspm campaign robustness.yaml --out campaigns/monday --workers 4

cspm campaign robustness.yaml --scheduler tls://head:8786

Exit code: 0 done, 1 interrupted, or runs lost or refused, 2 unusable input."""
)
def campaign(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="What is varied, and what is measured."),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="A folder, new or begun by the same campaign; otherwise campaigns/NAME.",
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            metavar="NUMBER",
            min=1,
            help="Processes on this computer.",
            show_default="one per processor",
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="A dask scheduler that is running, whose workers have this version of cspm.",
        ),
    ] = None,
    time_limit: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            min=1.0,
            help="After which a run counts as hung.",
            show_default="120 and twice its duration",
        ),
    ] = None,
    listed: Annotated[
        bool, typer.Option("--list", help="Print the runs as commands, and make none.")
    ] = False,
    json: Json = None,
) -> None:
    """Make many runs side by side. They differ in seeds, values, effects or controllers.

    The folder gets runs.parquet, one row a run, and campaign.html. The same command goes on where
    it was interrupted.
    """
    read_text(file)
    from cspm.commands.campaign_command import CampaignRequest, campaign_command, list_command

    if listed:
        list_command(file, json)
        return
    place = out if out is not None else Path("campaigns") / file.stem
    request = CampaignRequest(file, place, workers, scheduler, time_limit)
    raise typer.Exit(0 if campaign_command(request, json) else RUN_FAILED)
