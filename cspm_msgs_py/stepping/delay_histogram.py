"""How late messages were, counted by classes of delay."""

from __future__ import annotations

from bisect import bisect_left

from typing_extensions import Self

# Upper bounds of the classes [ms]; what is later than the last is counted behind it.
UP_TO_MS = (0.25, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0)
_MS = 1_000_000


class DelayHistogram:
    """Counts delays.

    Attributes:
        counts: how many there were in each class of `UP_TO_MS`, and beyond, (10,).
    """

    def __init__(self, counts: list[int] | None = None) -> None:
        """Begin with these counts, or with none."""
        self.counts = counts or [0] * (len(UP_TO_MS) + 1)

    @classmethod
    def from_text(cls, text: str) -> Self:
        """Return what `str` wrote."""
        return cls([int(word) for word in text.split()])

    def add(self, delay_ns: int) -> None:
        """Count a delay [ns]; a bound belongs to the class below it."""
        self.counts[bisect_left(UP_TO_MS, delay_ns / _MS)] += 1

    @property
    def total(self) -> int:
        """How many were counted."""
        return sum(self.counts)

    def share_above(self, bound_ms: float) -> float:
        """Return the share of delays above one of the bounds of `UP_TO_MS` [ms]; 0 of none."""
        later = sum(self.counts[UP_TO_MS.index(bound_ms) + 1 :])
        return later / self.total if self.total else 0.0

    def __str__(self) -> str:
        """Return the counts, as `from_text` reads them."""
        return " ".join(map(str, self.counts))
