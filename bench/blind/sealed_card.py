"""A stored part of the sealed sets as the scorecard that its picture shows."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from bench.blind.scoring.share import Share, share_of
from bench.blind.scoring.target import FINDINGS, NUMBERS
from bench.blind.sealed_store import STORE, read_table

_COUNTS = re.compile(r"(\d+) of (\d+)")
# Of a peer's row, by the key of a scorecard.
_METHODS = {
    "first": "named first",
    "nothing_wrong_beside": "named, nothing wrong beside",
    "false_alarm": "alarm",
}
_AMOUNTS = {"detected": "detected", "tied": "among the ties", "named": "named"}


def stored_card(part: str, folder: Path = STORE) -> dict[str, Any]:
    """Return what the picture of a part takes from its scorecard.

    Raises:
        ValueError: there is no such part.
    """

    def rows(name: str) -> list[dict[str, str]]:
        return [row for row in read_table(folder, name) if row["part"] == part]

    found = {row["measure"]: row["found"] for row in rows("targets")}
    if not found:
        raise ValueError(f"--draw {part}: allowed: a part of {folder}")
    numbers = {key: _share(found.get(label, "")) for key, label, _ in NUMBERS}
    peers = rows("peers")
    recordings = [_counted(row["failed"])[1] for row in peers]
    return {
        "shares": {key: _share(found.get(label, "")) for key, label, _ in FINDINGS},
        "parameters": {"covered": numbers["covered"]},
        "fit": numbers,
        "by_multiple": [
            {"multiple": float(row["detection limits"])}
            | {key: _share(row[head]) for key, head in _AMOUNTS.items()}
            for row in rows("amounts")
        ],
        "by_stratum": [
            {key: int(row[key]) if key != "stratum" else row[key] for key in _STRATUM}
            for row in rows("strata")
        ],
        "calibration": [
            {"said": float(row["mean"]), "right": _share(row["effect right"])}
            for row in rows("probabilities")
            if _COUNTS.search(row["effect right"])
        ],
        "peers": [
            {"method": row["method"], "scored": scored}
            | {key: _share(row[head]) for key, head in _METHODS.items()}
            for row, scored in zip(peers, recordings, strict=True)
        ],
    }


_STRATUM = ("stratum", "cases", "detected", "named")


def _counted(cell: str) -> tuple[int, int]:
    counts = _COUNTS.search(cell)
    return (int(counts[1]), int(counts[2])) if counts else (0, 0)


def _share(cell: str) -> Share:
    return share_of(*_counted(cell))
