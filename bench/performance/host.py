"""The machine that a measurement was made on."""

from __future__ import annotations

import os
import platform
from datetime import date
from importlib.metadata import version
from pathlib import Path

LIBRARIES = ("cspm", "numpy", "numba", "scipy", "mujoco")
# Load per core.
BUSY = 0.5


def describe_machine() -> dict[str, str]:
    """Return date, processor, cores, load and versions."""
    libraries = ", ".join(f"{name} {version(name)}" for name in LIBRARIES)
    return {
        "date": date.today().isoformat(),
        "processor": f"{_processor()}, {os.cpu_count()} cores",
        "memory": f"{os.sysconf('SC_PHYS_PAGES') * os.sysconf('SC_PAGE_SIZE') / 2**30:.1f} GiB",
        "load before": ", ".join(f"{load:.2f}" for load in os.getloadavg()) + " (1, 5, 15 min)",
        "system": f"{platform.system()} {platform.release()}, {platform.machine()}",
        "software": f"Python {platform.python_version()}, {libraries}",
    }


def is_busy() -> bool:
    """Return whether so much else is running that the figures would be too low."""
    return os.getloadavg()[0] > BUSY * (os.cpu_count() or 1)


def _processor() -> str:
    lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
