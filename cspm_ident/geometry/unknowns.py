"""The unknowns of a machine's geometry, and how cable lengths depend on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from cspm_ident.geometry.length_rows import LengthRows
from cspm_model.accuracies import ACCURACIES
from cspm_model.end_slopes import end_slopes
from cspm_model.kernels.cable import ATTACHMENT, EXIT
from cspm_model.kernels.trajectory import lengths_along

Array = NDArray[np.float64]

ENDS = ("exit", "attachment")
# Of a cable's own block: exit, attachment, drum radius, stiffness.
_OWN, SCALE, STRETCH = 8, 6, 7
# Of the block of all: where the frame's and the bar's markers are, and how late poses are.
_COMMON = 13
# Lateness is no number of the file, so that nothing is known of it [s].
_LATENESS_SD = 1.0


class Unknown(NamedTuple):
    """One number that may be off.

    Attributes:
        group: whose accuracies are off together.
        accuracy: standard deviation before the recording [m, rad, 1, s].
    """

    group: str
    accuracy: float


@dataclass(frozen=True, eq=False)
class Unknowns:
    """All of n cables: by cable exit x y z, attachment x y z, radius, stiffness; then the markers.

    Attributes:
        n: cables.
        moving: of each cable, whether its winch turns; one that does not shows no radius.
    """

    n: int
    moving: NDArray[np.bool_]

    @property
    def listed(self) -> list[Unknown]:
        """Each unknown's group and accuracy, in order."""
        point = [Unknown("points", ACCURACIES[end].sd) for end in ENDS for _ in range(3)]
        own = [*point, Unknown("drum radius", ACCURACIES["drum radius"].sd)]
        own.append(Unknown("stiffness", ACCURACIES["stiffness"].sd))
        place = [Unknown("markers", ACCURACIES["marker place"].sd)] * 3
        turn = [Unknown("markers", ACCURACIES["marker turn"].sd)] * 3
        return [*own * self.n, *place, *turn, *place, *turn, Unknown("lateness", _LATENESS_SD)]

    def of_cable(self, i: int) -> NDArray[np.intp]:
        """Return the places in the vector of what cable i's length depends on."""
        own = np.arange(_OWN) + _OWN * i
        return np.concatenate([own, _OWN * self.n + np.arange(_COMMON)])

    def markers(self, end: str) -> slice:
        """Return where the place and turn of the markers are of the body that has such ends."""
        first = _OWN * self.n + 6 * ENDS.index(end)
        return slice(first, first + 6)

    @property
    def lateness(self) -> int:
        """The place of the lateness of the poses."""
        return _OWN * self.n + _COMMON - 1

    def seen(self, points: Array) -> Array:
        """Return the map from all unknowns to the ends as the poses see them, (6n, unknowns).

        Ends and markers act on lengths as their sum alone.

        Args:
            points: exits and attachments, (2, n, 3) [m].
        """
        out = np.zeros((6 * self.n, len(self.listed)))
        for i in range(self.n):
            for k, end in enumerate(ENDS):
                rows = slice(6 * i + 3 * k, 6 * i + 3 * k + 3)
                out[rows, _OWN * i + 3 * k : _OWN * i + 3 * k + 3] = np.eye(3)
                out[rows, self.markers(end)] = np.hstack([np.eye(3), -_cross(points[k, i])])
        return out

    def cables(self, described: Array, values: Array) -> Array:
        """Return parameter rows with the ends as the poses see them."""
        rows: Array = described.copy()
        for k, (end, column) in enumerate(zip(ENDS, (EXIT, ATTACHMENT), strict=True)):
            marker, points = values[self.markers(end)], rows[:, column : column + 3]
            own = values[: _OWN * self.n].reshape(self.n, _OWN)[:, 3 * k : 3 * k + 3]
            turned = Rotation.from_rotvec(marker[3:]).apply(points + own)
            rows[:, column : column + 3] = marker[:3] + turned
        return rows

    def lengths(self, rows: LengthRows, values: Array) -> Array:
        """Return the lengths by the poses, (k, n) [m]."""
        cables, still = self.cables(rows.cables, values), np.zeros_like(rows.bars)
        lengths, left, other = (np.empty((len(rows.bars), self.n)) for _ in range(3))
        lengths_along(cables, rows.bars, rows.frames, still, still, lengths, left, other)
        return lengths

    def residuals(self, rows: LengthRows, values: Array) -> Array:
        """Return by how much lengths by the poses exceed those by the drums, (k, n) [m].

        Each cable's mean is taken off: an encoder counts from where it was switched on.
        """
        own, lengths = values[: _OWN * self.n].reshape(self.n, _OWN), self.lengths(rows, values)
        stretch = (1.0 + own[:, STRETCH]) * rows.stretch
        found = lengths + (1.0 + own[:, SCALE]) * rows.wound - stretch
        found += values[self.lateness] * rows.rates
        return np.asarray(found - found.mean(axis=0))

    def slopes(self, rows: LengthRows, values: Array) -> Array:
        """Return the residuals' slopes over what cable by cable acts, (k, n, 21), less means."""
        cables = self.cables(rows.cables, values)
        by_end = end_slopes(cables, rows.bars, rows.frames)
        lengths = (by_end.exit_lengths, by_end.attachment_lengths)
        places = (cables[:, EXIT : EXIT + 3], cables[:, ATTACHMENT : ATTACHMENT + 3])
        turns = [np.cross(at, slope) for at, slope in zip(places, lengths, strict=True)]
        own = [*lengths, rows.wound[:, :, None], -rows.stretch[:, :, None]]
        common = [lengths[0], turns[0], lengths[1], turns[1], rows.rates[:, :, None]]
        found = np.concatenate([*own, *common], axis=2)
        found[:, ~self.moving, SCALE] = 0.0
        return np.asarray(found - found.mean(axis=0))


def _cross(v: Sequence[float] | Array) -> Array:
    """Return the matrix of v × ·, shape (3, 3)."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
