"""Commands about the installation itself: doctor."""

from __future__ import annotations

from typing import Annotated

import typer

from cspm.cli.app import Json, app


@app.command(
    epilog="""Examples:

cspm doctor

cspm doctor --dependencies --json doctor.json

Exit code: 0 done, whatever is missing; 2 unusable input."""
)
def doctor(
    listed: Annotated[
        bool,
        typer.Option(
            "--dependencies",
            help="List what a base installation and each extra bring as well: versions, licences"
            " as SPDX expressions, and sizes.",
        ),
    ] = False,
    json: Json = None,
) -> None:
    """Look at this computer: what is there, what is missing, and what adds it.

    Python, the compiled kernels, ROS 2 and its middleware, extras, processors, priorities, browser.
    """
    from cspm.commands.installation.doctor_command import doctor_command

    doctor_command(json, listed=listed)
