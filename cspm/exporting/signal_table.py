"""Signals of different stamps as the columns of one table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cspm.signals import Signal

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SignalTable:
    """Columns over common stamps.

    Attributes:
        time: all stamps, in order, (n,) [s].
        columns: values by name, such as `tension/sway_3`, (n,); NaN where a signal has no such
            stamp.
        units: by the same names.
    """

    time: Array
    columns: dict[str, Array]
    units: dict[str, str]


def table_of(signals: Sequence[Signal]) -> SignalTable:
    """Return signals as a table with a row for each stamp that one of them has.

    Nothing is interpolated. Of equal stamps in one signal the last counts.
    """
    time = np.unique(np.concatenate([each.time for each in signals]))
    columns, units = {}, {}
    for each in signals:
        rows = np.searchsorted(time, each.time)
        for name, unit, values in zip(each.columns, each.units, each.values.T, strict=True):
            column = np.full(len(time), np.nan)
            column[rows] = values
            columns[f"{each.name}/{name}"] = column
            units[f"{each.name}/{name}"] = unit
    return SignalTable(time, columns, units)
