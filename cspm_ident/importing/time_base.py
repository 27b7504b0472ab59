"""When samples were taken: stamps from columns, rates and messages."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.importing.mapping import Clock
from cspm_ident.importing.time_text import TEXT_UNITS, TIME_OF_DAY
from cspm_ident.importing.units import TIME_FACTORS, TIME_ZEROS
from cspm_ident.importing.unwrapping import unwrap
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.layout import LATEST_SECOND
from cspm_msgs_py.message import NANOSECONDS

Stamps = NDArray[np.int64]


class Times(NamedTuple):
    """Stamps of rows.

    Attributes:
        stamp_ns: shape (n,) [ns]; meaningless where not `known`.
        known: whether a row has a time, shape (n,).
        disorder: what the clock says of stamps that are not later than one before.
        unset: how many stamps nobody had set, and were taken from the time of their log.
        rounded_s: to what times stored in single precision were rounded [s]; 0 in double.
    """

    stamp_ns: Stamps
    known: NDArray[np.bool_]
    disorder: str = "refuse"
    unset: int = 0
    rounded_s: float = 0.0


def set_stamps(
    stamp_ns: NDArray[Any], log_ns: NDArray[Any], where: str
) -> tuple[NDArray[Any], int]:
    """Return messages' stamps [ns] with those that nobody had set, 0, and how many those are.

    They get the time of their log less the usual lag of the others. A clock that begins at 0 has
    set them: then they lie no farther from 0 than the recording lasts.

    Args:
        stamp_ns: longdouble, shape (n,).
        log_ns: when each was logged, shape (n,).
        where: names the clock in errors.

    Raises:
        InputError: none was set.
    """
    stamp_ns, log_ns = np.asarray(stamp_ns), np.asarray(log_ns)
    zero = stamp_ns == 0
    if not zero.any() or len(zero) == 1:
        return stamp_ns, 0
    if zero.all():
        raise InputError(f"{where}: every stamp is 0, allowed: stamps, or `stamp: log`")
    guess = log_ns - np.median(log_ns[~zero] - stamp_ns[~zero])
    unset = zero & (np.abs(guess) > np.ptp(log_ns))
    return np.where(unset, guess, stamp_ns), int(unset.sum())


def single_precision(raw: NDArray[Any], unit: str) -> float:
    """Return to what a column of times was rounded in single precision [s], 0 if it was not.

    Whole numbers below the end of that precision are exact, and say nothing.
    """
    known = np.asarray(raw, dtype=np.float64)
    known = known[np.isfinite(known)]
    if not len(known) or unit in TEXT_UNITS:
        return 0.0
    largest = float(np.abs(known).max())
    if largest >= float(np.finfo(np.float32).max):
        return 0.0
    single = known.astype(np.float32)
    spacing = float(np.spacing(np.float32(largest)))
    whole = spacing <= 1.0 and not (known % 1.0).any()
    return 0.0 if whole or (single != known).any() else spacing * TIME_FACTORS[unit]


def times_of(
    raw: Sequence[NDArray[Any]], count: int, clock: Clock, units: Sequence[str], where: str
) -> Times:
    """Return the stamps of a clock's rows.

    Args:
        raw: the clock's columns, or the messages' stamps [ns], longdouble, each of shape (n,);
            texts in ns; none with a rate.
        count: number of rows.
        clock: how to read them.
        units: of each column.
        where: names the clock in errors.

    Raises:
        InputError: there is no time at all, or a stamp that no recording can hold.
    """
    if not raw:
        seconds = np.arange(count, dtype=np.longdouble) / np.longdouble(clock.rate or 1.0)
    elif len(raw) == 1:
        seconds = _seconds(_continuous(raw[0], clock, units[0]), units[0])
    else:
        parts = [_seconds(one, unit) for one, unit in zip(raw, units, strict=True)]
        seconds = np.sum(parts, axis=0, dtype=np.longdouble)
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


def _continuous(raw: NDArray[Any], clock: Clock, unit: str) -> NDArray[Any]:
    """Return a column of times without the steps of a counter or of midnight."""
    if unit == TIME_OF_DAY:
        return np.asarray(unwrap(np.asarray(raw), 86400.0 * NANOSECONDS).values)
    if clock.wrap is not None:
        return np.asarray(unwrap(np.asarray(raw), clock.wrap).values)
    return raw


def _seconds(raw: NDArray[Any], unit: str) -> NDArray[Any]:
    factor = 1.0 / NANOSECONDS if unit in TEXT_UNITS else TIME_FACTORS[unit]
    raw = raw - np.longdouble(TIME_ZEROS.get(unit, 0.0))
    # Dividing by a whole number is exact where multiplying by 0.001 is not.
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
