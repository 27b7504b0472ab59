"""The command `cspm bundle`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cspm.commands.progress_shown import shown
from cspm.exporting.verdict_bundle import write_bundle
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json


def bundle_command(
    recordings: Sequence[Path], verdict: Path, out: Path, testbed: Path | None, json: Path | None
) -> None:
    """Pack what repeats a verdict, and say what was renamed.

    Args:
        recordings: all that the verdict was made of.
        verdict: the folder that `cspm diagnose --out` wrote.
        out: a new zip file.
        testbed: that the recordings were compared with; None: where the verdict says it is.
        json: file for what was packed as data; None writes none.

    Raises:
        InputError: a file cannot be used, or does not belong to the verdict.
    """
    console = make_console()
    with shown(console, "packing"):
        packed = write_bundle(out, recordings, verdict, testbed)
    for path, name in packed.names.items():
        say(console, f"{path} → {name}")
    for name in packed.code:
        say(console, f"{name}: code of a controller, packed as it is")
    say(console, f"written {out}: {len(packed.files)} files; its README.txt has the command")
    if json is not None:
        write_json(json, {"written": str(out), **packed._asdict()})
