"""The scorings of a sealed benchmark: once per method, kept beside the truth."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from datetime import date
from pathlib import Path
from typing import Any

from cspm_msgs_py.errors import InputError


def log_of(truth: Path) -> Path:
    """Return where the scorings of a truth file are kept."""
    return truth.with_name(f"{truth.name}.scored.json")


def enter_scoring(
    truth: Path, sha256: str, results: Mapping[str, Mapping[str, Any]], today: date
) -> list[dict[str, str]]:
    """Enter that results are scored against a sealed truth; return all scorings so far.

    The same results may be scored again, which tells nothing new.

    Args:
        truth: the truth file.
        sha256: of it.
        results: by method, what `read_results` returns.
        today: the date.

    Raises:
        InputError: other results of a method have been scored before.
    """
    log = log_of(truth)
    entries: list[dict[str, str]] = json.loads(log.read_text("utf-8")) if log.exists() else []
    known = {entry["method"]: entry for entry in entries}
    for method, found in results.items():
        digest = hashlib.sha256(json.dumps(found, sort_keys=True).encode()).hexdigest()
        before = known.get(method)
        if before is None:
            entries.append(
                {
                    "date": str(today),
                    "method": method,
                    "results_sha256": digest,
                    "truth_sha256": sha256,
                }
            )
        elif before["results_sha256"] != digest:
            raise InputError(
                f"{truth}: sealed, and other results of {method} were scored {before['date']}"
                f" ({log}), allowed: once"
            )
    part = log.with_suffix(".part")
    part.write_text(json.dumps(entries, indent=1), encoding="utf-8")
    part.replace(log)
    return entries
