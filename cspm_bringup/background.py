"""A process that nobody computes from gives way to those of its run."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

_NICE = 10
_TASKS, _AUTOGROUP = Path("/proc/self/task"), Path("/proc/self/autogroup")


def give_way() -> None:
    """Have all threads of this process wait for a free processor, as far as the system allows.

    Its threads then preempt nobody when they are woken, and have a tenth of others' share while
    these want all.
    """
    if not _TASKS.is_dir():
        return
    for task in map(int, os.listdir(_TASKS)):
        # A thread may have ended meanwhile, and a container may forbid it: then it is as before.
        with suppress(OSError):
            os.sched_setscheduler(task, os.SCHED_BATCH, os.sched_param(0))
            os.setpriority(os.PRIO_PROCESS, task, max(_NICE, os.getpriority(os.PRIO_PROCESS, task)))
    with suppress(OSError):
        # Linux may share processors out by sessions, and nodes have one each.
        _AUTOGROUP.write_text(str(_NICE))
