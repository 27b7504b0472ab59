"""What keeps a machine in its safe state: the first reason stays until somebody resets it."""

from __future__ import annotations

from collections.abc import Hashable

from cspm_msgs_py.diagnostics import Level, Status

MOST_LISTED = 5
RUNNING = "running"


class Latch:
    """Closed while all is well; open from the first reason on, until `release`.

    Attributes:
        reason: the first reason, None while closed.
        since_ns: when it came [ns].
        further: how many reasons came after it.
    """

    def __init__(self) -> None:
        self.reason: str | None = None
        self.since_ns = 0
        self.further = 0
        self._others: list[str] = []
        self._standing: dict[Hashable, str] = {}

    @property
    def open(self) -> bool:
        """Whether there was a reason since the last release."""
        return self.reason is not None

    def trip(self, now_ns: int, reason: str) -> None:
        """Take a reason that came and went."""
        if self.reason is None:
            self.reason, self.since_ns = reason, now_ns
            return
        self.further += 1
        if reason != self.reason and reason not in self._others:
            self._others.append(reason)
            del self._others[MOST_LISTED:]

    def stand(self, now_ns: int, fault: Hashable, reason: str | None) -> None:
        """Take the present state of a fault that lasts: its reason, None while there is none.

        It counts as a reason when it comes, not again while it lasts, and refuses a release until
        it is gone.
        """
        if reason is None:
            self._standing.pop(fault, None)
            return
        if fault not in self._standing:
            self.trip(now_ns, reason)
        self._standing[fault] = reason

    def stands(self, fault: Hashable) -> bool:
        """Return whether a fault lasts."""
        return fault in self._standing

    def release(self) -> str | None:
        """Close the latch, or return why it stays open."""
        if not self._standing:
            self.reason, self.since_ns, self.further, self._others = None, 0, 0, []
            return None
        first, *others = self._standing.values()
        more = f" (and {len(others)} more)" if others else ""
        return f"reset refused: {first}{more}"

    def status(self, state: str, otherwise: Status) -> Status:
        """Return that the safe state `state` was entered and why; `otherwise` while closed.

        Both say in their values which of the two it is.
        """
        level, name, message, values = otherwise
        values = {**values, "state": state if self.open else RUNNING}
        values |= {"reason": self.reason or "", "further_reasons": str(self.further)}
        if self.open:
            level = Level.ERROR
            message = f"safe state {state} since {self.since_ns * 1e-9:.3f} s: {self.reason}"
            values["further"] = "; ".join(self._others)
        return Status(level, name, message, values)
