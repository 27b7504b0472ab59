"""A process that nobody computes from gives way to those of its run."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

_NICE = 10


def put_behind(process: int) -> None:
    """Have a process that has just begun wait for a free processor, as far as the system allows.

    The threads that it starts then preempt nobody when they are woken, and have a tenth of others'
    share while these want all.

    Args:
        process: its number; it leads a session of its own.
    """
    # A container may forbid it: then all are alike, as where the system knows no such thing.
    with suppress(OSError, AttributeError):
        os.sched_setscheduler(process, os.SCHED_BATCH, os.sched_param(0))
        nice = os.getpriority(os.PRIO_PROCESS, process)
        os.setpriority(os.PRIO_PROCESS, process, max(_NICE, nice))
        # Linux may share processors out by sessions.
        Path(f"/proc/{process}/autogroup").write_text(str(_NICE))
