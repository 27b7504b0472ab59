"""`--held-out` of all commands that have it, and the order of recordings beside it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from shlex import quote
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from cspm_msgs_py.errors import InputError

OPTION = "--held-out"
HeldOut = Annotated[
    list[Path] | None,
    typer.Option(
        OPTION,
        metavar="REC",
        help="Judges without being fitted; repeatable, after the recordings to fit.",
    ),
]


class JudgedCommand(TyperCommand):
    """A command with `--held-out`, after which no recording to search is accepted.

    `--held-out A B` takes one recording and would search B, which reads as if both were held out.
    """

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override]
        """Return the arguments that are left, none.

        Raises:
            InputError: a recording to search comes after one that is held out.
        """
        # They are consumed.
        given = list(args)
        left = super().parse_args(ctx, args)
        if not ctx.resilient_parsing:
            refuse_searched_after_held_out(self.params, given)
        return left


def refuse_searched_after_held_out(parameters: Iterable[Any], words: Sequence[str]) -> None:
    """Refuse arguments after `--held-out`.

    Args:
        parameters: of the command, as Typer makes them.
        words: the command's, as they were typed.

    Raises:
        InputError: naming what comes after it and the forms that are allowed.
    """
    held, after = "", list[str]()
    for option, word in _separated(parameters, words):
        if option == OPTION:
            held = word
        elif not option and held:
            after.append(word)
    if after:
        options = " ".join(f"{OPTION} {quote(each)}" for each in after)
        raise InputError(
            f"{', '.join(after)}: after {OPTION} {held}, allowed: {options} to judge only,"
            f" or before the first {OPTION} to be searched"
        )


def _separated(parameters: Iterable[Any], words: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield options with their values, and arguments as values of no option, in their order."""
    valued = {name for each in parameters if not _is_bare(each) for name in each.opts}
    rest = iter(words)
    for word in rest:
        name, equals, value = word.partition("=")
        if word == "--":
            yield from (("", each) for each in rest)
        elif not word.startswith("-") or word == "-":
            yield "", word
        elif name in valued:
            yield name, value if equals else next(rest, "")


def _is_bare(parameter: Any) -> bool:  # noqa: ANN401 - as Typer makes it
    """Return whether a parameter takes no value after its name: an argument or a flag."""
    return parameter.param_type_name == "argument" or bool(parameter.is_flag or parameter.count)
