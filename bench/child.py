"""`cspm` as a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path


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
