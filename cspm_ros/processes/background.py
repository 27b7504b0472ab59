"""A process that nobody computes from gives way to those of its run."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

_NICE = 10
# What a process has of a processor that others want as well, compared with them.
SHARE_BEHIND = 0.1


def put_behind(process: int) -> None:
    """Have a process wait for a free processor, as far as the system allows.

    The threads that it has or starts then preempt nobody when they are woken, and have a tenth of
    others' share while these want all.

    Args:
        process: its number; it leads a session of its own.
    """
    # A container may forbid it: then all are equal, as where the system knows no such thing.
    with suppress(OSError, AttributeError):
        for thread in map(int, os.listdir(f"/proc/{process}/task")):
            os.sched_setscheduler(thread, os.SCHED_BATCH, os.sched_param(0))
            nice = os.getpriority(os.PRIO_PROCESS, thread)
            os.setpriority(os.PRIO_PROCESS, thread, max(_NICE, nice))
        # Linux may share processors out by sessions.
        Path(f"/proc/{process}/autogroup").write_text(str(_NICE))
