"""An end for a process that the middleware does not let go."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager

# Exit codes of a process that left in order; a signal is negative.
IN_ORDER = frozenset({0, -signal.SIGALRM})


@contextmanager
def exit_watchdog() -> Iterator[Callable[[float], None]]:
    """Yield what gives the rest of the block so long [s]: then the system ends the process.

    A participant of Fast DDS 2.14 that leaves while another does may wait for itself without end,
    with Python's lock held, so that nothing written in Python could end it. The signal is SIGALRM.
    """

    def begin(seconds: float) -> None:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, seconds)

    try:
        yield begin
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
