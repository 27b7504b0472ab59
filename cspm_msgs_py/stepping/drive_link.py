"""What a plant and the controller inside its drives hand each other without a message."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
# Takes a topic, a stamp [ns] and a row.
Receive = Callable[[str, int, Array], None]


class DriveLink:
    """Joins both in one process; each sets what it takes.

    What is measured at an instant is kept until all of it is there, and is then handed on with the
    topic that the controller answers as the last.

    Attributes:
        receive: takes what the plant measures; set by the controller.
        tick: called once all of an instant was handed on; set by the controller.
        command: takes torque commands; set by the plant.
        brake: takes whether brakes are to be set; set by the plant.
        now_ns: the time that the drives live in [ns]; set by the plant.
    """

    def __init__(self, answered: str) -> None:
        """Take the topic that the controller answers."""
        self._answered = answered
        self._measured: list[tuple[str, int, Array]] = []
        self._commands: deque[tuple[str, int, Array]] = deque()
        self._running = False
        self.receive: Receive = _ignore
        self.tick: Callable[[], None] = lambda: None
        self.command: Receive = _ignore
        self.brake: Callable[[bool], None] = lambda _: None
        self.now_ns: Callable[[], int] = lambda: 0

    def measure(self, topic: str, stamp_ns: int, row: Array) -> None:
        """Keep what the plant measured; the row may change after the call."""
        self._measured.append((topic, stamp_ns, row.copy()))

    def order(self, topic: str, stamp_ns: int, row: Array) -> None:
        """Keep what the controller commands; the row may change after the call."""
        self._commands.append((topic, stamp_ns, row.copy()))

    def run(self) -> None:
        """Hand on what was kept, and what comes of it; to be called after `measure` and `order`.

        Neither side is called while it is at work: a call from within leaves all to the first.
        """
        if self._running:
            return
        self._running = True
        try:
            while self._commands or self._measured:
                if self._commands:
                    self.command(*self._commands.popleft())
                else:
                    self._deliver()
        finally:
            self._running = False

    def _deliver(self) -> None:
        kept = sorted(self._measured, key=lambda each: each[0] == self._answered)
        self._measured.clear()
        for topic, stamp_ns, row in kept:
            self.receive(topic, stamp_ns, row)
        self.tick()


def _ignore(_topic: str, _stamp_ns: int, _row: Array) -> None:
    """Take nothing."""
