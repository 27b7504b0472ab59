"""The command `cspm merge`."""

from __future__ import annotations

from pathlib import Path

from cspm_ident.merged_testbed import differences, merged_testbed
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import load_testbed
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json


def merge_command(own: Path, improved: Path, out: Path | None, json: Path | None) -> None:
    """Show what an improved test-bed file changes, and write one's own file with it.

    Args:
        own: the file that somebody keeps, with comments.
        improved: what a diagnosis or an identification wrote.
        out: where to write; one's own file itself is allowed; None writes nothing.
        json: file for the differences as data; None writes none.

    Raises:
        InputError: a file cannot be used, has other cables, or cannot be written.
    """
    if out is not None and out.exists() and not out.samefile(own):
        raise InputError(f"--out {out}: already exists, allowed: a new file, or {own}")
    before, after = load_testbed(own), load_testbed(improved)
    merged = merged_testbed(before, after)
    found = differences(before, merged)
    console = make_console()
    for each in found:
        say(console, each.words)
    if not found:
        say(console, "no difference")
    if out is not None:
        _write(out, merged.text)
        say(console, f"written {out}")
    elif found:
        say(console, f"nothing written; --out {own} changes it in place")
    if json is not None:
        written = None if out is None else str(out)
        write_json(json, {"differences": [each._asdict() for each in found], "written": written})


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as err:
        raise InputError(f"--out {path}: cannot be written ({err.strerror})") from None
