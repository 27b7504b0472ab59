"""Rows that two recordings have in common, to the last digit."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from cspm_ident.signals.measurement import Measurement
from cspm_msgs_py.errors import InputError

Hashes = NDArray[np.uint64]

# Successive rows that must agree: so many readings of noisy sensors never agree by chance, and a
# copied second has as many.
_ROWS = 20
# Of these, so many must differ from the row before: what stands still agrees with itself.
_CHANGING = 10
# Of the shorter recording: less is no copy worth a refusal.
_SHARE = 0.05
_ODD = 0x9E3779B97F4A7C15  # 2⁶⁴ over the golden ratio, odd (Knuth, vol. 3, 6.4)


def refuse_shared_rows(searched: Sequence[Measurement], held_out: Sequence[Measurement]) -> None:
    """Refuse held-out recordings that contain rows that are searched, and rows that count twice.

    Args:
        searched: recordings to search or fit.
        held_out: those for the hold-out test.

    Raises:
        InputError: two of them share more than 5 % of the shorter one's rows.
    """
    hashes = {id(each): _hashes(each) for each in (*searched, *held_out)}
    for judge in held_out:
        for each in searched:
            share = _shared(hashes[id(each)], hashes[id(judge)])
            if share > _SHARE:
                raise InputError(
                    f"--held-out {judge.path}: shares {100.0 * share:.0f} % of its rows with"
                    f" {each.path}, which is searched, allowed: recordings that share none"
                )
    for first, second in combinations(searched, 2):
        share = _shared(hashes[id(first)], hashes[id(second)])
        if share > _SHARE:
            raise InputError(
                f"{second.path}: shares {100.0 * share:.0f} % of its rows with {first.path}, which"
                " would count twice, allowed: recordings that share none"
            )


def _shared(first: Hashes, second: Hashes) -> float:
    """Return the share of the shorter one's rows that the other has as well."""
    short, long = sorted((first, second), key=len)
    return float(np.isin(short, long).mean()) if len(short) else 0.0


def _hashes(measurement: Measurement) -> Hashes:
    """Return a number for each run of rows of a recording in which something changes."""
    parts = (measurement.angle, measurement.speed, measurement.torque)
    whole = [each for each in parts if each is not None]
    whole = whole or [*measurement.sensors.values()]
    length = len(whole[0].times) if whole else 0
    rows = np.column_stack([each.values for each in whole if len(each.times) == length])
    if length <= _ROWS:
        return np.zeros(0, dtype=np.uint64)
    numbers = _mixed(np.ascontiguousarray(rows + 0.0).view(np.uint64))
    changes = np.concatenate([[0], np.cumsum(numbers[1:] != numbers[:-1])])
    changing = changes[_ROWS - 1 :] - changes[: len(changes) - _ROWS + 1] >= _CHANGING
    runs = np.lib.stride_tricks.sliding_window_view(numbers, _ROWS)
    return np.asarray(_mixed(runs)[changing])


def _mixed(columns: Hashes) -> Hashes:
    """Return a number for each row, which depends on all its columns and their order."""
    out = np.zeros(len(columns), dtype=np.uint64)
    for column in columns.T:
        out = (out ^ column) * np.uint64(_ODD)
        out ^= out >> np.uint64(29)
    return out
