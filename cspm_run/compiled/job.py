"""What is to be done in a step of a run, by compiled code or by Python."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from cspm_model.phase import Phase


@dataclass
class Job:
    """One thing in a step.

    Attributes:
        python: does it, at a step.
        first: the first step at which it is due.
        divider: steps from one time to the next.
        topics: what it sends when compiled code did it.
        phase: its compiled form, None without any.
        rebind: returns the phase anew after Python had to do it.
        look: looks at what compiled code left of it, at a step.
        changes: whether, done by Python, it may change what is done next.
    """

    python: Callable[[int], None]
    first: int = 0
    divider: int = 1
    topics: tuple[str, ...] = ()
    phase: Phase | None = None
    rebind: Callable[[], Phase | None] | None = None
    look: Callable[[int], None] | None = None
    changes: bool = False

    def due_from(self, step: int) -> int:
        """Return the first step from `step` on at which it is due."""
        periods = max(0, -(-(step - self.first) // self.divider))
        return self.first + periods * self.divider

    def address(self) -> int:
        """Return the kernel's address, 0 where Python is to do it."""
        phase = self.phase
        return phase.address if phase is not None and phase.ready() else 0
