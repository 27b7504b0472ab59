"""Where cables begin and end, and how encoders count, from poses and motor angles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from cspm_ident.estimation.objection import Objection
from cspm_ident.geometry.calibration import Calibration, calibrate
from cspm_ident.geometry.combinations import UNDETERMINED, Combination, undetermined
from cspm_ident.geometry.length_rows import LengthRows, length_rows
from cspm_ident.geometry.unknowns import ENDS, SCALE, STRETCH
from cspm_ident.recording_roles import check_roles
from cspm_ident.signals.measurement import Measurement
from cspm_model.accuracies import ACCURACIES
from cspm_model.kernels.cable import ATTACHMENT, EXIT
from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]

AXES = "xyz"
RADIUS, STIFFNESS, LATENESS = "drum radius", "stiffness", "pose lateness"
# One false alarm in twenty healthy machines, whatever the count of numbers that are looked at.
_LEVEL = 0.05


class Number(NamedTuple):
    """One number of a geometry.

    Attributes:
        name: `exit x`, `attachment z`, `drum radius`, `stiffness`, `pose lateness`.
        unit: m, s, or 1 for a share of the file's number.
        off: by how much it is off.
        ci95: interval of that.
        accuracy: standard deviation that it is usually known with; infinite where it is not.
        determined: whether the recordings make it known at least twice as well as before.
        beyond: whether it is off by more than its accuracy and interval allow, for the count of
            numbers looked at.
    """

    name: str
    unit: str
    off: float
    ci95: tuple[float, float]
    accuracy: float
    determined: bool
    beyond: bool

    def data(self) -> dict[str, Any]:
        """Return it as plain data for JSON."""
        known = bool(np.isfinite(self.accuracy))
        return {
            **self._asdict(),
            "ci95": list(self.ci95),
            "accuracy": self.accuracy if known else None,
        }


@dataclass(frozen=True, eq=False)
class CableGeometry:
    """One cable.

    Attributes:
        name: of the cable.
        numbers: exit x y z and attachment x y z as the poses see them, drum radius as a share, and
            stiffness where there are load cells.
        zeros: length by the poses at the first row, by fitted recording [m].
        moves: whether its winch turned.
        errors: RMS of the length [mm] with the described geometry and the fitted one, by recording:
            those fitted, then those held out.
    """

    name: str
    numbers: tuple[Number, ...]
    zeros: tuple[float, ...]
    moves: bool
    errors: tuple[tuple[str, bool, float, float], ...]

    def number(self, name: str) -> Number:
        """Return one of its numbers by name."""
        return next(each for each in self.numbers if each.name == name)

    @property
    def objections(self) -> list[Objection]:
        """Why its numbers are no result."""
        low, high = (1.0 + end for end in self.number(RADIUS).ci95)
        if not self.moves or high > 0.0:
            return []
        text = f"scale {low:.4g} … {high:.4g} is below 0, which no machine has"
        remedy = "check the sign of the angle: positive winds in"
        return [Objection((RADIUS,), text, remedy)]

    def data(self) -> dict[str, Any]:
        """Return everything as plain data for JSON."""
        heads = ("recording", "held_out", "described_rms_mm", "fitted_rms_mm")
        return {
            "name": self.name,
            "numbers": [each.data() for each in self.numbers],
            "zeros_m": list(self.zeros),
            "moves": self.moves,
            "errors": [dict(zip(heads, each, strict=True)) for each in self.errors],
        }


@dataclass(frozen=True, eq=False)
class GeometryResult:
    """The geometry of a machine.

    Attributes:
        cables: in the file's order.
        lateness: of the poses' stamps against the encoders'.
        undetermined: combinations that the recordings leave undetermined.
        factors: by group of numbers, by how much they are farther off than usual.
        searched: recordings that were fitted.
    """

    cables: tuple[CableGeometry, ...]
    lateness: Number
    undetermined: tuple[Combination, ...]
    factors: dict[str, float]
    searched: tuple[Measurement, ...]

    @property
    def objections(self) -> tuple[str, ...]:
        """Why numbers are no result, in words."""
        return tuple(f"{c.name}: {each.text}" for c in self.cables for each in c.objections)

    def data(self) -> dict[str, Any]:
        """Return everything as plain data for JSON."""
        return {
            "recordings": [{"path": str(m.path), "sha256": m.sha256} for m in self.searched],
            "cables": [cable.data() for cable in self.cables],
            "pose_lateness": self.lateness.data(),
            "undetermined": [each.data() for each in self.undetermined],
            "accuracy_factors": self.factors,
        }


def identify_geometry(
    searched: Sequence[Measurement], held_out: Sequence[Measurement] = ()
) -> GeometryResult:
    """Fit exits, attachments, drum radii and the poses' lateness to cable lengths.

    Load cells, where there are, give the stretch. Without them it is an error of the lengths.

    Args:
        searched: to fit, all of one machine.
        held_out: to judge only.

    Raises:
        InputError: recordings that do not go together, see `length_rows`, no winch that moves, or a
            cable with a route.
        ConvergenceError: the search does not settle.
    """
    check_roles(searched, held_out)
    every = (*searched, *held_out)
    found = [length_rows(each) for each in every]
    own, machine = found[: len(searched)], searched[0].machine
    if not any(np.ptp(rows.wound) > 0.0 for rows in own):
        raise InputError(
            f"{searched[0].path}: no winch moves, allowed: recordings in which one does"
        )
    routed = [cable.name for cable in machine.cables if cable.route]
    if routed:
        raise InputError(
            f"{searched[0].path}: {routed[0]} has a route, allowed: cables from exit to attachment"
        )
    fit = calibrate(own)
    errors = _errors(fit, every, found, len(searched))
    cables = tuple(
        CableGeometry(
            name,
            numbers,
            tuple(float(_at_first(fit, rows, i)) for rows in own),
            bool(fit.unknowns.moving[i]),
            errors[i],
        )
        for i, (name, numbers) in enumerate(
            zip(machine.cable_names, _numbers(fit, own), strict=True)
        )
    )
    moves = machine.winch_frame is not None and searched[0].frame_pose is not None
    left = undetermined(fit, own, machine.cable_names, moves=moves)
    return GeometryResult(cables, _lateness(fit), left, fit.factors, tuple(searched))


def _numbers(fit: Calibration, records: Sequence[LengthRows]) -> list[tuple[Number, ...]]:
    """Return the numbers of each cable."""
    rows, unknowns = records[0], fit.unknowns
    fitted = unknowns.cables(rows.cables, fit.values)
    columns = [*range(EXIT, EXIT + 3), *range(ATTACHMENT, ATTACHMENT + 3)]
    points = np.stack([fitted[:, EXIT : EXIT + 3], fitted[:, ATTACHMENT : ATTACHMENT + 3]])
    off = (fitted - rows.cables)[:, columns].ravel()
    seen = unknowns.seen(points)
    names = [(f"{end} {axis}", ACCURACIES[end].sd) for end in ENDS for axis in AXES]
    shares = [(RADIUS, SCALE), (STIFFNESS, STRETCH)]
    if not any(each.stretch.any() for each in records):
        shares.pop()
    looked = unknowns.n * (len(names) + len(shares))
    ends = [
        _number(fit, name, "m", float(off[k]), seen[k], accuracy, looked)
        for k, (name, accuracy) in enumerate(names * unknowns.n)
    ]
    out = []
    for i in range(unknowns.n):
        own = unknowns.of_cable(i)
        lines = [np.eye(len(fit.values))[own[at]] for _, at in shares]
        more = [
            _number(fit, name, "1", float(fit.values[own[at]]), line, ACCURACIES[name].sd, looked)
            for (name, at), line in zip(shares, lines, strict=True)
        ]
        out.append((*ends[6 * i : 6 * i + 6], *more))
    return out


def _number(
    fit: Calibration,
    name: str,
    unit: str,
    off: float,
    line: Array,
    accuracy: float,
    looked: int,
) -> Number:
    """Return a number that is a combination `line` of unknowns, (u,)."""
    sd, before = float(fit.spread(line[None])[0]), float(fit.accuracy(line[None])[0])
    half = fit.quantile * sd
    deviate = float(norm.isf(0.5 * _LEVEL / looked))
    beyond = abs(off) > deviate * np.hypot(accuracy, half / norm.isf(0.025))
    determined = sd < UNDETERMINED * before
    return Number(name, unit, off, (off - half, off + half), accuracy, determined, bool(beyond))


def _lateness(fit: Calibration) -> Number:
    line = np.eye(len(fit.values))[fit.unknowns.lateness]
    return _number(fit, LATENESS, "s", float(fit.values @ line), line, np.inf, 1)


def _at_first(fit: Calibration, rows: LengthRows, i: int) -> Array:
    """Return cable i's length by the fitted geometry at the first row [m]."""
    lengths = fit.unknowns.lengths(rows, fit.values)
    return np.asarray(lengths[0, i])


def _errors(
    fit: Calibration, every: Sequence[Measurement], found: Sequence[LengthRows], searched: int
) -> list[tuple[tuple[str, bool, float, float], ...]]:
    """Return each cable's errors [mm] by recording."""
    none = np.zeros_like(fit.values)
    sizes = [
        [1e3 * fit.unknowns.residuals(rows, values).std(axis=0) for values in (none, fit.values)]
        for rows in found
    ]
    return [
        tuple(
            (str(m.path), k >= searched, float(size[0][i]), float(size[1][i]))
            for k, (m, size) in enumerate(zip(every, sizes, strict=True))
        )
        for i in range(fit.unknowns.n)
    ]
