"""One piece of data without gaps: what is to be explained, and what may explain it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Record:
    """A window of equally spaced samples of y = Φ·θ + noise.

    Attributes:
        target: y, shape (n, channels); shape (n,) is taken as one channel.
        regressors: Φ, shape (n, channels, parameters); (n, parameters) for one channel.
        group: records of one group share sensors and rate, hence one noise model.
        instruments: for `fit_instruments`, shape (n, channels, instruments) or (n, instruments).

    Raises:
        InputError: shapes that do not fit, or numbers that are not finite.
    """

    target: Array
    regressors: Array
    group: str = ""
    instruments: Array | None = None

    def __post_init__(self) -> None:
        target = as_channels(self.target, "target")
        object.__setattr__(self, "target", target)
        object.__setattr__(self, "regressors", _columns(self.regressors, target, "regressors"))
        if self.instruments is not None:
            columns = _columns(self.instruments, target, "instruments")
            object.__setattr__(self, "instruments", columns)


def as_channels(values: Array, what: str) -> Array:
    """Return values of shape (n,) or (n, channels) as (n, channels).

    Raises:
        InputError: another shape, no sample, or not finite.
    """
    array = np.asarray(values, dtype=float)
    array = array[:, None] if array.ndim == 1 else array
    if array.ndim != 2 or array.size == 0:
        raise InputError(f"{what} has shape {array.shape}; allowed: (n,) or (n, channels), n > 0")
    if not np.isfinite(array).all():
        raise InputError(f"{what} has a number that is not finite; allowed: finite numbers")
    return array


def _columns(values: Array, target: Array, what: str) -> Array:
    array = np.asarray(values, dtype=float)
    array = array[:, None, :] if array.ndim == 2 else array
    if array.ndim != 3 or array.shape[:2] != target.shape:
        raise InputError(
            f"{what} have shape {array.shape}; allowed: {target.shape} and one axis for the columns"
        )
    if not np.isfinite(array).all():
        raise InputError(f"{what} have a number that is not finite; allowed: finite numbers")
    return array


def check_records(records: Sequence[Record], columns: int) -> None:
    """Check that there are records, all with so many regressors.

    Raises:
        InputError: none, or another number of regressors.
    """
    if not records:
        raise InputError("no records to estimate from; allowed: one or more")
    for record in records:
        if record.regressors.shape[2] != columns:
            raise InputError(
                f"a record has {record.regressors.shape[2]} regressors; "
                f"allowed: one for each of {columns} parameters"
            )
