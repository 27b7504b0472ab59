"""Cables of one kind, by their names."""

from __future__ import annotations

import re
from collections.abc import Sequence


def cable_groups(names: Sequence[str]) -> dict[str, list[int]]:
    """Return the indices of cables whose names differ in a last number only: `hoist_1`, `hoist_2`.

    In the order in which they first appear.
    """
    groups: dict[str, list[int]] = {}
    for i, name in enumerate(names):
        groups.setdefault(re.sub(r"[_-]?\d+$", "", name) or name, []).append(i)
    return groups
