"""How many recordings are worked at at a time."""

from __future__ import annotations

import os

from cspm_msgs_py.errors import InputError


def jobs_of(asked: int | None) -> int:
    """Return how many are asked for; None: as many as there are processors.

    Raises:
        InputError: fewer than one.
    """
    if asked is not None and asked < 1:
        raise InputError(f"--jobs {asked}: allowed: 1 or more")
    return asked or os.cpu_count() or 1
