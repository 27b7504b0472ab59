"""Campaigns as a user runs them, and clusters that others have started."""

import json
import subprocess
import sys
from pathlib import Path

from cspm_process import CSPM
from pyarrow import parquet
from waiting import PATIENCE_S, until

DASK = Path(sys.executable).with_name("dask")

SWEEP = """\
scenario: calm
set: {duration: 0.5}
grid: {seed: {from: 1, to: 4}}
"""


def written(folder, text=SWEEP, name="sweep.yaml"):
    path = folder / name
    path.write_text(text)
    return path


def run(file, *options, cwd=None, **keys):
    """Run a campaign to its end; return exit code, output and errors."""
    done = subprocess.run(
        [CSPM, "campaign", file, *map(str, options)],
        capture_output=True,
        text=True,
        cwd=cwd or file.parent,
        timeout=2 * PATIENCE_S,
        **keys,
    )
    return done.returncode, done.stdout, done.stderr


def begun(file, *options, **keys):
    return subprocess.Popen(
        [CSPM, "campaign", file, *map(str, options)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=file.parent,
        **keys,
    )


def rows(folder):
    return parquet.read_table(folder / "runs.parquet").to_pylist()


def journalled(folder):
    """Return how many runs a campaign has kept."""
    place = folder / "runs.jsonl"
    return len(place.read_text().splitlines()) if place.exists() else 0


class Cluster:
    """A dask scheduler and workers as programs of their own, on loopback."""

    def __init__(self, folder, *options, protocol="tcp"):
        self._folder, self._options = folder, options
        self._file = folder / "scheduler.json"
        self._started = []
        self.scheduler = self.start(
            "scheduler",
            *("--host", f"{protocol}://127.0.0.1:0", "--dashboard-address", "127.0.0.1:0"),
            *("--scheduler-file", self._file),
        )
        until(self._file.exists, "the scheduler's file")

    @property
    def address(self):
        until(lambda: self._file.read_text().rstrip().endswith("}"), "the whole file")
        return json.loads(self._file.read_text())["address"]

    def start(self, kind, *options, **keys):
        with (self._folder / f"{kind}_{len(self._started)}.log").open("w") as log:
            process = subprocess.Popen(
                [DASK, kind, *map(str, (*options, *self._options))],
                stdout=log,
                stderr=log,
                cwd=self._folder,
                **keys,
            )
        self._started.append(process)
        return process

    def worker(self, *options, **keys):
        own = ("--scheduler-file", self._file, "--nthreads", 1, "--no-dashboard")
        return self.start("worker", *own, "--host", "127.0.0.1", *options, **keys)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for process in reversed(self._started):
            process.terminate()
        for process in reversed(self._started):
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
