"""The truth file, and where a benchmark's recordings and results lie."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from bench.blind.scoring.method import CSPM
from cspm_msgs_py.errors import InputError

SCHEMA = "cspm.blind-truth/1"
SEALED = "sealed"
SPLITS = ("dev", "tune", SEALED)
RECORDINGS = "recordings"
_RESULTS = "results"


def results_of(folder: Path, method: str) -> Path:
    """Return where a method's results of a benchmark lie."""
    return folder / (_RESULTS if method == CSPM else f"{_RESULTS}-{method}")


def truth_sha256(path: Path) -> str:
    """Return the SHA-256 of a truth file, hexadecimal."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def read_truth(path: Path) -> dict[str, Any]:
    """Read a truth file.

    Raises:
        InputError: there is none, or it is something else.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as err:
        raise InputError(f"{path}: not readable ({err}), allowed: a truth file") from None
    if not isinstance(content, dict) or content.get("schema") != SCHEMA:
        raise InputError(f"{path}: allowed: a truth file of schema {SCHEMA}")
    return content
