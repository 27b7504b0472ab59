"""Thresholds moved one at a time, and which of them a diagnosis reads."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, replace
from typing import Any, NamedTuple

from typing_extensions import Self

from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds

SHARE = 0.5
_NAMES = frozenset(each.name for each in fields(Thresholds))


class Move(NamedTuple):
    """One threshold at another value.

    Attributes:
        name: of the threshold.
        value: other than its default.
    """

    name: str
    value: float

    @property
    def thresholds(self) -> Thresholds:
        """All thresholds, this one moved."""
        moved: dict[str, Any] = {self.name: self.value}
        return replace(DEFAULT_THRESHOLDS, **moved)


def moves(share: float = SHARE) -> Iterator[Move]:
    """Yield every threshold down and up by a share of its value, clipped to its allowed range.

    A count moves by one at least. What is at the end of its range moves one way only.
    """
    for each in fields(Thresholds):
        own, whole = DEFAULT_THRESHOLDS.values[each.name], each.metadata["unit"] == "count"
        for sign in (-1.0, 1.0):
            value = own + sign * max(share * own, 1.0 if whole else 0.0)
            value = min(max(value, each.metadata["low"]), each.metadata["high"])
            moved = round(value) if whole else value
            if moved != own:
                yield Move(each.name, moved)


class WatchedThresholds(Thresholds):
    """Thresholds that remember which of them were read; `read` is the set of names."""

    read: set[str]

    def __new__(cls, *_: float, **__: float) -> Self:
        """Return new thresholds, none of which was read."""
        made = super().__new__(cls)
        # Before the values are checked, which reads them; frozen classes take it no other way.
        object.__setattr__(made, "read", set())
        return made

    def __getattribute__(self, name: str) -> float:
        """Return an attribute, and remember that it was read if it is a threshold."""
        if name in _NAMES:
            self.read.add(name)
        found: float = super().__getattribute__(name)
        return found


def watched() -> tuple[WatchedThresholds, set[str]]:
    """Return the default thresholds, and the set to which names of those read are added."""
    thresholds = WatchedThresholds()
    thresholds.read.clear()
    return thresholds, thresholds.read
