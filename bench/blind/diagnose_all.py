"""Diagnose recordings in processes that are given nothing else to read."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import as_completed
from pathlib import Path

from bench.blind.jobs import jobs_of
from bench.blind.scoring.method import CSPM, require_method
from bench.blind.truth import RECORDINGS, results_of
from cspm.campaign.cluster import worker_pool
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.new_folder import ScratchFolder

DIAGNOSIS, TIMES, FAILURE = "diagnosis.json", "times.json", "failure.txt"
_KEPT = ("PATH", "LANG", "LD_LIBRARY_PATH", "VIRTUAL_ENV")
_THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")

Tell = Callable[[str, int, int], None]


def run(
    folder: Path,
    tell: Tell = lambda text, done, total: None,
    methods: Sequence[str] = (CSPM,),
    jobs: int | None = None,
) -> dict[str, str]:
    """Diagnose every recording without a result; return what failed, with the reason.

    Each result is there whole or not at all, so that an interrupted run goes on where it was.

    Args:
        folder: the benchmark's.
        tell: called with what is being done, how much of it is done, and how much there is.
        methods: of `METHODS`, each confined with the others to one process per recording.
        jobs: recordings at a time; None: as many as there are processors.

    Raises:
        InputError: no recordings there, no such method, one whose packages are not there, or no
            jobs.
    """
    for method in methods:
        require_method(method)
    processes = jobs_of(jobs)
    recordings = folder / RECORDINGS
    places = sorted(recordings.iterdir()) if recordings.is_dir() else []
    # A folder is empty where the controllers lost the bar.
    names = [place.name for place in places if any(place.iterdir())]
    if not names:
        raise InputError(
            f"{folder}: no {RECORDINGS}, allowed: a folder of `python -m bench.blind make`"
        )
    tell(f"diagnosing {len(names)} recordings", 0, len(names))
    # Made here, so that nothing is left of a worker that is ended.
    with ScratchFolder("blind") as rooms, worker_pool(processes) as pool:
        program = (sys.executable, rooms)
        begun = {
            pool.submit(
                _diagnose, *program, recordings / name, _places(folder, methods, name)
            ): name
            for name in names
        }
        for done, task in enumerate(as_completed(begun), start=1):
            task.result()
            tell(f"diagnosed {begun[task]}", done, len(names))
    return _failures(folder, methods, names)


def _places(folder: Path, methods: Sequence[str], name: str) -> dict[str, Path]:
    return {method: results_of(folder, method) / name for method in methods}


def _failures(folder: Path, methods: Sequence[str], names: Sequence[str]) -> dict[str, str]:
    failed = {}
    for name in names:
        for method, place in _places(folder, methods, name).items():
            if (place / FAILURE).exists():
                reason = (place / FAILURE).read_text(encoding="utf-8").splitlines()[-1]
                failed[name if method == CSPM else f"{name}, {method}"] = reason
    return failed


def _diagnose(python: str, rooms: Path, recording: Path, places: Mapping[str, Path]) -> None:
    """Diagnose a recording by the methods without a result; each result goes to its place.

    Nothing is kept of a process whose worker is ended: it ends with it, by its pipe.
    """
    missing = {method: place for method, place in places.items() if not place.exists()}
    if not missing:
        return
    with tempfile.TemporaryDirectory(dir=rooms) as room:
        copy = Path(room) / recording.name
        shutil.copytree(recording, copy)
        begun = time.perf_counter()
        with subprocess.Popen(
            [python, "-m", "bench.blind.confined", copy.name, *missing],
            cwd=room,
            env=environment(Path(room)),
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            # Ctrl-C is the command's, whose workers then end.
            start_new_session=True,
        ) as process:
            assert process.stderr is not None
            error = process.stderr.read()
        wall = time.perf_counter() - begun
        said = error.strip() or f"exit {process.returncode}, nothing said"
        for method, place in missing.items():
            _keep(Path(room), method, place, said, wall)


def _keep(room: Path, method: str, place: Path, said: str, wall: float) -> None:
    """Keep what a process has left of one method, whole."""
    part = place.with_name(f".part-{place.name}")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    report, reason = room / f"{method}.json", room / f"{method}.txt"
    times = {"wall_s": wall, "cpu_s": 0.0}
    if report.exists():
        content = json.loads(report.read_text(encoding="utf-8"))
        times["cpu_s"] = content["cpu_s"]
        reported = json.dumps(content["diagnosis"], indent=2)
        (part / DIAGNOSIS).write_text(reported, encoding="utf-8")
    else:
        why = reason.read_text(encoding="utf-8") if reason.exists() else said
        (part / FAILURE).write_text(f"{why.strip()}\n", encoding="utf-8")
    (part / TIMES).write_text(json.dumps(times), encoding="utf-8")
    part.rename(place)


def environment(room: Path) -> dict[str, str]:
    """Return what a confined process knows of its surroundings: the code, and its own room."""
    kept = {name: os.environ[name] for name in _KEPT if name in os.environ}
    # As many recordings as there are processors are diagnosed at a time.
    kept |= {name: os.environ.get(name, "1") for name in _THREADS}
    code = str(Path(__file__).resolve().parents[2])
    home = {"HOME": str(room), "TMPDIR": str(room), "MPLCONFIGDIR": str(room)}
    return kept | home | {"PYTHONPATH": code, "PYTHONSAFEPATH": "1"}
