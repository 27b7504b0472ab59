"""What all commands of the command line share."""

from __future__ import annotations

import shutil
from datetime import datetime
from itertools import chain, count
from pathlib import Path
from typing import Annotated, Literal

import typer
import typer.core

from cspm_msgs_py.errors import InputError
from cspm_run.output.console import VOICE, Voice
from cspm_run.output.json_file import STANDARD_OUTPUT

RUN_FAILED = 1
# Frames leave 12 characters for a text on a terminal of 60 columns, and 26 of 80; plain help has
# twice as many.
_FRAMED_FROM = 100
MARKUP: Literal["rich"] | None = (
    "rich" if shutil.get_terminal_size().columns >= _FRAMED_FROM else None
)


class _Listed(typer.core.TyperGroup):
    """Lists the commands in the order in which a newcomer needs them."""

    order = (
        *("demo", "new", "run", "view", "info", "recover", "resim", "data", "check", "import"),
        *("export", "compare", "identify", "diagnose", "bundle", "merge", "campaign", "analyze"),
        *("doctor", "schema", "migrate", "replay", "check-drivers", "urdf", "mjcf"),
        *("fmu", "node"),
    )

    def list_commands(self, ctx: typer.Context) -> list[str]:  # type: ignore[override]
        """Return the names, those without a place at the end."""
        names = super().list_commands(ctx)
        return sorted(names, key=lambda n: self.order.index(n) if n in self.order else len(names))


app = typer.Typer(
    cls=_Listed,
    pretty_exceptions_enable=False,
    rich_markup_mode=MARKUP,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _usable_json(path: Path | None) -> Path | None:
    """Refuse a file that cannot be written before the work that fills it.

    Where the data go to standard output, the text goes to standard error.
    """
    if path == STANDARD_OUTPUT:
        if VOICE.get() is Voice.OUTPUT:
            VOICE.set(Voice.ERRORS)
        return path
    if path is not None and (path.is_dir() or not path.absolute().parent.is_dir()):
        raise InputError(f"--json {path}: allowed: a file in a folder that exists")
    return path


Json = Annotated[
    Path | None,
    typer.Option(
        "--json",
        metavar="FILE",
        help="Also write as JSON what is printed; - for standard output.",
        callback=_usable_json,
    ),
]


LeaveOutRegimes = Annotated[
    bool,
    typer.Option(
        "--leave-out-regimes",
        help="Leave out the stretches in which a winch obeys another equation than in the rest of"
        " the recording, such as without its load; they are named in any case.",
    ),
]


def new_folder(name: str) -> Path:
    """Return a folder for a recording that does not exist yet, named after what and when."""
    first = Path("recordings") / f"{name}-{datetime.now():%Y%m%d-%H%M%S}"
    later = (first.with_name(f"{first.name}-{number}") for number in count(2))
    return next(folder for folder in chain([first], later) if not folder.exists())
