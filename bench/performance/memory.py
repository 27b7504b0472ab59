"""Memory of a long run, watched from outside."""

from __future__ import annotations

import shutil
import time

import numpy as np

from bench.performance.child import SAMPLE_S, start_cspm, watched
from bench.performance.measured_figure import Advance, Figure
from cspm_msgs_py.new_folder import ScratchFolder

GROUP = "memory, worst case"
BYTES_PER_SECOND = 1.6e6
# Start-up lies before, the run's picture behind.
STEADY = (0.25, 0.9)
# In a shorter run the allocator still settles.
SHORTEST_FOR_GROWTH_S = 600.0


def measure_memory(duration: float, recorded: bool, advance: Advance) -> list[Figure]:
    """Run for `duration` [s] of simulated time and watch the process's resident memory."""
    with ScratchFolder("bench") as place:
        needed = BYTES_PER_SECOND * duration * recorded
        if shutil.disk_usage(place).free < 1.5 * needed:
            raise RuntimeError(
                f"{place}: {needed / 1e9:.1f} GB and half as much again must be free"
            )
        target = ["--out", str(place / "long")] if recorded else ["--no-record"]
        seconds, sizes = _watch(["run", "worst_case", "--duration", str(duration), *target])
    advance(GROUP)
    what = f"{duration:g} s {'with' if recorded else 'without'} recording"
    note = f"took {seconds[-1]:.0f} s, sampled every {SAMPLE_S:g} s"
    figures = [Figure(GROUP, f"peak, {what}", "MB", [float(sizes.max())], at_most=500.0, note=note)]
    if duration >= SHORTEST_FOR_GROWTH_S:
        steady = slice(*(int(part * len(seconds)) for part in STEADY))
        slope = np.polyfit(seconds[steady], sizes[steady], 1)[0]
        growth = float(slope * seconds[-1] / duration * 3600.0)
        note = f"slope per simulated hour, from {STEADY[0]:.0%} to {STEADY[1]:.0%} of that run"
        figures.append(Figure(GROUP, f"growth, {what}", "MB/h", [growth], note=note))
    return figures


def _watch(arguments: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and resident memory [MB] of a run."""
    began = time.perf_counter()
    looks = watched(start_cspm(arguments, {}), lambda process: process.memory_info().rss / 1e6)
    samples = [(time.perf_counter() - began, size) for size in looks]
    # A process that has ended and was not yet collected has no memory left.
    found = np.array([sample for sample in samples if sample[1] > 0.0])
    return found[:, 0], found[:, 1]
