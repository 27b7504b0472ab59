"""Estimated numbers with their intervals."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Parameter:
    """An estimated number.

    Attributes:
        name: as the effect or the test-bed file calls it.
        element: the cable or body that it is of; empty for the whole machine.
        value: in `unit`.
        unit: SI.
        ci95: 95 % interval; None where nothing bounds it, and where the value is no result.
    """

    name: str
    element: str
    value: float
    unit: str
    ci95: tuple[float, float] | None


class Parameters(Mapping[Any, Parameter]):
    """Estimated numbers by name, or by name and element where several elements have them.

    Examples:
        >>> found = Parameters([Parameter("torque", "sway_3", 0.03, "N·m", (0.029, 0.031))])
        >>> found["torque"].ci95
        (0.029, 0.031)
        >>> found["torque", "sway_3"].value
        0.03
    """

    def __init__(self, found: Iterable[Parameter] = ()) -> None:
        """Take all numbers that belong together."""
        self._found = tuple(found)

    def __getitem__(self, key: str | tuple[str, str]) -> Parameter:
        name, element = key if isinstance(key, tuple) else (key, None)
        fitting = [p for p in self._found if p.name == name and element in (None, p.element)]
        if len(fitting) == 1:
            return fitting[0]
        raise KeyError(f"{key}, allowed: {', '.join(map(repr, self)) or 'none'}")

    def __iter__(self) -> Iterator[str | tuple[str, str]]:
        several = len({p.element for p in self._found}) > 1
        return iter((p.name, p.element) if several else p.name for p in self._found)

    def __len__(self) -> int:
        return len(self._found)

    def __repr__(self) -> str:
        return f"Parameters({list(self._found)!r})"
