"""The command `cspm schema`."""

from __future__ import annotations

from pathlib import Path

from cspm.schemas.file_schema import schema_of
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import STANDARD_OUTPUT, write_json


def schema_command(kind: str, json: Path | None) -> None:
    """Print the JSON Schema of a kind of file, or write it.

    Raises:
        InputError: no such kind.
    """
    write_json(json or STANDARD_OUTPUT, schema_of(kind))
    if json is not None and json != STANDARD_OUTPUT:
        say(make_console(), f"written {json}")
