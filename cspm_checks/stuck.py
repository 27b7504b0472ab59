"""Values that stand still though what they measure does not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_checks.series import SensorSeries
from cspm_checks.suspicion import Suspicion

Array = NDArray[np.float64]
SHORTEST = 50
"""Samples that have to be equal."""
LONGER = 20.0
"""How many times longer than the runs in which half of the samples are."""
_MOVED = 0.02
"""Of the range of a position: what speed says that it moved meanwhile."""
HELD = 4
"""Samples equal to the last digit in all columns at once: noise makes no two."""
_RARE = 0.2
_SHOWN = 10


def _runs(changes: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return first sample and length of each run without a change, from changes (n - 1,)."""
    edges = np.concatenate([[0], np.flatnonzero(changes) + 1, [len(changes) + 1]])
    return edges[:-1], np.diff(edges)


def frozen_suspicions(where: str, rows: Array, seconds: Array) -> list[Suspicion]:
    """Return where a sensor with noise sent the same again and again, other than 0.

    Args:
        where: the topic, or topic and field.
        rows: its values, shape (n, width).
        seconds: when, shape (n,).
    """
    if len(rows) < 2 * SHORTEST:
        return []
    first, length = _runs((np.diff(rows, axis=0) != 0.0).any(axis=1))
    hit = (length >= SHORTEST) & (length > LONGER * _usual(length)) & rows[first].any(axis=1)
    return _told(where, "", seconds[first[hit]], _lasting(seconds, first[hit], length[hit]))


def held_frames(where: str, rows: Array, seconds: Array) -> list[Suspicion]:
    """Return where a sensor that changes at every sample holds its last for some: frames lost.

    Args:
        where: the topic.
        rows: its values, of which several change at once, shape (n, width).
        seconds: when, shape (n,).
    """
    if len(rows) < 2 * SHORTEST:
        return []
    first, length = _runs((np.diff(rows, axis=0) != 0.0).any(axis=1))
    hit = (length >= HELD) & (length < SHORTEST) & rows[first].any(axis=1)
    if not hit.any() or _usual(length) > 1 or length[length > 1].sum() > _RARE * len(rows):
        return []
    ends = first[hit] + length[hit] - 1
    lost, count = int((length[hit] - 1).sum()), int(hit.sum())
    pairs = [(float(seconds[a]), float(seconds[b])) for a, b in zip(first[hit], ends, strict=True)]
    stretches = ", ".join(f"{start:.6g} to {end:.6g} s" for start, end in pairs[:3])
    text = f"its last value is held {count} times, for {length[hit].max()} samples at most, and"
    text += " then steps to where it is: frames lost"
    remedy = f"`drop` {stretches}{f' and {count - 3} more' * (count > 3)}: {lost} of {len(rows)}"
    remedy += " messages; never `jumps: join`"
    half = float(np.median(np.diff(seconds))) / 2.0
    mend = {where: {"drop": [[start + half, end + half] for start, end in pairs]}}
    numbers = {"count": float(count), "samples": float(lost)}
    at = tuple(start for start, _ in pairs[:_SHOWN])
    return [Suspicion(where, "stuck", text, numbers, at, remedy, mend)]


def is_held(values: Array, row: int) -> bool:
    """Return whether a sample comes after some that are equal, in a signal that else changes."""
    before = values[max(row - HELD, 0) : row]
    still = float(np.mean(np.diff(values) == 0.0))
    return len(before) == HELD and not np.ptp(before) and still < _RARE


def stuck_suspicions(where: str, position: SensorSeries, velocity: SensorSeries) -> list[Suspicion]:
    """Return where a position does not change at all while its speed says that it moves."""
    if len(position.values) < 2 * SHORTEST or len(velocity.values) < 2:
        return []
    first, length = _runs(np.diff(position.values) != 0.0)
    long = length >= SHORTEST
    first, length = first[long], length[long]
    steps = np.diff(velocity.time) * (velocity.values[1:] + velocity.values[:-1]) / 2
    way = np.concatenate([[0.0], np.cumsum(np.abs(steps))])
    start, end = position.time[first], position.time[first + length - 1]
    moved = np.interp(end, velocity.time, way) - np.interp(start, velocity.time, way)
    net = np.interp(end, velocity.time, np.concatenate([[0.0], np.cumsum(steps)]))
    net -= np.interp(start, velocity.time, np.concatenate([[0.0], np.cumsum(steps)]))
    hit = np.abs(net) > np.maximum(_MOVED * np.ptp(position.values), 0.5 * moved)
    return _told(where, ", though its speed is not 0", start[hit], (end - start)[hit])


def _usual(length: NDArray[np.intp]) -> int:
    """Return a length such that half of the samples are in runs that are no longer."""
    ordered = np.sort(length)
    reached = np.cumsum(ordered)
    return int(ordered[np.searchsorted(reached, reached[-1] / 2)])


def _lasting(seconds: Array, first: NDArray[np.intp], length: NDArray[np.intp]) -> Array:
    return np.asarray(seconds[first + length - 1] - seconds[first])


def _told(where: str, why: str, start: Array, lasting: Array) -> list[Suspicion]:
    if not len(start):
        return []
    longest = int(np.argmax(lasting))
    text = f"stands still {len(start)} times{why}, the longest {lasting[longest]:.4g} s from"
    text += f" {start[longest]:.6g} s on"
    numbers = {"count": float(len(start)), "longest": float(lasting[longest])}
    return [Suspicion(where, "stuck", text, numbers, tuple(start[:_SHOWN].tolist()))]
