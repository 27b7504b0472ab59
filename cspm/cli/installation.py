"""Commands about the installation and files: doctor, schema, migrate, merge."""

from __future__ import annotations

from pathlib import Path
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
    """Say what this computer lacks. And what is there, and what adds the rest.

    Python, the compiled kernels, ROS 2 and its middleware, extras, processors, priorities, browser.
    """
    from cspm.commands.installation.doctor_command import doctor_command

    doctor_command(json, listed=listed)


@app.command(
    epilog="""Examples:

cspm schema testbed > testbed.schema.json

cspm schema scenario --json scenario.schema.json

In an editor with the YAML language server the first line of a file is then
# yaml-language-server: $schema=testbed.schema.json

Exit code: 0 done, 2 unusable input."""
)
def schema(
    kind: Annotated[
        str,
        typer.Argument(
            metavar="KIND", help="Of file: testbed, scenario, mapping, campaign or diagnosis."
        ),
    ],
    json: Json = None,
) -> None:
    """Print the JSON Schema of a file. Editors complete and check keys by it.

    It is made from what the reader itself checks by. With --json it goes to a file.
    """
    from cspm.commands.installation.schema_command import schema_command

    schema_command(kind, json)


@app.command(
    epilog="""Examples:

cspm migrate my_rig.yaml

cspm migrate recordings/calm-20260131-120000

Exit code: 0 valid as it is, 2 what has to be changed, or unusable input."""
)
def migrate(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE",
            help="A test-bed, scenario, mapping, campaign or diagnosis of an older version, or a"
            " recording.",
        ),
    ],
    json: Json = None,
) -> None:
    """Look whether an older file is valid. Or name the key that has to be changed.

    No version has renamed or dropped a key, so that files of all versions are valid as they are.
    """
    from cspm.commands.installation.migrate_command import migrate_command

    migrate_command(file, json)


@app.command(
    epilog="""Examples:

cspm merge my_rig.yaml verdict/testbed.improved.yaml

cspm merge my_rig.yaml verdict/testbed.improved.yaml --out my_rig.yaml

Exit code: 0 done, 2 unusable input."""
)
def merge(
    testbed: Annotated[
        Path, typer.Argument(metavar="TESTBED", help="Your own test-bed file, with its comments.")
    ],
    improved: Annotated[
        Path,
        typer.Argument(
            metavar="IMPROVED", help="The file that a diagnosis or an identification wrote."
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="A new file, or TESTBED itself, to write to.",
            show_default="show the differences alone",
        ),
    ] = None,
    json: Json = None,
) -> None:
    """Merge improved numbers into your file. Comments and order stay.

    Every difference is shown, also those that you made since. The result says what IMPROVED says.
    """
    from cspm.commands.installation.merge_command import merge_command

    merge_command(testbed, improved, out, json)
