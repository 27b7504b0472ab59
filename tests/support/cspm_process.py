"""The command line as a process of its own, and how much memory it takes."""

import subprocess
import sys
from pathlib import Path

import pytest

CSPM = Path(sys.executable).with_name("cspm")


def child(*arguments, **options):
    return subprocess.Popen(
        [CSPM, *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **options,
    )


def grown(process, folder, size):
    """Wait until a recording that `process` writes is larger than `size` bytes."""
    file = folder / f"{folder.name}_0.mcap"
    # The first run of all compiles its kernels, which takes minutes where processors are crowded.
    for _ in range(30_000):
        assert process.poll() is None, process.communicate()
        if file.exists() and file.stat().st_size > size:
            return
        try:
            process.wait(0.02)
        except subprocess.TimeoutExpired:
            continue
    pytest.fail("the recording did not grow within ten minutes")
