"""One thing that looks wrong in an import."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Suspicion:
    """What was seen, where, and with which numbers. It changes nothing: people decide.

    Attributes:
        where: topic, with the field where it is one.
        kind: one word for programs.
        text: for people.
        numbers: behind the text, SI.
    """

    where: str
    kind: str
    text: str
    numbers: dict[str, float] = field(default_factory=dict)
