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
