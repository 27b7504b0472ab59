"""How long work reports how far it is."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import ParamSpec, TypeAlias, TypeVar

Arguments = ParamSpec("Arguments")
Found = TypeVar("Found")

# Called with the share that is done, 0 to 1, and what is being done.
Progress: TypeAlias = Callable[[float, str], None]


def silent(share: float, what: str) -> None:
    """Report to nobody."""


def shows_progress(
    what: str,
) -> Callable[[Callable[Arguments, Found]], Callable[Arguments, Found]]:
    """Let a function with `progress` show how far it is, where a person watches and gives none.

    A terminal has a bar, and a notebook a line every 10 s. `progress=silent` shows nothing.

    Args:
        what: the function does, until it reports another name.
    """

    def decorated(function: Callable[Arguments, Found]) -> Callable[Arguments, Found]:
        taken = signature(function)

        @wraps(function)
        def called(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Found:
            if not is_watched() or "progress" in taken.bind_partial(*args, **kwargs).arguments:
                return function(*args, **kwargs)
            # A script that nobody watches need not wait for what draws bars.
            from rich.console import Console

            from cspm.commands.progress_shown import shown

            with shown(Console(stderr=True), what) as progress:
                kwargs["progress"] = progress
                return function(*args, **kwargs)

        return called

    return decorated


def is_watched() -> bool:
    """Return whether a person sees standard error as it comes: in a terminal or a notebook."""
    return "ipykernel" in sys.modules or sys.stderr.isatty()


def by_steps(progress: Progress) -> Callable[[str], None]:
    """Return what takes the name of each step of work whose number of steps is not known.

    The share is an estimate: each step takes a tenth of what is left.
    """
    left = 1.0

    def step(what: str) -> None:
        nonlocal left
        progress(1.0 - left, what)
        left *= 0.9

    return step
