"""How accurately laboratories know the numbers of their machines, where a file does not say it.

Sources and what to do where a machine is known better or worse: docs/reference/accuracies.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple


class Accuracy(NamedTuple):
    """What a number is usually off by.

    Attributes:
        sd: one standard deviation, in `unit`.
        unit: SI; `1` is a share of the number itself.
    """

    sd: float
    unit: str


ACCURACIES: Mapping[str, Accuracy] = MappingProxyType(
    {
        "exit": Accuracy(1e-3, "m"),
        "attachment": Accuracy(1e-3, "m"),
        "marker place": Accuracy(1e-3, "m"),
        "marker turn": Accuracy(1e-3, "rad"),
        "drum radius": Accuracy(3e-3, "1"),
        "stiffness": Accuracy(5e-2, "1"),
        "zero length": Accuracy(2e-3, "m"),
    }
)
"""By number: each coordinate of an exit or attachment, each of a body's markers, each length."""
