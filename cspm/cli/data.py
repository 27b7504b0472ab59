"""The commands about recordings of others: data list, data get."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cspm.cli.app import MARKUP, Json, app

data = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=MARKUP,
    help="Real recordings of other laboratories. Their licences let anyone use them: list, get.",
)
app.add_typer(data, name="data")


@data.command("list", epilog="Exit code: 0 done.")
def list_(json: Json = None) -> None:
    """List recordings of real machines that can be fetched. With licence, size and citation."""
    from cspm.commands.recordings.data_command import data_list_command

    data_list_command(json)


@data.command(
    epilog="""Examples:

cspm data get kuka_kr300

cspm data get ship_section --from downloads --out ship

Exit code: 0 done, 1 the publisher does not answer, 2 unusable input."""
)
def get(
    name: Annotated[str, typer.Argument(metavar="NAME", help="As `cspm data list` has it.")],
    there: Annotated[
        Path | None,
        typer.Option(
            "--from",
            metavar="DIR",
            help="A folder that has the publisher's files, or the tables made of them, at any"
            " depth; nothing is downloaded.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER", help="A new folder; otherwise one in open_data/, named by the source."
        ),
    ] = None,
    mirror: Annotated[
        str | None,
        typer.Option(metavar="URL", help="A server laid out as the publisher's, in its place."),
    ] = None,
    json: Json = None,
) -> None:
    """Fetch recordings from their publisher. With licence, citation, test-bed files and mappings.

    Every file is checked by its SHA-256. What was cut off goes on where it was; what came whole is
    kept for the next time, in $XDG_CACHE_HOME or ~/.cache.
    """
    from cspm.commands.recordings.data_command import data_get_command

    data_get_command(name, there, out, mirror, json)
