"""`cspm` as a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

import psutil

SAMPLE_S = 0.1
T = TypeVar("T")


def start_cspm(arguments: Sequence[str], environment: Mapping[str, str]) -> subprocess.Popen[str]:
    """Start the command line of this environment, with changes to the environment variables."""
    return subprocess.Popen(
        [str(Path(sys.executable).with_name("cspm")), *arguments],
        env={**os.environ, **environment},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


def finish(child: subprocess.Popen[str]) -> None:
    """Wait for a child.

    Raises:
        RuntimeError: it failed.
    """
    _, errors = child.communicate()
    if child.returncode:
        raise RuntimeError(f"cspm ended with {child.returncode}: {errors.strip()}")


def watched(child: subprocess.Popen[str], look: Callable[[psutil.Process], T]) -> Iterator[T]:
    """Yield what a child's process shows, every `SAMPLE_S`, until it ends.

    Raises:
        RuntimeError: it failed.
    """
    process = psutil.Process(child.pid)
    while child.poll() is None:
        try:
            seen = look(process)
        except psutil.NoSuchProcess:
            break
        yield seen
        time.sleep(SAMPLE_S)
    finish(child)
