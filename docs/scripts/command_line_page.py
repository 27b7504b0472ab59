"""The page `docs/reference/command-line.md`, from the commands themselves.

Run `python docs/scripts/command_line_page.py` after changing a command or an option.
"""

import importlib
import pkgutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Protocol

import typer

import cspm.cli.app


class Parameter(Protocol):
    """What a command shows of one argument or option."""

    opts: list[str]
    secondary_opts: list[str]
    metavar: str | None


class Command(Protocol):
    """What a command shows of itself."""

    help: str | None

    @property
    def params(self) -> Sequence[Parameter]:
        """Its arguments and options."""


PAGE = Path(__file__).resolve().parents[1] / "reference" / "command-line.md"
_HEAD = """\
# Command line

Every command with its arguments and options, as `cspm COMMAND --help` shows them. Exit codes: 0
done, 1 the result is negative or incomplete, 2 unusable input, 130 interrupted by Ctrl-C before
there was a result.

This page is generated: `python docs/scripts/command_line_page.py`.
"""


def commands() -> Iterator[tuple[str, Command]]:
    """Yield every command with what is typed for it, groups left out."""
    for module in pkgutil.iter_modules(cspm.cli.__path__, "cspm.cli."):
        importlib.import_module(module.name)
    yield from _below(typer.main.get_command(cspm.cli.app.app), "cspm")


def _below(command: Command, name: str) -> Iterator[tuple[str, Command]]:
    below = getattr(command, "commands", None)
    if below is None:
        yield name, command
    else:
        # A hidden command is another one's former name.
        for word, each in sorted((w, c) for w, c in below.items() if not c.hidden):
            yield from _below(each, f"{name} {word}")


def page() -> str:
    """Return the page as Markdown."""
    return _HEAD + "".join(_section(name, command) for name, command in commands())


def _section(name: str, command: Command) -> str:
    rows = [_row(each) for each in command.params if not getattr(each, "hidden", False)]
    table = "\n".join(["| option | value | meaning |", "|---|---|---|", *rows])
    text = " ".join((command.help or "").split("\n\n")[0].split())
    return f"\n## {name}\n\n{text}\n\n{table}\n"


def _row(parameter: Parameter) -> str:
    names = [*parameter.opts, *parameter.secondary_opts]
    option = ", ".join(f"`{each}`" for each in names if each.startswith("-"))
    value = parameter.metavar or getattr(getattr(parameter, "type", None), "name", "")
    meaning = " ".join((getattr(parameter, "help", None) or "").split())
    cells = (option or "argument", f"`{value}`", meaning)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
