"""One measured figure: its samples, and what it is to reach."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

# Called with what was done, once per part.
Advance = Callable[[str], None]


@dataclass(frozen=True)
class Figure:
    """A figure of the table.

    Attributes:
        group: its heading.
        what: what was measured.
        unit: of the samples.
        samples: one per repetition.
        at_least: what the median should reach, if anything.
        at_most: what the median should stay below, if anything.
        note: how it was measured.
    """

    group: str
    what: str
    unit: str
    samples: Sequence[float]
    at_least: float | None = None
    at_most: float | None = None
    note: str = ""

    @property
    def median(self) -> float:
        """Median of the samples."""
        return float(median(self.samples))

    @property
    def reached(self) -> bool | None:
        """Whether the median is where it should be; None without a target."""
        if self.at_least is not None:
            return self.median >= self.at_least
        return self.median <= self.at_most if self.at_most is not None else None

    @property
    def reach(self) -> str:
        """The target, in words."""
        if self.at_least is not None:
            return f"≥ {self.at_least:g}"
        return f"≤ {self.at_most:g}" if self.at_most is not None else ""

    def data(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return {
            "group": self.group,
            "what": self.what,
            "unit": self.unit,
            "median": self.median,
            "min": min(self.samples),
            "max": max(self.samples),
            "repetitions": len(self.samples),
            "reach": self.reach,
            "reached": self.reached,
            "note": self.note,
        }
