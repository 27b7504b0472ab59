"""Cables of one kind, by their names."""

from __future__ import annotations

from collections.abc import Sequence

from cspm_msgs_py.control_spec.per_cable import cable_kind


def cable_groups(names: Sequence[str]) -> dict[str, list[int]]:
    """Return the indices of cables whose names differ in a last number only: `hoist_1`, `hoist_2`.

    In the order in which they first appear.
    """
    groups: dict[str, list[int]] = {}
    for i, name in enumerate(names):
        groups.setdefault(cable_kind(name), []).append(i)
    return groups
