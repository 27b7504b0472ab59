"""What a motion leaves undetermined of a geometry, and which motion would not."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.geometry.calibration import Calibration
from cspm_ident.geometry.length_rows import RATE, LengthRows
from cspm_ident.geometry.unknowns import ENDS, Unknowns
from cspm_model.end_slopes import end_slopes
from cspm_model.kernels.cable import ATTACHMENT, EXIT
from cspm_model.kinematics import inverse_kinematics
from cspm_msgs_py.dofs import DOFS

Array = NDArray[np.float64]

# Of what was known beforehand: what is known no better than this the motion leaves undetermined.
UNDETERMINED = 0.5
_AXES = "xyz"
# A further recording: seconds, strokes as shares of the mean cable length, and angles [rad].
_SECONDS, _STROKE, _ANGLE = 30.0, 0.1, 0.2
# Ends that lie in one place, or on one line, have no turn that could be known.
_EXTENT = {"m": np.inf, "rad": 0.05}
_BODIES = ("bar", "winch frame")


class Combination(NamedTuple):
    """Numbers that only their sum, or nothing, shows.

    Attributes:
        name: in words.
        cables: of which cables; none for all together.
        unit: m or rad.
        accuracy: standard deviation before the recordings.
        sd: after them, of the least known.
        motion: the single sweep that would determine most; empty where none does.
        sd_with: after that motion as well.
    """

    name: str
    cables: tuple[str, ...]
    unit: str
    accuracy: float
    sd: float
    motion: str
    sd_with: float

    def data(self) -> dict[str, Any]:
        """Return it as plain data for JSON."""
        return {**self._asdict(), "cables": list(self.cables), "motion": self.motion or None}


def undetermined(
    found: Calibration, records: Sequence[LengthRows], names: Sequence[str], *, moves: bool
) -> tuple[Combination, ...]:
    """Return the combinations that recordings leave as they were, with the motion for each.

    Args:
        found: the calibration.
        records: that it rests on.
        names: of the cables.
        moves: whether the winch frame can be moved.
    """
    rows, points = records[0], _points(found, records[0])
    seen = found.unknowns.seen(points)
    sweeps = _sweeps(found, rows, moves=moves)
    listed = []
    for name, unit, cables, directions in _named(found, rows, points, names):
        lines = directions @ seen
        sd, before = found.spread(lines), found.accuracy(lines)
        left = np.flatnonzero((sd > UNDETERMINED * before) & (before < _EXTENT[unit]))
        if not len(left):
            continue
        worst = int(left[np.argmax(sd[left])])
        motion, after = _best(found, sweeps, lines[worst])
        determined = after < UNDETERMINED * sd[worst]
        which = tuple(cables[i] for i in left) if cables else ()
        place = float(before[worst]), float(sd[worst])
        listed.append(Combination(name, which, unit, *place, motion if determined else "", after))
    return tuple(listed)


def _points(found: Calibration, rows: LengthRows) -> Array:
    cables = found.unknowns.cables(rows.cables, found.values)
    return np.stack([cables[:, column : column + 3] for column in (EXIT, ATTACHMENT)])


def _named(
    found: Calibration, rows: LengthRows, points: Array, names: Sequence[str]
) -> Iterator[tuple[str, str, tuple[str, ...], Array]]:
    """Yield combinations by name: unit, cables by row or none, and rows over all ends, (m, 6n)."""
    n, kept = len(names), tuple(names)
    slopes = end_slopes(rows.cables, rows.bars, rows.frames)
    for k, (end, lengths) in enumerate(
        zip(ENDS, (slopes.exit_lengths, slopes.attachment_lengths), strict=True)
    ):
        mean = lengths.mean(axis=0)
        mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-12)
        along = np.zeros((n, 6 * n))
        for i in range(n):
            along[i, 6 * i + 3 * k : 6 * i + 3 * k + 3] = mean[i]
        yield f"{end} along its cable, against the encoder's zero", "m", kept, along
    for axis, letter in enumerate(_AXES):
        both = np.zeros((n, 6 * n))
        both[np.arange(n), 6 * np.arange(n) + axis] = 0.5
        both[np.arange(n), 6 * np.arange(n) + 3 + axis] = 0.5
        yield f"exit and attachment of a cable together in {letter}", "m", kept, both
    yield from _as_bodies(found.unknowns, points)


def _as_bodies(unknowns: Unknowns, points: Array) -> Iterator[tuple[str, str, tuple[()], Array]]:
    """Yield all exits, and all attachments, as one body that lies elsewhere."""
    for end in ENDS:
        moved = unknowns.seen(points)[:, unknowns.markers(end)]
        poses, rank = np.asarray(np.linalg.pinv(moved)), np.linalg.matrix_rank(moved)
        for axis, letter in enumerate(_AXES):
            yield f"all {end}s together in {letter}", "m", (), poses[axis : axis + 1]
        for axis, letter in enumerate(_AXES):
            if rank == 6:
                yield f"all {end}s turned about {letter}", "rad", (), poses[3 + axis : 4 + axis]


def _sweeps(found: Calibration, rows: LengthRows, *, moves: bool) -> dict[str, Array]:
    """Return the information of a further recording with one sweep, by its name."""
    times = np.arange(0.0, _SECONDS, 1.0 / RATE)
    wave = np.sin(2.0 * np.pi * 5.0 * times / _SECONDS)[:, None]
    middle = _middle(rows)
    lengths = inverse_kinematics(rows.cables, *(middle[body] for body in _BODIES))
    stroke = _STROKE * float(lengths.mean())
    out = {}
    for body in _BODIES[: 2 if moves else 1]:
        for dof, name in enumerate(DOFS):
            size = stroke if dof < 3 else _ANGLE
            poses = {each: np.tile(at, (len(times), 1)) for each, at in middle.items()}
            poses[body][:, dof] += size * wave[:, 0]
            unit = f"{size:.2g} m" if dof < 3 else f"{size:.2g} rad"
            out[f"{body} ± {unit} in {name}"] = _informed(found, rows, poses)
    return out


def _middle(rows: LengthRows) -> dict[str, Array]:
    return dict(zip(_BODIES, (rows.bars.mean(axis=0), rows.frames.mean(axis=0)), strict=True))


def _informed(found: Calibration, rows: LengthRows, poses: dict[str, Array]) -> Array:
    """Return the information that lengths along such poses have, (u, u)."""
    bars, frames = (poses[body] for body in _BODIES)
    still = np.zeros((len(bars), len(rows.cables)))
    stretch = np.tile(rows.stretch.mean(axis=0), (len(bars), 1))
    made = LengthRows(rows.cables, bars, frames, still, still, stretch)
    lengths = found.unknowns.residuals(made, np.zeros_like(found.values))
    return found.information_of(made._replace(wound=-lengths))


def _best(found: Calibration, sweeps: dict[str, Array], line: Array) -> tuple[str, float]:
    """Return the sweep after which a combination is known best, and how well."""
    prior = np.diag(found.accuracies**-2.0)
    known = {
        name: float(np.sqrt(line @ np.linalg.solve(found.information + more + prior, line)))
        for name, more in sweeps.items()
    }
    best = min(known, key=known.__getitem__)
    return best, known[best]
