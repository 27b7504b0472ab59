"""A process whose delay moves winches may go before all others, and keep its memory."""

from __future__ import annotations

import ctypes
import os

# Of <sys/mman.h>: what is mapped now, what will be, and each page once it is used.
_CURRENT, _FUTURE, _ON_FAULT = 1, 2, 4


def put_ahead(priority: int) -> str:
    """Let this process's threads run before all ordinary ones, and keep its memory from the disk.

    Threads that they start inherit it.

    Args:
        priority: of `SCHED_FIFO`, 1 to 99.

    Returns:
        what the system did not permit, for the log; empty if all is as asked.
    """
    refused = []
    if not _schedule(priority):
        refused.append(f"SCHED_FIFO {priority} (limit rtprio, or CAP_SYS_NICE)")
    if not _lock_memory():
        refused.append("locked memory (limit memlock, or CAP_IPC_LOCK)")
    return " and ".join(refused)


def _schedule(priority: int) -> bool:
    try:
        for thread in map(int, os.listdir("/proc/self/task")):
            os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(priority))
    except (OSError, AttributeError):
        # Not permitted, or the system knows no such thing.
        return False
    return True


def _lock_memory() -> bool:
    try:
        lock = ctypes.CDLL(None).mlockall
    except (OSError, AttributeError):
        return False
    return bool(lock(_CURRENT | _FUTURE | _ON_FAULT) == 0)
