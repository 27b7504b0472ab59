"""How what is fitted to answers to the law that is taken out of it, and to where encoders rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.estimation import Estimate
from cspm_ident.rig.branches import Branch
from cspm_ident.rig.distortion import centred, modelled, undistorted
from cspm_ident.rig.flanks import Ramps, find_ramps
from cspm_ident.rig.hysteresis import find_hysteresis
from cspm_ident.rig.law import Law
from cspm_ident.rig.stiffness_fit import Fitted

Array = NDArray[np.float64]

# Eigenvalues of a correlation below this are rounding.
SMALLEST = 1e-9
# Less wound [m] or pulled [N] than this is rounding.
ROUNDING = 1e-9
# An encoder that rests within so many of its steps in all cycles rests in one place.
RESTING_STEPS = 2.0


class Response(NamedTuple):
    """What moves residuals beside the noise in them.

    Attributes:
        law: by specimen and branch, the derivative of the measured stiffness by the values of the
            law that is taken out of it, (n, 5).
        lowest: by specimen and branch, how each cycle's lowest tension less the mean of all changes
            the stiffness, (cycles, n) [N/m].
        rests: by specimen, place of rest and branch, how a standard deviation of where the encoder
            is within its step there changes the stiffness, (n,) [N/m].
    """

    law: list[list[Array]]
    lowest: list[list[Array]]
    rests: list[list[list[Array]]]

    def of(self, branch: int) -> Response:
        """Return that of one branch alone, by number."""
        law = [[each[branch]] for each in self.law]
        lowest = [[each[branch]] for each in self.lowest]
        return Response(law, lowest, [[[p[branch]] for p in places] for places in self.rests])


def find_response(ramps: Sequence[Ramps], found: Fitted, cutoff: float) -> Response:
    """Return how the branches of specimens answer, in the middle of their loops.

    Args:
        ramps: as measured.
        found: fitted to them.
        cutoff: of the filter [Hz].
    """
    law, directions = found.law, _directions(found.estimate)
    answer = Response([], [], [])
    for one in ramps:
        base = _branches(one, law, cutoff)
        slopes = [_slope(one, law, way, cutoff) for way in directions.T]
        back = np.linalg.pinv(directions)
        answer.law.append(
            [np.stack(each, axis=1) @ back for each in zip(*slopes, strict=True)]
            if slopes
            else [np.zeros((len(each.tension), len(law) - 1)) for each in base]
        )
        answer.lowest.append(_of_lowest(one, base, law, cutoff))
        elsewhere = _rested_elsewhere(one, cutoff)
        answer.rests.append(
            [_changes(base, _branches(other, law, cutoff), law) for other in elsewhere]
        )
    return answer


def _directions(estimate: Estimate) -> Array:
    """Return independent changes of the law's values, of a standard deviation each, (5, k).

    Smaller changes would show where the samples happen to lie beside the bend of the law, larger
    ones another law.
    """
    known = np.flatnonzero(np.isfinite(estimate.sd) & (estimate.sd > 0.0))
    size, axes = np.linalg.eigh(estimate.correlation[np.ix_(known, known)])
    found = np.zeros((len(estimate.values), len(known)))
    found[known] = estimate.sd[known, None] * axes * np.sqrt(np.maximum(size, SMALLEST))
    return found


def _slope(ramps: Ramps, law: Law, way: Array, cutoff: float) -> list[Array]:
    """Return half of what the branches change from one side to the other, each (n,) [N/m]."""
    ends = []
    for side in (1.0, -1.0):
        values = np.append(np.array(law[:-1]) + side * way, law.floor)
        moved = Law(*(float(value) for value in values))
        ends.append(_rest(_branches(ramps, moved, cutoff), law))
    return [0.5 * (after - before) for after, before in zip(*ends, strict=True)]


def _branches(ramps: Ramps, law: Law, cutoff: float) -> list[Branch]:
    width = find_hysteresis(ramps).half_width
    middle = centred(ramps, width)
    return undistorted(middle, modelled(middle, law, width, cutoff), law)


def _rest(branches: Sequence[Branch], law: Law) -> list[Array]:
    return [one.stiffness - law.stiffness(one.tension, one.length) for one in branches]


def _of_lowest(ramps: Ramps, base: Sequence[Branch], law: Law, cutoff: float) -> list[Array]:
    """Return what the cycles' lowest tensions, from which the law is followed, change."""
    place, tension = ramps.lowest
    apart = ramps.lowest_by_cycle - tension
    step = max(float(apart.std()), ROUNDING)
    moved = _branches(replace(ramps, lowest=(place, tension + step)), law, cutoff)
    return [np.outer(apart / step, each) for each in _changes(base, moved, law)]


def _rested_elsewhere(ramps: Ramps, cutoff: float) -> list[Ramps]:
    """Return the ramps had the encoder rested a standard deviation on, low and high."""
    specimen = ramps.specimen
    steps = np.abs(np.diff(specimen.wound))
    steps = steps[steps > ROUNDING]
    if not steps.size:
        return []
    step = float(steps.min())
    low = specimen.wound <= specimen.wound.min() + RESTING_STEPS * step
    high = specimen.wound >= specimen.wound.max() - RESTING_STEPS * step
    moved = [specimen.wound + where * step / np.sqrt(12.0) for where in (low, high)]
    return [find_ramps(replace(specimen, wound=wound), cutoff) for wound in moved]


def _changes(before: Sequence[Branch], after: Sequence[Branch], law: Law) -> list[Array]:
    """Return how much more the law leaves, at the tensions of `before`."""
    found = []
    pairs = zip(before, after, _rest(before, law), _rest(after, law), strict=True)
    for one, other, left, rest in pairs:
        order = np.argsort(other.tension)
        found.append(np.interp(one.tension, other.tension[order], rest[order]) - left)
    return found
