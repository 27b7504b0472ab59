"""Diagnose recordings in processes that are given nothing else to read."""

from __future__ import annotations

import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from cspm_bringup.blind.truth import RECORDINGS, results_of
from cspm_ident.blind.method import CSPM, require_method
from cspm_msgs_py.errors import InputError

DIAGNOSIS, TIMES, FAILURE = "diagnosis.json", "times.json", "failure.txt"
_KEPT = ("PATH", "LANG", "LD_LIBRARY_PATH", "VIRTUAL_ENV")
_THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")

Tell = Callable[[str, int, int], None]


def run(
    folder: Path, tell: Tell = lambda text, done, total: None, method: str = CSPM
) -> dict[str, str]:
    """Diagnose every recording without a result; return what failed, with the reason.

    Each result is there whole or not at all, so that an interrupted run goes on where it was.

    Args:
        folder: the benchmark's.
        tell: called with what is being done, how much of it is done, and how much there is.
        method: one of `METHODS`.

    Raises:
        InputError: no recordings there, no such method, or one whose packages are not there.
    """
    require_method(method)
    recordings = folder / RECORDINGS
    places = sorted(recordings.iterdir()) if recordings.is_dir() else []
    # A folder is empty where the controllers lost the bar.
    names = [place.name for place in places if any(place.iterdir())]
    if not names:
        raise InputError(f"{folder}: no {RECORDINGS}, allowed: a folder of `cspm blind make`")
    failed = {}
    for done, name in enumerate(names):
        tell(f"diagnosing {name}", done, len(names))
        place = results_of(folder, method) / name
        if not place.exists():
            _diagnose(method, recordings / name, place)
        if (place / FAILURE).exists():
            failed[name] = (place / FAILURE).read_text(encoding="utf-8").splitlines()[-1]
    tell("diagnosed", len(names), len(names))
    return failed


def _diagnose(method: str, recording: Path, place: Path) -> None:
    part = place.with_name(f".part-{place.name}")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    with tempfile.TemporaryDirectory(prefix="cspm-blind-") as room:
        copy = Path(room) / recording.name
        shutil.copytree(recording, copy)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        begun = time.perf_counter()
        done = subprocess.run(
            [sys.executable, "-m", "cspm_bringup.blind.confined", method, copy.name, DIAGNOSIS],
            cwd=room,
            env=environment(Path(room)),
            capture_output=True,
            text=True,
            check=False,
        )
        wall = time.perf_counter() - begun
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        cpu = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
        found = Path(room) / DIAGNOSIS
        if done.returncode == 0 and found.exists():
            shutil.copy(found, part / DIAGNOSIS)
        else:
            said = done.stderr.strip() or f"exit {done.returncode}, nothing said"
            (part / FAILURE).write_text(f"{said}\n", encoding="utf-8")
    (part / TIMES).write_text(json.dumps({"wall_s": wall, "cpu_s": cpu}), encoding="utf-8")
    part.rename(place)


def environment(room: Path) -> dict[str, str]:
    """Return what a confined process knows of its surroundings: the code, and its own room."""
    kept = {name: os.environ[name] for name in (*_KEPT, *_THREADS) if name in os.environ}
    code = str(Path(__file__).resolve().parents[2])
    home = {"HOME": str(room), "TMPDIR": str(room), "MPLCONFIGDIR": str(room)}
    return kept | home | {"PYTHONPATH": code, "PYTHONSAFEPATH": "1"}
