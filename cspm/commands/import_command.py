"""The command `cspm import`: shows every conversion, then writes the recording."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from cspm.commands.import_tables import print_report
from cspm.commands.progress_shown import shown
from cspm.importing import write_import
from cspm_ident.importing.column_store import ColumnStore
from cspm_ident.importing.mapping import load_mapping
from cspm_ident.importing.preparation import prepare
from cspm_msgs_py.new_folder import refuse_existing
from cspm_run.library import find_mapping, named_testbed
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json


@dataclass(frozen=True)
class Import:
    """Options of the command line; without `out` nothing is written."""

    source: Path
    mapping: Path
    testbed: Path
    out: Path | None


def import_command(request: Import, json: Path | None) -> None:
    """Print the report of an import, and write the recording unless it is a trial.

    Raises:
        InputError: the file, the mapping or the test-bed cannot be used.
    """
    console = make_console()
    refuse_existing(request.out)
    mapping, testbed = (
        load_mapping(find_mapping(str(request.mapping))),
        named_testbed(request.testbed),
    )
    with ColumnStore() as store:
        trial = request.out is None
        with _shares(console, f"reading {request.source.name}") as show:
            prepared = prepare(request.source, mapping, testbed, store, show, trial=trial)
        print_report(console, prepared.report)
        counts: dict[str, int] = {}
        if request.out is not None:
            with _shares(console, f"writing {request.out.name}") as show:
                counts = write_import(request.out, prepared, mapping, testbed, show)
            say(console, f"recording {request.out}: {sum(counts.values())} messages")
        else:
            say(console, "trial: nothing was written")
    if json is not None:
        written = {"recording": str(request.out) if request.out else None, "messages": counts}
        write_json(json, prepared.report.data() | written)


@contextmanager
def _shares(console: Console, what: str) -> Iterator[Callable[[float], None]]:
    """Give what takes the share of one piece of work that is done."""
    with shown(console, what) as progress:
        yield lambda share: progress(share, what)
