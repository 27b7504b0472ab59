"""Held-out data beyond the range of a signal that was searched: findings are extrapolated there."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.regressors import Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation

Array = NDArray[np.float64]
Parts = Sequence[Sequence[Equation]]
Range = tuple[float, float]


class Extrapolation(NamedTuple):
    """A signal that held-out data take beyond what was searched.

    Attributes:
        place: the residual that depends on it.
        signal: name and unit.
        searched: its range in the searched data.
        held_out: its range in the held-out data.
        share: share of the held-out rows beyond the searched range.
    """

    place: Place
    signal: str
    searched: Range
    held_out: Range
    share: float


def extrapolations(
    searched: Parts, held_out: Parts, places: Collection[Place], least: float
) -> tuple[Extrapolation, ...]:
    """Return the signals of some residuals that held-out data take beyond the searched range.

    Args:
        searched: equations of each searched recording.
        held_out: equations of each recording that is held out.
        places: the residuals that count.
        least: share of the held-out rows from which on it counts.
    """
    before, after = _signals(searched, places), _signals(held_out, places)
    found = []
    for (place, signal), values in after.items():
        known = before.get((place, signal))
        if known is None:
            continue
        low, high = float(known.min()), float(known.max())
        share = float(np.mean((values < low) | (values > high)))
        if share >= least:
            reached = float(values.min()), float(values.max())
            found.append(Extrapolation(place, signal, (low, high), reached, share))
    return tuple(found)


def _signals(parts: Parts, places: Collection[Place]) -> dict[tuple[Place, str], Array]:
    """Return each signal's values, functions of time left out."""
    found: dict[tuple[Place, str], list[Array]] = {}
    for part in parts:
        for equation in part:
            if equation.place not in places or not len(equation.times):
                continue
            for name, values in equation.signals.items():
                if not name.startswith("time"):
                    found.setdefault((equation.place, name), []).append(values)
    return {key: np.concatenate(values) for key, values in found.items()}
