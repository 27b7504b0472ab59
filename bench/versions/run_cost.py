"""What `cspm run` costs of the processor, in any version that has this command.

Processor time of all threads, which other programs on the computer change less than time by the
clock. A simulated second is the difference of a long and a short run, so that start-up drops out.
"""

from __future__ import annotations

import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

_COMMAND = str(Path(sys.executable).with_name("cspm"))
_SHORT_S, _LONG_S, _REPEATS = 1.0, 121.0, 3


def processor_time(*words: str) -> float:
    """Return the processor time that a command takes [s].

    Raises:
        subprocess.CalledProcessError: it fails.
    """
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([_COMMAND, *words], check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _run(scenario: str, duration: float, *options: str) -> float:
    return processor_time("run", scenario, "--duration", f"{duration:g}", *options)


def _second(scenario: str, *options: str) -> float:
    """Return the processor time of a simulated second [ms]."""
    long, short = (_run(scenario, each, *options) for each in (_LONG_S, _SHORT_S))
    return 1e3 * (long - short) / (_LONG_S - _SHORT_S)


class RunCost:
    """A simulated second of the worst case, and the start of commands."""

    timeout = 900.0

    def setup(self) -> None:
        """Compile what all runs share."""
        _run("worst_case", 0.01, "--no-record")

    def track_closed_loop(self) -> float:
        """Return the processor time of a simulated second [ms]."""
        return statistics.median(_second("worst_case", "--no-record") for _ in range(_REPEATS))

    def track_recorded(self) -> float:
        """Return the processor time of a simulated second that is recorded [ms]."""
        with tempfile.TemporaryDirectory() as place:
            each = [
                1e3
                * (
                    _run("worst_case", _LONG_S, "--out", f"{place}/long-{k}")
                    - _run("worst_case", _SHORT_S, "--out", f"{place}/short-{k}")
                )
                / (_LONG_S - _SHORT_S)
                for k in range(_REPEATS)
            ]
        return statistics.median(each)

    def track_later_start(self) -> float:
        """Return the processor time until the first step with all compiled [ms]."""
        return 1e3 * statistics.median(
            _run("worst_case", 0.01, "--no-record") for _ in range(_REPEATS)
        )

    def track_help(self) -> float:
        """Return the processor time of a command that simulates nothing [ms]."""
        return 1e3 * statistics.median(processor_time("--help") for _ in range(_REPEATS))


for _each in (
    RunCost.track_closed_loop,
    RunCost.track_recorded,
    RunCost.track_later_start,
    RunCost.track_help,
):
    _each.unit = "ms"  # type: ignore[attr-defined]
