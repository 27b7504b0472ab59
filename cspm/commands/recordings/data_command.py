"""The commands `cspm data list` and `cspm data get`."""

from __future__ import annotations

from pathlib import Path

from cspm.commands.progress_shown import shown
from cspm.open_data.fetch import ABOUT, fetch
from cspm.open_data.source import Source, source_of, sources
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json

FOLDER = Path("open_data")


def data_list_command(json: Path | None) -> None:
    """Print what can be fetched, whose it is and under which licence."""
    console = make_console()
    known = sources()
    for name, source in known.items():
        say(console, f"{name}: {source.title}")
        say(console, f"  {source.licence}, {source.size / 1e6:.1f} MB, {_publisher(source)}")
        say(console, f"  {source.citation}")
    say(console, "fetch one: cspm data get NAME")
    if json is not None:
        write_json(json, {name: source.model_dump() for name, source in known.items()})


def data_get_command(
    name: str, there: Path | None, out: Path | None, mirror: str | None, json: Path | None
) -> None:
    """Fetch published recordings, and show their licence.

    Raises:
        InputError: no such recordings, or what is given lacks a file.
        CspmError: the publisher does not answer.
    """
    console = make_console()
    source = source_of(name)
    folder = FOLDER / source.folder if out is None else out
    say(console, f"{source.title}")
    say(console, f"published at {_publisher(source)}, licence {source.licence}; to cite:")
    say(console, f"  {source.citation}")
    with shown(console, f"fetching {name}") as progress:
        fetched = fetch(name, source, folder, there, lambda share: progress(share, ""), mirror)
    licence = Path(source.licence_file).name
    say(console, f"{folder}: {'already there' if fetched else 'done'}, its licence in {licence},")
    say(console, f"  its source in {ABOUT}. For example:")
    first = source.machines[0]
    say(
        console,
        f"  cspm import {folder / first.tables[0]} --mapping {folder / first.mapping} --testbed"
        f" {folder / first.testbed} --out {Path(first.tables[0]).stem}",
    )
    if json is not None:
        tables = [str(folder / table.name) for table in source.tables]
        written = {"folder": str(folder), "tables": tables, "licence": source.licence}
        write_json(json, written | {"citation": source.citation, "already_there": fetched})


def _publisher(source: Source) -> str:
    return f"https://github.com/{source.repository}"
