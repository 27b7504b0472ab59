"""Which code a process runs: a campaign's workers must all run the same."""

from __future__ import annotations

import hashlib
import sys
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

PACKAGES = (
    *("cspm", "cspm_checks", "cspm_control", "cspm_ident", "cspm_model"),
    *("cspm_msgs_py", "cspm_run", "cspm_sim"),
)
# Whose versions decide the last digits of a run, or whether its kernels compile.
_LIBRARIES = ("numpy", "scipy", "numba")


@cache
def code_version() -> str:
    """Return the version of the package, a hash of its sources, and what its kernels rest on.

    Processes with the same text give the same numbers on the same kind of processor.
    """
    digest = hashlib.sha256()
    for name in PACKAGES:
        spec = find_spec(name)
        root = Path(spec.origin).parent if spec is not None and spec.origin else Path(name)
        for path in sorted(root.rglob("*.py")):
            digest.update(str(path.relative_to(root)).encode())
            digest.update(path.read_bytes())
    libraries = ", ".join(f"{name} {version(name)}" for name in _LIBRARIES)
    python = ".".join(map(str, sys.version_info[:2]))
    return f"cspm {version('cspm')} ({digest.hexdigest()[:12]}), Python {python}, {libraries}"
