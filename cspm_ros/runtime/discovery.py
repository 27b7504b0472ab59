"""When the readers of a graph are connected."""

from __future__ import annotations

from collections.abc import Sequence


class Discovery:
    """Decides when the readers that are there are connected, so that no first message is lost."""

    CALM_S = 0.5
    LONGEST_S = 5.0

    def __init__(self) -> None:
        self._seen: tuple[tuple[int, int], ...] | None = None
        self._began_s = self._changed_s = 0.0

    def complete(self, found: Sequence[tuple[int, int]], now_s: float) -> bool:
        """Return whether playing may begin.

        Args:
            found: for each topic how many readers are known and how many are connected.
            now_s: wall time [s].
        """
        if self._seen is None:
            self._began_s = now_s
        if tuple(found) != self._seen:
            self._seen, self._changed_s = tuple(found), now_s
        connected = all(known <= matched for known, matched in found)
        calm = now_s - self._changed_s >= self.CALM_S
        return (connected and calm) or now_s - self._began_s >= self.LONGEST_S
