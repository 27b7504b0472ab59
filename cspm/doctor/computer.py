"""What the computer gives a run: processors, priorities, and a browser to look at it."""

from __future__ import annotations

import os
import webbrowser
from collections.abc import Callable, Iterator

from cspm.doctor.part import Part

# A run in real time at 1 kHz fills two; see docs/how-to/run-on-ros.md.
_CORES_IN_REAL_TIME = 2
_REAL_TIME = "--mode realtime with the parameter `priority`"


def computer() -> Iterator[Part]:
    """Yield what there is of processors, priorities and browsers."""
    yield processors(usable_processors())
    yield priorities(may_go_first)
    yield browser(_browser_name)


def usable_processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def processors(count: int) -> Part:
    """Return the part of so many processors."""
    if count >= _CORES_IN_REAL_TIME:
        return Part("processors", f"{count} usable")
    line = "give this process a second one, or run in lockstep"
    return Part("processors", f"{count} usable", line, "--mode realtime at 1 kHz")


def may_go_first() -> bool:
    """Return whether the system lets this process run before all ordinary ones, by trying it."""
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except OSError:
        return False
    os.sched_setscheduler(0, *before)
    return True


def priorities(permitted: Callable[[], bool]) -> Part:
    """Return the part of priorities, where a function says whether they are permitted."""
    line = "raise the limits rtprio and memlock of your user in /etc/security/limits.conf"
    try:
        if permitted():
            return Part("priorities", "SCHED_FIFO permitted")
    except AttributeError:
        line = "a Linux"
    return Part("priorities", "SCHED_FIFO not permitted", line, _REAL_TIME)


def _browser_name() -> str:
    return webbrowser.get().name


def browser(name: Callable[[], str]) -> Part:
    """Return the part of the browser that a function names, or fails to."""
    try:
        return Part("browser", name())
    except webbrowser.Error:
        line = "open the page at its address from elsewhere, or write it with --html FILE"
        return Part("browser", "none", line, "cspm view and run --view opening by themselves")
