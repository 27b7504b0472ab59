"""How long work reports how far it is."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

# Called with the share that is done, 0 to 1, and what is being done.
Progress: TypeAlias = Callable[[float, str], None]


def silent(share: float, what: str) -> None:
    """Report to nobody."""


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
