"""Instants written as text: dates, times of day, and both together, to the nanosecond."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from datetime import date

import numpy as np
from numpy.typing import NDArray

_EPOCH = date(1970, 1, 1).toordinal()
_SECOND = 1_000_000_000
_DAY = 86400 * _SECOND
_CLOCK = r"(\d{1,2}):(\d\d)(?::(\d\d)(?:[.,](\d{1,9}))?)?(?: ?([AaPp])\.?[Mm]\.?)?"
_ZONE = r"(Z|[+-]\d\d:?\d\d)?"
_TIME_OF_DAY = re.compile(rf"{_CLOCK}$")
_PART = rf"(?:[T ]+{_CLOCK}{_ZONE})?$"

ISO_TIME, TIME_OF_DAY, DAY_FIRST, MONTH_FIRST = "iso8601", "time_of_day", "dd.mm.yyyy", "mm/dd/yyyy"
# Year, month and day as places in the three numbers of a date.
_DATES = {
    ISO_TIME: (re.compile(rf"(\d{{4}})-(\d\d)-(\d\d){_PART}"), (0, 1, 2)),
    DAY_FIRST: (re.compile(rf"(\d{{1,2}})[./-](\d{{1,2}})[./-](\d{{4}}){_PART}"), (2, 1, 0)),
    MONTH_FIRST: (re.compile(rf"(\d{{1,2}})[./-](\d{{1,2}})[./-](\d{{4}}){_PART}"), (2, 0, 1)),
}
TEXT_UNITS = {
    ISO_TIME: "2026-01-31T12:00:00.125",
    TIME_OF_DAY: "12:00:00.125",
    DAY_FIRST: "31.01.2026 12:00:00.125",
    MONTH_FIRST: "01/31/2026 12:00:00.125",
}
"""Units of times that are texts, each with an example."""
UNAMBIGUOUS = (ISO_TIME, TIME_OF_DAY)
_NONE = ("", "nan", "nat", "null")


def nanoseconds(unit: str, cells: Iterable[str]) -> NDArray[np.longdouble]:
    """Return texts of a unit as ns since 1970 (UTC), or since midnight for a time of day.

    Empty texts become NaN. A text without zone is UTC.

    Raises:
        ValueError: with the text that is none of this unit.
    """
    parse = _parser(unit)
    found = [float("nan") if cell.lower() in _NONE else parse(cell) for cell in cells]
    return np.array(found, dtype=np.longdouble)


def unit_of_text(cell: str) -> str | None:
    """Return the unit that a text can only be of, None if it is of none or of several."""
    for unit in UNAMBIGUOUS:
        try:
            _parser(unit)(cell)
        except ValueError:
            continue
        return unit
    return None


def _parser(unit: str) -> Callable[[str], int]:
    if unit == TIME_OF_DAY:
        return _time_of_day
    pattern, (year, month, day) = _DATES[unit]
    known: dict[tuple[str, ...], int] = {}

    def parse(cell: str) -> int:
        match = pattern.match(cell)
        if match is None:
            raise ValueError(cell)
        *numbers, hour, minute, second, fraction, half, zone = match.groups()
        key = tuple(numbers)
        if key not in known:
            known[key] = _days(int(numbers[year]), int(numbers[month]), int(numbers[day]), cell)
        since = 0 if hour is None else _since_midnight(cell, hour, minute, second, fraction, half)
        return known[key] * _DAY + since - _shift(zone)

    return parse


def _days(year: int, month: int, day: int, cell: str) -> int:
    try:
        return date(year, month, day).toordinal() - _EPOCH
    except ValueError:
        raise ValueError(cell) from None


def _time_of_day(cell: str) -> int:
    match = _TIME_OF_DAY.match(cell)
    if match is None:
        raise ValueError(cell)
    hour, minute, second, fraction, half = match.groups()
    return _since_midnight(cell, hour, minute, second, fraction, half)


def _since_midnight(
    cell: str, hour: str, minute: str, second: str | None, fraction: str | None, half: str | None
) -> int:
    # 60 is a leap second.
    if int(hour) > 23 or int(minute) > 59 or int(second or 0) > 60:
        raise ValueError(cell)
    if half is not None and not 1 <= int(hour) <= 12:
        raise ValueError(cell)
    # Noon and midnight are 12.
    hours = int(hour) if half is None else int(hour) % 12 + 12 * (half in "pP")
    whole = (hours * 60 + int(minute)) * 60 + int(second or 0)
    return whole * _SECOND + int((fraction or "0").ljust(9, "0"))


def _shift(zone: str | None) -> int:
    if zone is None or zone == "Z":
        return 0
    minutes = int(zone[1:3]) * 60 + int(zone[-2:])
    return (-minutes if zone[0] == "-" else minutes) * 60 * _SECOND
