"""The commands that show: view."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from cspm.cli.app import Json, app
from cspm.cli.early_checks import check_given
from cspm.cli.shared_options import Browser, Port

Host = Annotated[
    str,
    typer.Option(
        metavar="ADDRESS",
        help="Address to listen on. Others than 127.0.0.1 show the view to the network.",
    ),
]


@app.command(
    epilog="""Examples:

cspm view recordings/calm-20260131-120000

cspm view today --diagnosis verdict --html today.html

cspm view measured simulated

Exit code: 0 done, 2 unusable input, 130 interrupted."""
)
def view(
    recordings: Annotated[
        list[Path],
        typer.Argument(
            metavar="REC...",
            help="A recording: its folder or its MCAP file. A second one is laid over it.",
        ),
    ],
    html: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Write one page that needs no network, instead of serving it."
        ),
    ] = None,
    diagnosis: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="A diagnosis.json, or its folder: mark the parts that it names.",
        ),
    ] = None,
    testbed: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="The machine that was recorded, instead of the one that it carries.",
        ),
    ] = None,
    host: Host = "127.0.0.1",
    port: Port = None,
    browser: Browser = None,
    json: Json = None,
) -> None:
    """Show a recording in 3-D. The machine beside its signals, with a timeline.

    Serves a page to browsers on this computer, or writes it as one file.
    """
    check_given(recordings, testbed)
    from cspm.commands.view_command import ViewRequest, view_command

    opened = sys.stdout.isatty() if browser is None else browser
    view_command(ViewRequest(recordings, testbed, diagnosis, html, host, port, opened), json)
