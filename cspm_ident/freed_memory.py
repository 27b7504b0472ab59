"""Freed memory, given back to the system."""

from __future__ import annotations

import ctypes


def give_back() -> None:
    """Have the C library return what it holds of freed memory, where it is glibc.

    It keeps the arrays of one step for the next, which needs other ones. Of a recording of ten
    minutes these are some hundred megabytes.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
