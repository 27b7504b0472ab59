"""When samples were taken: stamps from columns, rates and messages."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.importing.column_store import ColumnStore, pieces
from cspm_ident.importing.mapping import Clock
from cspm_ident.importing.time_text import TEXT_UNITS, TIME_OF_DAY
from cspm_ident.importing.units import TIME_FACTORS, TIME_ZEROS
from cspm_ident.importing.unwrapping import Unwrapper
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.layout import LATEST_SECOND
from cspm_msgs_py.message import NANOSECONDS

Stamps = NDArray[np.int64]
_MOST_AGREE, _STEPS, _BUSY_S = 0.9, 5.0, 0.02


class Times(NamedTuple):
    """Stamps of rows.

    Attributes:
        stamp_ns: shape (n,), on disk [ns]; meaningless in rows without time.
        rows: which rows have a time, rising, shape (k,), on disk.
        first_ns: the earliest of those.
        disorder: what the clock says of stamps that are not later than one before.
        unset: how many stamps nobody had set, and were taken from the time of their log.
        rounded_s: to what times stored in single precision were rounded [s]; 0 in double.
        unlike_log_s: by how much stamps of headers and times of the log disagree [s]; see
            `unlike_log`.
    """

    stamp_ns: Stamps
    rows: Stamps
    first_ns: int
    disorder: str = "refuse"
    unset: int = 0
    rounded_s: float = 0.0
    unlike_log_s: float = 0.0

    def equals(self, other: Times) -> bool:
        """Return whether the stamps of other rows are the same, and as trustworthy."""
        return (
            self[2:] == other[2:]
            and np.array_equal(self.stamp_ns, other.stamp_ns)
            and np.array_equal(self.rows, other.rows)
        )


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
    lags, zeros = [], [np.zeros(0, dtype=np.intp)]
    for part in pieces(len(stamp_ns), stamp_ns, log_ns):
        stamps, logged = np.asarray(stamp_ns[part]), np.asarray(log_ns[part])
        zeros.append(np.flatnonzero(stamps == 0) + part.start)
        if stamps.any():
            lags.append(np.median((logged - stamps)[stamps != 0]))
    rows = np.concatenate(zeros)
    if not len(rows) or len(stamp_ns) == 1:
        return stamp_ns, 0
    if not lags:
        raise InputError(f"{where}: every stamp is 0, allowed: stamps, or `stamp: log`")
    guess = np.asarray(log_ns[rows]) - np.median(lags)
    unset = np.abs(guess) > log_ns.max() - log_ns.min()
    if not unset.any():
        return stamp_ns, 0
    found = np.array(stamp_ns)
    found[rows[unset]] = guess[unset]
    return found, int(unset.sum())


def unlike_log(stamp_ns: NDArray[Any], log_ns: NDArray[Any]) -> float:
    """Return by how much headers' stamps and times of the log disagree, less a constant [s].

    Messages are logged a little after they are stamped, and in bursts where a computer is busy. 0
    where nine tenths of them agree within five steps and 20 ms.

    Args:
        stamp_ns: of the headers, longdouble, shape (n,).
        log_ns: when each was logged, shape (n,).
    """
    late = (np.asarray(log_ns) - np.asarray(stamp_ns)).astype(np.float64) / NANOSECONDS
    about = np.abs(late - np.median(late))
    step = float(np.median(np.diff(np.asarray(log_ns, dtype=np.float64)))) / NANOSECONDS
    disagree = np.quantile(about, _MOST_AGREE) > max(_STEPS * step, _BUSY_S)
    return float(np.ptp(late)) if disagree else 0.0


def single_precision(raw: NDArray[Any], unit: str) -> float:
    """Return to what a column of times was rounded in single precision [s], 0 if it was not.

    Whole numbers below the end of that precision are exact, and say nothing.
    """
    if unit in TEXT_UNITS:
        return 0.0
    largest, whole = 0.0, True
    for part in pieces(len(raw), raw):
        known = np.asarray(raw[part], dtype=np.float64)
        known = known[np.isfinite(known)]
        largest = max(largest, float(np.abs(known).max(initial=0.0)))
        if largest >= float(np.finfo(np.float32).max) or (known.astype(np.float32) != known).any():
            return 0.0
        whole = whole and not (known % 1.0).any()
    spacing = float(np.spacing(np.float32(largest)))
    return 0.0 if whole and spacing <= 1.0 else spacing * TIME_FACTORS[unit]


def times_of(
    raw: Sequence[NDArray[Any]],
    count: int,
    clock: Clock,
    units: Sequence[str],
    store: ColumnStore,
    where: str,
) -> Times:
    """Return the stamps of a clock's rows.

    Args:
        raw: the clock's columns, or the messages' stamps [ns], longdouble, each of shape (n,);
            texts in ns; none with a rate.
        count: number of rows.
        clock: how to read them.
        units: of each column.
        store: keeps the stamps.
        where: names the clock in errors.

    Raises:
        InputError: there is no time at all, or a stamp that no recording can hold.
    """
    reader = _ClockReader(clock, units)
    names = [store.new(), store.new()]
    first = LATEST_SECOND * NANOSECONDS
    for part in pieces(count, *raw):
        seconds = reader.seconds([one[part] for one in raw], part)
        rows = np.flatnonzero(~np.isnan(seconds))
        stamps = np.zeros(len(seconds), dtype=np.int64)
        stamps[rows] = _nanoseconds(seconds[rows], where)
        first = min(first, int(stamps[rows].min(initial=first)))
        for name, piece in zip(names, (stamps, rows + part.start), strict=True):
            store.append(name, piece)
    stamp_ns, known = map(store.column, names)
    if not len(known):
        raise InputError(f"{where}: no row has a time, allowed: at least one")
    return Times(stamp_ns, known, first, clock.disorder)


def _nanoseconds(seconds: NDArray[Any], where: str) -> Stamps:
    if not len(seconds):
        return np.zeros(0, dtype=np.int64)
    low, high = float(seconds.min()), float(seconds.max())
    # What rounds to 0 ns is 0.
    if low < -0.5e-9 or high > LATEST_SECOND:
        raise InputError(
            f"{where}: times from {low:.9g} s to {high:.9g} s, allowed: 0 to {LATEST_SECOND} s;"
            " is the unit right? `offset` moves them"
        )
    return np.asarray(np.rint(seconds * NANOSECONDS).astype(np.int64))


class _ClockReader:
    """Reads the pieces of a clock's columns in turn."""

    def __init__(self, clock: Clock, units: Sequence[str]) -> None:
        self._clock, self._units = clock, units
        self._first: np.longdouble | None = None
        wrap = 86400.0 * NANOSECONDS if list(units) == [TIME_OF_DAY] else clock.wrap
        # A counter or midnight is unwrapped where the clock is one column.
        self._unwrapper = Unwrapper(wrap) if wrap is not None and len(units) == 1 else None

    def seconds(self, raw: Sequence[NDArray[Any]], part: slice) -> NDArray[Any]:
        """Return the times [s] of the next rows as the clock corrects them, NaN where unknown."""
        if not raw:
            rows = np.arange(part.start, part.stop, dtype=np.longdouble)
            found = rows / np.longdouble(self._clock.rate or 1.0)
        elif len(raw) == 1:
            whole = np.asarray(raw[0])
            whole = whole if self._unwrapper is None else self._unwrapper.take(whole)
            found = _seconds(whole, self._units[0])
        else:
            parts = [_seconds(one, unit) for one, unit in zip(raw, self._units, strict=True)]
            found = np.sum(parts, axis=0, dtype=np.longdouble)
        known = np.flatnonzero(~np.isnan(found))
        if self._first is None and len(known):
            self._first = found[known[0]]
        return found if self._first is None else self._corrected(found, self._first)

    def _corrected(self, seconds: NDArray[Any], first: np.longdouble) -> NDArray[Any]:
        clock = self._clock
        if clock.points:
            (raw0, true0), (raw1, true1) = (map(np.longdouble, point) for point in clock.points)
            seconds = true0 + (seconds - raw0) * ((true1 - true0) / (raw1 - raw0))
        elif clock.skew:
            seconds = first + (seconds - first) * (1 + np.longdouble(clock.skew))
        return np.asarray(seconds + np.longdouble(clock.offset))


def _seconds(raw: NDArray[Any], unit: str) -> NDArray[Any]:
    factor = 1.0 / NANOSECONDS if unit in TEXT_UNITS else TIME_FACTORS[unit]
    raw = raw - np.longdouble(TIME_ZEROS.get(unit, 0.0))
    # Dividing by a whole number is exact where multiplying by 0.001 is not.
    if factor >= 1.0:
        return np.asarray(raw * np.longdouble(factor))
    return np.asarray(raw / np.rint(np.longdouble(1 / factor)))


def out_of_order(stamp_ns: Stamps, kept: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return which of the kept rows have a stamp that is not later than all kept before.

    Args:
        stamp_ns: shape (n,).
        kept: shape (n,).
    """
    found, latest = [np.zeros(0, dtype=np.intp)], np.iinfo(np.int64).min
    for part in pieces(len(stamp_ns), stamp_ns):
        rows = np.flatnonzero(kept[part])
        stamps = np.concatenate([[latest], stamp_ns[part][rows]])
        reached = np.maximum.accumulate(stamps)
        found.append(rows[stamps[1:] <= reached[:-1]] + part.start)
        latest = reached[-1]
    return np.concatenate(found)
