"""What looks wrong in the stamps of a topic."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_checks.disorder import order_of
from cspm_checks.pace import GAP, JITTERED_GAP, Pace
from cspm_checks.series import Stamps
from cspm_checks.suspicion import Suspicion

RATE_TOLERANCE = 0.01
IRREGULAR_SHARE = 0.01
UNIT_STEP = 1000.0
"""Between neighbouring units of time: s, ms, us, ns."""
FASTEST = 1e6
"""Hz that no drive, load cell or camera of such a machine reaches."""
_REGULAR = 0.8  # share of equal distances between events
_EVENTS = 20


def time_suspicions(
    topic: str, stamp_ns: Stamps, pace: Pace, sensor_rate: float | None
) -> list[Suspicion]:
    """Return what looks wrong in a topic's stamps.

    Args:
        topic: its name.
        stamp_ns: its stamps, shape (n,).
        pace: what they look like.
        sensor_rate: the highest rate that the test-bed's sensor delivers [Hz], if it says so.
    """
    found = []

    def add(kind: str, text: str, **numbers: float) -> None:
        found.append(Suspicion(topic, kind, text, numbers))

    found += _disorder(topic, stamp_ns, pace)
    if pace.gaps and pace.step_s and pace.gap_at_s is not None:
        _, median, longest = pace.step_s
        least = JITTERED_GAP if pace.jitter_s else GAP
        add(
            "gap",
            f"{pace.gaps} gaps longer than {least} steps, the longest {longest:.6g} s at"
            f" {pace.gap_at_s:.6g} s",
            count=pace.gaps,
            longest=longest,
            at=pace.gap_at_s,
        )
    if pace.jitter_s and pace.rate_hz:
        add(
            "jitter",
            f"stamps scatter by {1e3 * pace.jitter_s:.3g} ms (one sigma) about an even clock of"
            f" {pace.rate_hz:.6g} Hz",
            sigma=pace.jitter_s,
            rate=pace.rate_hz,
        )
    elif pace.irregular > IRREGULAR_SHARE and pace.step_s:
        low, median, _ = pace.step_s
        add(
            "irregular",
            f"{pace.irregular:.1%} of the steps differ by more than 1 % from {median:.6g} s",
            share=pace.irregular,
            median=median,
            shortest=low,
        )
    if sensor_rate and pace.rate_hz and (text := _rate(pace.rate_hz, sensor_rate)):
        add("rate", text, found=pace.rate_hz, sensor=sensor_rate)
    return found


def _disorder(topic: str, stamp_ns: Stamps, pace: Pace) -> list[Suspicion]:
    """Return whether stamps do not rise, with the remedy that loses least."""
    texts = {
        "backwards": (pace.backwards, f"time runs backwards {pace.backwards} times"),
        "duplicate": (pace.duplicates, f"{pace.duplicates} stamps stand twice"),
    }
    if not (pace.backwards or pace.duplicates):
        return []
    order = order_of(stamp_ns)
    mend = {topic: {"clock": order.keys}} if order.keys else {}
    return [
        Suspicion(topic, kind, text, {"count": count}, remedy=order.remedy, mend=mend)
        for kind, (count, text) in texts.items()
        if count
    ]


def _rate(found: float, sensor: float) -> str:
    """Return what is wrong with a rate beside that of the test-bed's sensor [Hz]."""
    if found > sensor * (1 + RATE_TOLERANCE):
        days = found / 86400.0
        hint = f"; were it days, {days:.4g} Hz" if sensor / UNIT_STEP < days <= sensor else ""
        return (
            f"comes at {found:.6g} Hz, the test-bed's sensor delivers {sensor:g} Hz at most{hint}"
        )
    if found * UNIT_STEP <= sensor * (1 + RATE_TOLERANCE):
        return (
            f"comes at {found:.6g} Hz only, the test-bed's sensor delivers {sensor:g} Hz; were it"
            f" the next smaller unit of time, {found * UNIT_STEP:.6g} Hz"
        )
    return ""


def is_beyond_devices(rate: float | None, sensor_rate: float | None) -> bool:
    """Return whether a rate [Hz] is more than a wrong step between units of time explains."""
    return rate is not None and rate > UNIT_STEP * (sensor_rate or FASTEST / UNIT_STEP)


def held_suspicions(topic: str, rows: NDArray[np.float64]) -> list[Suspicion]:
    """Return whether a slower sensor was filled up, held or interpolated, to the topic's rate.

    Such samples were never measured, and look like delay or damping later.

    Args:
        topic: its name.
        rows: its numbers, shape (n, width).
    """
    if len(rows) < 3 * _EVENTS:
        return []
    steps = np.diff(rows, axis=0)
    change = np.flatnonzero((steps != 0).any(axis=1))
    if (every := _regular(change)) is not None and not _single_steps(steps[change]):
        return [
            Suspicion(
                topic,
                "held",
                f"changes every {every} messages only: a slower sensor, its last value held?",
                {"messages": float(every)},
            )
        ]
    size = np.abs(rows).max(axis=0)
    bend = np.abs(np.diff(rows, n=2, axis=0)) > 1e-9 * size
    if (every := _regular(np.flatnonzero(bend.any(axis=1)))) is not None:
        return [
            Suspicion(
                topic,
                "interpolated",
                f"bends every {every} messages only: a slower sensor, interpolated?",
                {"messages": float(every)},
            )
        ]
    return []


def _single_steps(steps: NDArray[np.float64]) -> bool:
    """Return whether all steps, shape (n, width), are equal: a coarse sensor at constant speed."""
    sizes = np.abs(steps).max(axis=0)
    shares = np.abs(steps[:, sizes > 0]) / sizes[sizes > 0]
    return bool(((shares < 0.01) | (shares > 0.99)).mean() > _REGULAR)


def _regular(events: NDArray[np.intp]) -> int | None:
    """Return the distance between events if it is 2 or more and nearly always the same."""
    if len(events) < _EVENTS:
        return None
    distances = np.diff(events)
    usual = int(np.median(distances))
    return usual if usual >= 2 and np.mean(distances == usual) > _REGULAR else None
