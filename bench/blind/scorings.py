"""The scorings of a sealed benchmark: each recording once per method, kept beside the truth."""

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
) -> list[dict[str, Any]]:
    """Enter that results are scored against a sealed truth; return all scorings so far.

    The same results may be scored again, which shows nothing new, and with them those of further
    recordings, which had not been scored.

    Args:
        truth: the truth file.
        sha256: of it.
        results: by method, what `read_results` returns.
        today: the date.

    Raises:
        InputError: another result of a recording has been scored before, or one is left out.
    """
    log = log_of(truth)
    entries: list[dict[str, Any]] = json.loads(log.read_text("utf-8")) if log.exists() else []
    known = {entry["method"]: entry for entry in entries}
    for method, found in results.items():
        if method not in known:
            known[method] = {"method": method, "truth_sha256": sha256, "recordings": {}}
            entries.append(known[method])
        before = known[method]["recordings"]
        digests = {name: _digest(result) for name, result in found.items()}
        for name, entry in before.items():
            if digests.get(name) != entry["results_sha256"]:
                raise InputError(
                    f"{truth}: sealed, and another result of {method} for {name} was scored"
                    f" {entry['date']} ({log}), allowed: each once"
                )
        for name in digests.keys() - before.keys():
            before[name] = {"date": str(today), "results_sha256": digests[name]}
    part = log.with_suffix(".part")
    part.write_text(json.dumps(entries, indent=1, sort_keys=True), encoding="utf-8")
    part.replace(log)
    return entries


def _digest(result: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(result, sort_keys=True).encode()).hexdigest()
