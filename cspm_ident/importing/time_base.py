"""When samples were taken: stamps from columns, rates and messages, and what they look like."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.importing.mapping import Clock
from cspm_ident.importing.units import ISO_TIME, TIME_FACTORS
from cspm_ident.importing.unwrapping import unwrap
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.layout import LATEST_SECOND
from cspm_msgs_py.message import NANOSECONDS

Stamps = NDArray[np.int64]
GAP = 1.5
IRREGULAR = 0.01


class Times(NamedTuple):
    """Stamps of rows.

    Attributes:
        stamp_ns: shape (n,) [ns]; meaningless where not `known`.
        known: whether a row has a time, shape (n,).
        disorder: what the clock says of stamps that are not later than one before.
    """

    stamp_ns: Stamps
    known: NDArray[np.bool_]
    disorder: str = "refuse"


class Pace(NamedTuple):
    """What a series of stamps looks like; times from the first stamp of all.

    Attributes:
        messages: number of stamps.
        first_s: first stamp [s].
        last_s: last stamp [s].
        rate_hz: one over the mean step without gaps, None below two stamps.
        step_s: smallest, median and largest step [s].
        irregular: share of steps that differ from the median by more than 1 %, gaps apart.
        gaps: number of steps longer than 1.5 medians.
        gap_at_s: where the longest step begins [s].
        duplicates: number of steps of zero.
        backwards: number of negative steps.
    """

    messages: int
    first_s: float
    last_s: float
    rate_hz: float | None
    step_s: tuple[float, float, float] | None
    irregular: float
    gaps: int
    gap_at_s: float | None
    duplicates: int
    backwards: int


def times_of(raw: NDArray[Any] | None, count: int, clock: Clock, where: str) -> Times:
    """Return the stamps of a clock's rows.

    Args:
        raw: the clock's column, or the messages' stamps [ns], longdouble, shape (n,); None with a
            rate.
        count: number of rows.
        clock: how to read them.
        where: names the clock in errors.

    Raises:
        InputError: there is no time at all, or a stamp that no recording can hold.
    """
    if raw is None:
        seconds = np.arange(count, dtype=np.longdouble) / np.longdouble(clock.rate or 1.0)
    else:
        seconds = _seconds(raw, clock)
    known = ~np.isnan(seconds)
    if not known.any():
        raise InputError(f"{where}: no row has a time, allowed: at least one")
    seconds = np.where(known, seconds, seconds[known][0])
    seconds = _corrected(seconds, clock)
    low, high = float(seconds.min()), float(seconds.max())
    # What rounds to 0 ns is 0.
    if low < -0.5e-9 or high > LATEST_SECOND:
        raise InputError(
            f"{where}: times from {low:.9g} s to {high:.9g} s, allowed: 0 to {LATEST_SECOND} s;"
            " is the unit right? `offset` moves them"
        )
    return Times(np.rint(seconds * NANOSECONDS).astype(np.int64), known, clock.disorder)


def _seconds(raw: NDArray[Any], clock: Clock) -> NDArray[Any]:
    if clock.stamp is not None or clock.unit == ISO_TIME:
        return np.asarray(raw / np.longdouble(NANOSECONDS))
    if clock.wrap is not None:
        raw = unwrap(np.asarray(raw), clock.wrap).values
    # Dividing by a whole number is exact where multiplying by 0.001 is not.
    factor = TIME_FACTORS[clock.unit]
    if factor >= 1.0:
        return np.asarray(raw * np.longdouble(factor))
    return np.asarray(raw / np.rint(np.longdouble(1 / factor)))


def _corrected(seconds: NDArray[Any], clock: Clock) -> NDArray[Any]:
    if clock.points:
        (raw0, true0), (raw1, true1) = (map(np.longdouble, point) for point in clock.points)
        seconds = true0 + (seconds - raw0) * ((true1 - true0) / (raw1 - raw0))
    elif clock.skew:
        seconds = seconds[0] + (seconds - seconds[0]) * (1 + np.longdouble(clock.skew))
    return np.asarray(seconds + np.longdouble(clock.offset))


def later_than_all_before(stamp_ns: Stamps) -> NDArray[np.bool_]:
    """Return which stamps are later than every one before them, shape (n,)."""
    if not len(stamp_ns):
        return np.zeros(0, dtype=bool)
    before = np.maximum.accumulate(stamp_ns)[:-1]
    return np.concatenate([[True], stamp_ns[1:] > before])


def pace_of(stamp_ns: Stamps, origin_ns: int) -> Pace:
    """Return what a series of stamps, shape (n,), looks like, seen from an origin [ns]."""
    if not len(stamp_ns):
        return Pace(0, 0.0, 0.0, None, None, 0.0, 0, None, 0, 0)
    first, last = ((int(stamp_ns[i]) - origin_ns) * 1e-9 for i in (0, -1))
    steps = np.diff(stamp_ns)
    if not len(steps):
        return Pace(1, first, last, None, None, 0.0, 0, None, 0, 0)
    median = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    gaps = steps > GAP * median
    regular = np.abs(steps - median) <= IRREGULAR * median
    longest = int(np.argmax(steps))
    return Pace(
        messages=len(stamp_ns),
        first_s=first,
        last_s=last,
        rate_hz=1e9 / float(steps[(steps > 0) & ~gaps].mean()) if median else None,
        step_s=(float(steps.min()) * 1e-9, median * 1e-9, float(steps.max()) * 1e-9),
        irregular=float(np.mean(~regular & ~gaps)),
        gaps=int(gaps.sum()),
        gap_at_s=(int(stamp_ns[longest]) - origin_ns) * 1e-9 if gaps.any() else None,
        duplicates=int((steps == 0).sum()),
        backwards=int((steps < 0).sum()),
    )
