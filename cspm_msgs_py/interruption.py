"""An orderly end on Ctrl-C: signals become a flag that work looks at between two steps."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """Return whether SIGINT or SIGTERM came, as a function; a second one ends the program.

    Only the main thread receives signals; in another the function is always false.
    """
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    seen: list[int] = []

    def note(number: int, _: FrameType | None) -> None:
        seen.append(number)
        for each, handler in previous.items():
            signal.signal(each, handler)

    signals = (signal.SIGINT, signal.SIGTERM)
    previous = {each: signal.signal(each, note) for each in signals}
    try:
        yield lambda: bool(seen)
    finally:
        for each, handler in previous.items():
            signal.signal(each, handler)
