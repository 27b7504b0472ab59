"""Where compiled kernels are kept between runs.

Numba recompiles a cached function when its own file changes, but not when a function that it took
in from another file does: an edit or an update could run old equations without a word. So the
cache lies in a folder named after the content of all kernel files, and any change begins a new one.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

from numba import config

_KERNELS = Path(__file__).parent / "kernels"
_PACKAGES = ("cspm_model", "cspm_sim", "cspm_control", "cspm_run")
_MARK = b"numba"


def kernel_digest(*folders: Path) -> str:
    """Return a digest of the content of all Python files below `folders` that use numba."""
    digest = hashlib.sha256()
    for folder in folders:
        for path in sorted(folder.rglob("*.py")):
            content = path.read_bytes()
            if _MARK in content:
                digest.update(path.name.encode() + b"\0" + content + b"\0")
    return digest.hexdigest()[:16]


def use_kernel_cache() -> None:
    """Make numba keep compiled functions in a folder for exactly these kernels.

    It lies in NUMBA_CACHE_DIR where that is set, otherwise beside the kernels; where neither can be
    written numba chooses a place of its own.
    """
    base = Path(os.environ.get("NUMBA_CACHE_DIR") or _KERNELS / "__pycache__")
    folders = [Path(__file__).parents[1] / package for package in _PACKAGES]
    config.CACHE_DIR = str(base / f"kernels-{kernel_digest(*folders)}")
