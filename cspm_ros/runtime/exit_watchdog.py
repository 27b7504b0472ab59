"""An end for a process that the middleware does not let go."""

from __future__ import annotations

import faulthandler
import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager

# Exit codes of a process that left in order; a signal is negative.
IN_ORDER = frozenset({0, -signal.SIGALRM})


@contextmanager
def exit_watchdog() -> Iterator[Callable[[float, bool], None]]:
    """Yield what gives the rest of the block so long [s]: then the system ends the process.

    It is called with that time, and with whether the process has failed. One that has not is ended
    by SIGALRM, one that has with exit code 1, so that a failure is never taken for an orderly end.
    A participant of Fast DDS 2.14 that leaves while another does may wait for itself without end,
    with Python's lock held: nothing written in Python could end it.
    """
    with open(os.devnull, "wb") as nowhere:

        def begin(seconds: float, failed: bool) -> None:
            if failed:
                faulthandler.dump_traceback_later(seconds, exit=True, file=nowhere)
            else:
                signal.signal(signal.SIGALRM, signal.SIG_DFL)
                signal.setitimer(signal.ITIMER_REAL, seconds)

        try:
            yield begin
        finally:
            faulthandler.cancel_dump_traceback_later()
            signal.setitimer(signal.ITIMER_REAL, 0.0)
