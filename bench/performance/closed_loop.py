"""The closed loop in one process, with and without recording."""

from __future__ import annotations

from bench.performance.measured_figure import Advance, Figure
from bench.performance.thesis_machine import worst_case
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_run.recorded_run import run

GROUP = "closed loop, worst case"


def measure_closed_loop(repetitions: int, duration: float, advance: Advance) -> list[Figure]:
    """Simulate `duration` [s] in turns with and without recording."""
    bundle = worst_case(duration)
    run(bundle, None, steps=10)
    silent, recorded = [], []
    for _ in range(repetitions):
        silent.append(run(bundle, None).real_time_factor)
        advance(GROUP)
        with ScratchFolder("bench") as place:
            recorded.append(run(bundle, place / "loop").real_time_factor)
        advance(GROUP)
    note = f"{repetitions} runs of {duration:g} s simulated, all rates 1 kHz, in turns"
    return [
        Figure(GROUP, "without recording", "× real time", silent, note=note),
        Figure(
            GROUP, "with recording", "× real time", recorded, 15.0, note=f"{note}, every message"
        ),
    ]
