"""Scale, zero and sag of each cable's encoder length, against measured poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_checks.machine.poses import elastic_range
from cspm_ident.estimation import Estimate, Interval, Parameter, Record, fit_linear
from cspm_ident.estimation.objection import Objection, sign_objections
from cspm_ident.lengths.length_rows import LengthRows, length_rows
from cspm_ident.recording_roles import check_roles
from cspm_ident.signals.measurement import Measurement
from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]

ZERO, SCALE, LATE, SAG = "zero", "scale", "pose lateness", "sag"
# How far each may lie off: a metre, all of the length, a second, and a tenth of the length of a
# horizontal cable of a metre.
_SCALES = {ZERO: 1.0, SCALE: 1.0, LATE: 1.0, SAG: 0.1}
_UNITS = {ZERO: "m", SCALE: "1", LATE: "s", SAG: "1/m²"}


@dataclass(frozen=True, eq=False)
class CableLength:
    """One cable: l = zero − scale·(r/n)·q − sag·h²·l³ + lateness·l̇.

    Attributes:
        name: of the cable.
        estimate: `scale`, `pose lateness` [s], and `sag` [1/m²] where it changes
            the length by more than stretch may.
        zero: length at angle 0 in the first recording, and its interval [m].
        travel: largest less smallest length in the recordings [m].
        elastic: share of the travel that may be stretch, by the described law and tension limits.
        errors: RMS of the length [mm] with the described scale and the fitted one, by recording:
            those fitted, then those held out.
    """

    name: str
    estimate: Estimate
    zero: tuple[float, tuple[float, float]]
    travel: float
    elastic: float
    errors: tuple[tuple[str, bool, float, float], ...]

    @property
    def is_off(self) -> bool:
        """Whether the scale is another than 1 by more than its interval and the cable's stretch."""
        low, high = self.estimate.interval(SCALE)
        known = isfinite(low) and isfinite(high)
        return known and (low > 1.0 + self.elastic or high < 1.0 - self.elastic)

    @property
    def objections(self) -> list[Objection]:
        """Why the scale is no result."""
        remedy = "check the sign of the angle: positive winds in"
        return sign_objections(self.estimate, {SCALE}, {SAG}, remedy)

    def data(self) -> dict[str, Any]:
        """Return everything as plain data for JSON."""
        heads = ("recording", "held_out", "described_rms_mm", "fitted_rms_mm")
        return {
            "name": self.name,
            "estimate": self.estimate.data(),
            "zero_m": {"value": self.zero[0], "ci95": list(self.zero[1])},
            "travel_m": self.travel,
            "elastic_share": self.elastic,
            "scale_is_off": self.is_off,
            "errors": [dict(zip(heads, each, strict=True)) for each in self.errors],
        }


@dataclass(frozen=True, eq=False)
class LengthsResult:
    """The cables of a machine, those that move.

    Attributes:
        cables: in the file's order.
        standing: names of cables whose encoder does not move.
        searched: recordings that were fitted.
    """

    cables: tuple[CableLength, ...]
    standing: tuple[str, ...]
    searched: tuple[Measurement, ...]

    @property
    def objections(self) -> tuple[str, ...]:
        """Why scales are no result, in words."""
        return tuple(f"{c.name}: {each.text}" for c in self.cables for each in c.objections)

    def data(self) -> dict[str, Any]:
        """Return everything as plain data for JSON."""
        return {
            "recordings": [{"path": str(m.path), "sha256": m.sha256} for m in self.searched],
            "cables": [cable.data() for cable in self.cables],
            "standing": list(self.standing),
        }


def identify_lengths(
    searched: Sequence[Measurement], held_out: Sequence[Measurement] = ()
) -> LengthsResult:
    """Fit what encoders read of each cable to the length that the poses say.

    Neither torque nor tension is used. Elongation is no part of the model: its share of the travel
    bounds what the scale may be off without an encoder or a drum being wrong.

    Args:
        searched: to fit, all of one machine.
        held_out: to judge only.

    Raises:
        InputError: recordings that do not go together, see `length_rows`, or no winch that moves.
    """
    check_roles(searched, held_out)
    found = [length_rows(each) for each in (*searched, *held_out)]
    own = found[: len(searched)]
    names = searched[0].machine.cable_names
    moving = [i for i in range(len(names)) if any(np.ptp(rows.wound[:, i]) > 0.0 for rows in own)]
    if not moving:
        raise InputError(
            f"{searched[0].path}: no winch moves, allowed: recordings in which one does"
        )
    mean = np.average([rows.lengths.mean(axis=0) for rows in own], axis=0)
    stretch = elastic_range(searched[0].machine, mean)
    cables = tuple(
        _cable(i, names[i], searched, held_out, found, float(stretch[i])) for i in moving
    )
    still = tuple(name for i, name in enumerate(names) if i not in moving)
    return LengthsResult(cables, still, tuple(searched))


def _cable(
    i: int,
    name: str,
    searched: Sequence[Measurement],
    held_out: Sequence[Measurement],
    found: Sequence[LengthRows],
    stretch: float,
) -> CableLength:
    own, shape = found[: len(searched)], [SCALE, LATE]
    low, high = _estimate(i, own, [*shape, SAG]).interval(SAG)
    # What a sag changes of the length has to be more than what stretch may.
    if isfinite(high) and low * max(float(np.ptp(rows.sag[:, i])) for rows in own) > stretch:
        shape.append(SAG)
    estimate, first = _estimate(i, own, shape), _estimate(i, own[:1], [ZERO, *shape])
    travel = max(float(np.ptp(rows.lengths[:, i])) for rows in own)
    errors = tuple(
        (str(m.path), m in held_out, _rms(i, rows, None), _rms(i, rows, estimate))
        for m, rows in zip((*searched, *held_out), found, strict=True)
    )
    zero = first.value(ZERO), first.interval(ZERO)
    return CableLength(name, estimate, zero, travel, stretch / max(travel, 1e-12), errors)


def _columns(i: int, rows: LengthRows, names: Sequence[str]) -> Array:
    every = {
        ZERO: np.ones(len(rows.times)),
        SCALE: rows.wound[:, i],
        LATE: rows.rates[:, i],
        SAG: -rows.sag[:, i],
    }
    return np.stack([every[name] for name in names], axis=1)


def _estimate(i: int, found: Sequence[LengthRows], names: Sequence[str]) -> Estimate:
    """Return the fit of a cable; without `ZERO` each recording counts from a zero of its own."""
    records: list[Record] = []
    for rows in found:
        columns, target = _columns(i, rows, names), rows.lengths[:, i]
        if ZERO not in names:
            columns, target = columns - columns.mean(axis=0), target - target.mean()
        edges = pairwise([*rows.starts, len(target)])
        records += [Record(target[a:b], columns[a:b]) for a, b in edges if b - a > len(names)]
    if not records:
        raise InputError("lengths: no stretch without a hole, allowed: longer stretches")
    parameters = [Parameter(name, _UNITS[name], scale=_SCALES[name]) for name in names]
    fitted = fit_linear(records, parameters, whiten=False, interval=Interval.BOOTSTRAP)
    return fitted.estimate


def _rms(i: int, rows: LengthRows, estimate: Estimate | None) -> float:
    """Return the RMS error of a length about its mean [mm]; without estimate, as described."""
    if estimate is None:
        left = rows.lengths[:, i] - rows.wound[:, i]
    else:
        left = rows.lengths[:, i] - _columns(i, rows, estimate.names) @ estimate.values
    return 1e3 * float(np.std(left))
