"""How many recordings are worked at at a time."""

from __future__ import annotations

import os

from cspm_msgs_py.errors import InputError


def jobs_of(wanted: int | None) -> int:
    """Return how many are wanted; None: as many as there are processors.

    Raises:
        InputError: fewer than one.
    """
    if wanted is not None and wanted < 1:
        raise InputError(f"--jobs {wanted}: allowed: 1 or more")
    return wanted or os.cpu_count() or 1
