"""Which samples of several clocks make one message: those of one instant, or within a tolerance.

No sample is moved in time and none is made. Where stamps differ, the message has that of the first
column, and the tolerance is reported.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cspm_ident.importing.column_series import ColumnSeries
from cspm_ident.importing.mapping import Mapping
from cspm_ident.importing.time_base import Times
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.message import NANOSECONDS

Index = NDArray[np.int64]
SHARE = 0.05
"""Of the shortest median step, taken as tolerance unless one is given. What moves by a sine of a
tenth of the sampling rate, faster than any motion judged here, then errs by 2π/10·0.05 = 3 % of
its amplitude at most."""


@dataclass(frozen=True)
class Tolerance:
    """How far stamps of one message may differ, and do [s]."""

    allowed_s: float
    largest_s: float
    stamped_by: str


@dataclass(frozen=True)
class Pairs:
    """Samples that stand together.

    Attributes:
        stamp_ns: of the messages, shape (n,).
        places: for each field the row of each message, shape (n,); None for a constant.
        no_time: rows without time.
        unpaired: samples without a partner.
        tolerance: None where all stamps are equal.
    """

    stamp_ns: Index
    places: dict[str, Index | None]
    no_time: int
    unpaired: int
    tolerance: Tolerance | None


def paired(series: dict[str, ColumnSeries], mapping: Mapping, where: str) -> Pairs:
    """Return the samples that make messages.

    Args:
        series: columns by field.
        mapping: with the tolerance, and what to do with samples without partner.
        where: names the topic in errors.

    Raises:
        InputError: samples have no partner, and the mapping does not drop them.
    """
    clocks: dict[int, tuple[Times, list[str]]] = {}
    for name, one in series.items():
        if one.times is not None:
            clocks.setdefault(id(one.times), (one.times, []))[1].append(name)
    groups = list(clocks.values())
    rows = [times.rows for times, _ in groups]
    no_time = sum(len(times.stamp_ns) - len(times.rows) for times, _ in groups)
    stamps = [
        times.stamp_ns if len(at) == len(times.stamp_ns) else times.stamp_ns[at]
        for (times, _), at in zip(groups, rows, strict=True)
    ]
    names = [names for _, names in groups]
    unpaired, tolerance, common = 0, None, stamps[0]
    if any(not np.array_equal(common, other) for other in stamps[1:]):
        found = _matched(stamps, mapping, names[0][0])
        unpaired = sum(len(own) - len(found.stamp_ns) for own in stamps)
        if mapping.unpaired != "drop" or not len(found.stamp_ns):
            _check(found, stamps, names, where)
        common, tolerance = found.stamp_ns, found.tolerance
        rows = [at[chosen] for at, chosen in zip(rows, found.chosen, strict=True)]
    places: dict[str, Index | None] = dict.fromkeys(series)
    for fields, at in zip(names, rows, strict=True):
        places |= dict.fromkeys(fields, at)
    return Pairs(common, places, no_time, unpaired, tolerance)


@dataclass(frozen=True)
class _Matched:
    """Common stamps, the sample of each clock at each, and the tolerance if stamps differ."""

    stamp_ns: Index
    chosen: list[Index]
    tolerance: Tolerance | None
    allowed_ns: int


def _matched(stamps: Sequence[Index], mapping: Mapping, first: str) -> _Matched:
    given = mapping.pairing
    allowed = SHARE * _shortest_step(stamps) if given is None else given * NANOSECONDS
    allowed_ns = int(allowed)
    common, at = np.unique(stamps[0], return_index=True)
    chosen = [at]
    for other in stamps[1:]:
        unique, place = np.unique(other, return_index=True)
        near = _nearest(unique, common)
        hit = np.abs(unique[near] - common) <= allowed_ns
        # Of two that would take the same partner the first has it.
        _, firsts = np.unique(near[hit], return_index=True)
        keep = np.flatnonzero(hit)[firsts]
        common, chosen = common[keep], [*(one[keep] for one in chosen), place[near[keep]]]
    largest = (
        max(
            (int(np.abs(own[at] - common).max()) for own, at in zip(stamps, chosen, strict=True)),
            default=0,
        )
        if len(common)
        else 0
    )
    differs = Tolerance(allowed_ns / NANOSECONDS, largest / NANOSECONDS, first)
    return _Matched(common, chosen, differs if largest else None, allowed_ns)


def _shortest_step(stamps: Sequence[Index]) -> float:
    steps = [np.diff(np.unique(own)) for own in stamps]
    return min((float(np.median(step)) for step in steps if len(step)), default=0.0)


def _nearest(stamps: Index, instants: Index) -> Index:
    """Return for each instant the place of the nearest of rising stamps."""
    after = np.clip(np.searchsorted(stamps, instants), 1, max(len(stamps) - 1, 1))
    after = np.minimum(after, len(stamps) - 1)
    before = np.maximum(after - 1, 0)
    nearer = np.abs(stamps[before] - instants) <= np.abs(stamps[after] - instants)
    return np.asarray(np.where(nearer, before, after))


def _check(
    found: _Matched, stamps: Sequence[Index], names: Sequence[list[str]], where: str
) -> None:
    """Refuse samples without partner, but for those before and after all clocks ran."""
    common, slack = found.stamp_ns, found.allowed_ns
    start = max(int(own.min()) for own in stamps) - slack
    end = min(int(own.max()) for own in stamps) + slack
    inside = [int(((own >= start) & (own <= end)).sum()) for own in stamps]
    if len(common) and all(count == len(common) for count in inside):
        return
    both = " and ".join(
        f"{', '.join(fields)} ({len(own)})" for fields, own in zip(names, stamps, strict=True)
    )
    allowed = "numbers of one message from one instant, or within `pairing`; map what was measured"
    allowed += " at other instants to another topic or leave it out"
    if len(common):
        allowed += ", or unpaired: drop"
    raise InputError(
        f"{where}: {both} have {len(common)} stamps in common, within {slack / NANOSECONDS:.3g} s,"
        f" and nothing is interpolated, allowed: {allowed}"
    )
