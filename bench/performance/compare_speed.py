"""How long `cspm compare` takes for ten minutes at 1 kHz, from its start to the written report.

Apart from `python -m bench`, since the recording alone takes half a minute and a gigabyte.
"""

from __future__ import annotations

import argparse
import os
import resource
import time
from pathlib import Path

from rich.console import Console

from bench.performance.child import finish, start_cspm
from bench.performance.host import describe_machine, is_busy
from cspm_msgs_py.new_folder import ScratchFolder


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m bench.performance.compare_speed", description=__doc__
    )
    parser.add_argument("--scenario", default="calm", help="with all sensors at 1 kHz: calm")
    parser.add_argument("--duration", type=float, default=600.0, metavar="SECONDS")
    parser.add_argument("--recording", type=Path, help="compare this one instead of a new one")
    options = parser.parse_args()
    console = Console()
    for key, value in describe_machine().items():
        console.print(f"{key}: {value}", highlight=False, soft_wrap=True)
    if is_busy():
        console.print("other programs are at work: the wall clock will show too much")
    with ScratchFolder("bench") as place:
        recording = options.recording or place / "recording"
        if options.recording is None:
            settings = ["--set", f"duration={options.duration}", "--out", str(recording)]
            _cspm("run", options.scenario, *settings)
        begin, spent = time.perf_counter(), _children_cpu()
        _cspm("compare", str(recording), "--out", f"{place}/report")
        wall, cpu = time.perf_counter() - begin, _children_cpu() - spent
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024.0
    load = os.getloadavg()[0]
    console.print(
        f"cspm compare: {cpu:.1f} s of processor time, {wall:.1f} s by the clock at a load of"
        f" {load:.1f} in the last minute, {peak:.0f} MB at most",
        soft_wrap=True,
    )


def _cspm(*words: str) -> None:
    finish(start_cspm(words, {}))


def _children_cpu() -> float:
    times = os.times()
    return times.children_user + times.children_system


if __name__ == "__main__":
    main()
