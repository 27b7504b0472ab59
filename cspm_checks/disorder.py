"""What brings stamps in order, without loss."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cspm_checks.series import Stamps
from cspm_msgs_py.message import NANOSECONDS

MOST_LOST = 0.01
"""Share of messages: dropping what is out of order is no remedy where it costs more."""
_HOURS = (0.5, 1.0, 2.0)  # that clocks are put back by, h
_NEAR_S = 5.0
_FEWEST, _UNEVEN = 20, 0.1
_ALIKE = 0.6  # share of the seconds with about the usual number of messages


class Order(NamedTuple):
    """What to do about stamps that do not rise.

    Attributes:
        dropped: messages that `disorder: drop` would leave out.
        remedy: in words.
        keys: of the clock in the mapping, where they say it all.
    """

    dropped: int
    remedy: str
    keys: dict[str, float | str]


def order_of(stamp_ns: Stamps) -> Order:
    """Return what brings stamps, shape (n,), in order: dropping only where few go."""
    reached = np.maximum.accumulate(stamp_ns)
    dropped = int((stamp_ns[1:] <= reached[:-1]).sum()) if len(stamp_ns) > 1 else 0
    if dropped <= MOST_LOST * len(stamp_ns):
        text = f"`disorder: drop` in the clock leaves out {dropped} of {len(stamp_ns)} messages"
        return Order(dropped, text, {"disorder": "drop"})
    loses = f"; `disorder: drop` would lose {dropped} of {len(stamp_ns)} messages"
    rate = _rate(stamp_ns)
    even = f"`rate: {rate:.6g}` in place of its column, where sampling is even" if rate else ""
    if back := _put_back(stamp_ns):
        text = f"local time put back by {back:g} h: times in UTC, or with their zone (+02:00)"
        return Order(dropped, f"{text}{f', or {even}' if even else ''}{loses}", _keys(rate))
    if even:
        return Order(dropped, f"{even}; in a bag `stamp: log`{loses}", _keys(rate))
    text = "times with all their digits, in a bag `stamp: log`, or a `rate`"
    return Order(dropped, text + loses, {})


def _keys(rate: float | None) -> dict[str, float | str]:
    return {} if rate is None else {"rate": rate}


def _put_back(stamp_ns: Stamps) -> float | None:
    """Return by how much a local clock was put back [h], None where it was not."""
    back = -np.diff(stamp_ns) / NANOSECONDS
    largest = float(back.max()) if len(back) else 0.0
    return next((hours for hours in _HOURS if abs(largest - 3600.0 * hours) < _NEAR_S), None)


def _rate(stamp_ns: Stamps) -> float | None:
    """Return the rate [Hz] at which messages came: per coarse stamp, else by the usual step."""
    steps = np.diff(stamp_ns)
    rising = steps[steps > 0]
    if len(stamp_ns) < _FEWEST or not len(rising):
        return None
    usual = float(np.median(rising)) / NANOSECONDS
    if np.mean(np.abs(rising / NANOSECONDS - usual) > _UNEVEN * usual) > _UNEVEN:
        return None
    starts = np.concatenate([[0], np.flatnonzero(steps > 0) + 1, [len(stamp_ns)]])
    counts = np.diff(starts)
    # The first and last second are not whole.
    whole = counts[1:-1] if len(counts) > 3 else counts
    count = float(np.median(whole))
    if np.mean(np.abs(whole - count) <= max(1.0, 0.02 * count)) < _ALIKE:
        return None
    return float(f"{count / usual:.6g}")
