"""Processor time of work, and of a simulated second."""

from __future__ import annotations

import time
from collections.abc import Callable

from cspm_msgs_py.new_folder import ScratchFolder
from cspm_run.bundle import Bundle
from cspm_run.recorded_run import run, steps_of

# Building a run is no part of its steps.
FEW_STEPS = 100


def spent(work: Callable[[], object]) -> float:
    """Return the processor time that work takes, of all threads [s]."""
    begun = time.process_time()
    work()
    return time.process_time() - begun


def loop_cost(bundle: Bundle, *, recorded: bool = False) -> float:
    """Return what a simulated second costs [s] beyond what building the run does."""
    steps = steps_of(bundle)
    few, whole = (spent(lambda n=n: run_steps(bundle, n, recorded)) for n in (FEW_STEPS, steps))
    return (whole - few) / (bundle.scenario.duration * (1.0 - FEW_STEPS / steps))


def run_steps(bundle: Bundle, steps: int, recorded: bool) -> None:
    """Make so many steps of a run, recorded or not; nothing is kept."""
    if not recorded:
        run(bundle, None, steps=steps)
        return
    with ScratchFolder("bench") as place:
        run(bundle, place / "loop", steps=steps)
