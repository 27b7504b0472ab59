"""What all commands of the command line share."""

from __future__ import annotations

from datetime import datetime
from itertools import chain, count
from pathlib import Path
from typing import Annotated

import typer
import typer.core

from cspm_msgs_py.errors import InputError

RUN_FAILED = 1


class _Listed(typer.core.TyperGroup):
    """Lists the commands in the order in which a newcomer needs them."""

    order = (
        *("run", "info", "recover", "resim", "import", "compare", "identify"),
        *("diagnose", "analyze"),
        *("replay", "check-drivers", "node"),
    )

    def list_commands(self, ctx: typer.Context) -> list[str]:  # type: ignore[override]
        """Return the names, those without a place at the end."""
        names = super().list_commands(ctx)
        return sorted(names, key=lambda n: self.order.index(n) if n in self.order else len(names))


app = typer.Typer(cls=_Listed, add_completion=False, pretty_exceptions_enable=False)


def _usable_json(path: Path | None) -> Path | None:
    """Refuse a file that cannot be written before the work that fills it."""
    if path is not None and (path.is_dir() or not path.absolute().parent.is_dir()):
        raise InputError(f"--json {path}: allowed: a file in a folder that exists")
    return path


Json = Annotated[
    Path | None,
    typer.Option(
        "--json",
        metavar="FILE",
        help="Also write as JSON what is printed.",
        callback=_usable_json,
    ),
]


def new_folder(name: str) -> Path:
    """Return a folder for a recording that does not exist yet, named after what and when."""
    first = Path("recordings") / f"{name}-{datetime.now():%Y%m%d-%H%M%S}"
    later = (first.with_name(f"{first.name}-{number}") for number in count(2))
    return next(folder for folder in chain([first], later) if not folder.exists())
