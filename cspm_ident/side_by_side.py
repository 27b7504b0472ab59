"""Work on several items at once."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Given = TypeVar("Given")
Made = TypeVar("Made")


def side_by_side(call: Callable[[Given], Made], items: Iterable[Given]) -> list[Made]:
    """Return what a call makes of each item, in their order; threads share the processors.

    Worth it where a call's time goes into kernels, which leave Python to others.
    """
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(call, items))
