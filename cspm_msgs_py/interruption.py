"""An orderly end on Ctrl-C: signals become a flag that work looks at between two steps."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class _Flag:
    """What hears the first signal, and leaves the next one to whoever heard them before."""

    def __init__(self) -> None:
        """Hear signals from now on."""
        self.came = False
        self.previous = {each: signal.getsignal(each) for each in _SIGNALS}
        for each in _SIGNALS:
            signal.signal(each, self)

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Note a signal, also for the work that this one is a part of."""
        self.came = True
        self.restore()
        around = self.previous[signal.Signals(number)]
        if isinstance(around, _Flag):
            around(number, frame)

    def restore(self) -> None:
        """Put back what heard the signals before."""
        for each, handler in self.previous.items():
            signal.signal(each, handler)


@contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """Return whether SIGINT or SIGTERM came, as a function; a second one ends the program.

    Within another one a signal is seen by both. Only the main thread receives signals; in another
    the function is always false.
    """
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    flag = _Flag()
    try:
        yield lambda: flag.came
    finally:
        if not flag.came:
            flag.restore()
