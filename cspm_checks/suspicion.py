"""One thing that looks wrong in an import."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from cspm_checks.catalogue import CHECKS


@dataclass(frozen=True)
class Suspicion:
    """What was seen, where, and with which numbers. It changes nothing: people decide.

    Attributes:
        where: topic, with the field where it is one.
        kind: one word for programs, of the catalogue.
        text: for people.
        numbers: behind the text, SI.
        at_s: the first instants where it shows, from the first stamp of all [s].
        remedy: what repairs it, as a rule that of its kind.
        mend: the same for programs, by topic and field: `of` names the field whose source it is,
            `sign` and `scale` multiply, `offset_s` is added to its clock, the rest
            are keys of a mapping.
    """

    where: str
    kind: str
    text: str
    numbers: dict[str, float] = field(default_factory=dict)
    at_s: tuple[float, ...] = ()
    remedy: str = ""
    mend: dict[str, dict[str, Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Take the remedy of the kind."""
        if not self.remedy:
            object.__setattr__(self, "remedy", CHECKS[self.kind].remedy)
