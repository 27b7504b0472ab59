"""From the start of the process to the first chunk in its recording."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path

from bench.performance.child import finish, start_cspm
from bench.performance.measured_figure import Advance, Figure
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.recording.mcap_file import McapFile

GROUP = "start-up, rest"
POLL_S = 0.005


def measure_start_up(first: int, later: int, advance: Advance) -> list[Figure]:
    """Start `first` times with nothing compiled, and `later` times with what these compiled."""
    fresh, warm = [], []
    for i in range(first):
        with ScratchFolder("bench") as cache:
            fresh.append(_time_to_first_chunk(cache))
            advance(GROUP)
            if i == first - 1:
                for _ in range(later):
                    warm.append(_time_to_first_chunk(cache))
                    advance(GROUP)
    note = "from the start of the process to the first chunk on disk, 50 steps after the first"
    return [
        Figure(
            GROUP, "first run ever: compiles", "s", fresh, at_most=20.0, note=f"{first} ×, {note}"
        ),
        Figure(GROUP, "later runs", "s", warm, at_most=2.0, note=f"{later} ×, {note}"),
    ]


def _time_to_first_chunk(cache: Path) -> float:
    with ScratchFolder("bench") as place:
        folder = place / "start"
        began = time.perf_counter()
        child = start_cspm(
            ["run", "rest", "--duration", "1", "--out", str(folder)],
            {"NUMBA_CACHE_DIR": str(cache)},
        )
        elapsed = _wait_for_chunk(child, folder / "start_0.mcap", began)
        finish(child)
    return elapsed


def _wait_for_chunk(child: subprocess.Popen[str], path: Path, began: float) -> float:
    while not _has_chunk(path):
        if child.poll() is not None and not _has_chunk(path):
            finish(child)
            raise RuntimeError("cspm ended without a recording")
        time.sleep(POLL_S)
    return time.perf_counter() - began


def _has_chunk(path: Path) -> bool:
    if not path.exists():
        return False
    try:
        with McapFile(path, use_summary=False) as file:
            return bool(file.chunks)
    except InputError:
        # So young that its header is not complete.
        return False
