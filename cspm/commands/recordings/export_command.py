"""The command `cspm export`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cspm.commands.progress_shown import shown
from cspm.exporting.signal_file import check_place, write_signals
from cspm.recorded import Recording
from cspm_msgs_py.errors import InputError
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json


def export_command(bag: Path, out: Path, names: Sequence[str], json: Path | None) -> None:
    """Write signals of a recording to a file of another format.

    Args:
        bag: the recording.
        out: a new file; its ending chooses the format.
        names: of the signals; none: all that are recorded.
        json: file for what was written as data; None writes none.

    Raises:
        InputError: the recording, the file or a name cannot be used.
    """
    check_place(out)
    recording = Recording(bag)
    unknown = [name for name in names if name not in recording.names]
    if unknown or not recording.names:
        has = ", ".join(recording.names) or "none of them"
        raise InputError(f"{bag}: no {unknown[0] if unknown else 'signal'}, it has: {has}")
    console = make_console()
    with shown(console, "reading") as progress:
        signals = [recording.signal(name) for name in names or recording.names]
        progress(0.0, "writing")
        write_signals(out, signals)
    for each in signals:
        units = ", ".join(dict.fromkeys(each.units))
        say(console, f"{each.name}: {len(each)} × {len(each.columns)} [{units}]")
    for line in recording.left_out:
        say(console, line)
    say(console, f"written {out}")
    if json is not None:
        columns = {each.name: list(each.columns) for each in signals}
        write_json(json, {"written": str(out), "signals": columns})
