"""Work on several items at once."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Given = TypeVar("Given")
Made = TypeVar("Made")


def side_by_side(
    call: Callable[[Given], Made], items: Iterable[Given], most: int | None = None
) -> list[Made]:
    """Return what a call makes of each item, in their order; threads share the processors.

    Worth it where a call's time goes into kernels, which leave Python to others.

    Args:
        call: made in several threads at once.
        items: what it gets, one each.
        most: calls at once, where each takes much memory; None: as many as there are processors.
    """
    processors = os.cpu_count() or 1
    with ThreadPoolExecutor(processors if most is None else min(most, processors)) as pool:
        return list(pool.map(call, items))
