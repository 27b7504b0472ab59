"""The command `cspm urdf`."""

from __future__ import annotations

from pathlib import Path

import typer

from cspm.testbed import load_testbed
from cspm_msgs_py.errors import InputError
from cspm_run.output.console import make_console, say


def urdf_command(testbed: str, out: Path | None) -> None:
    """Write a machine as URDF.

    Args:
        testbed: its name in the library, or its file.
        out: a new file; None prints it.

    Raises:
        InputError: no such test-bed, or the file exists or cannot be written.
    """
    text = load_testbed(testbed).urdf()
    if out is None:
        typer.echo(text, nl=False)
        return
    try:
        with out.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise InputError(f"--out {out}: already exists, allowed: a new file") from None
    except OSError as err:
        raise InputError(f"--out {out}: cannot be written ({err.strerror})") from None
    say(make_console(), f"urdf {out}")
