"""Mean stiffness over the cycles, stretching and releasing kept apart."""

from __future__ import annotations

from collections.abc import Container, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.rig.flanks import DOWN, UP, Flank, Ramps
from cspm_ident.rig.law import Law
from cspm_ident.rig.winding import Winding

Array = NDArray[np.float64]

BRANCHES = (UP, DOWN)


class Branch(NamedTuple):
    """The mean of one direction's flanks, in order of the wound cable.

    Attributes:
        branch: `up` or `down`.
        tension: (n,) [N].
        stiffness: of the cable at constant unstretched length, (n,) [N/m].
        length: elastic length, (n,) [m].
        scatter: of each cycle less the mean: tension [N] and stiffness [N/m], (cycles, 2, n); None
            where nothing was averaged.
    """

    branch: str
    tension: Array
    stiffness: Array
    length: Array
    scatter: Array | None = None


def mean_branches(
    ramps: Ramps, law: Law | None, cycles: Container[int] | None = None
) -> list[Branch]:
    """Return the mean branches, up and down, of some cycles by number; of all where none is named.

    `law` determines how far the cable is stretched at the lowest tension; without it nothing does.
    """
    flanks = [flank for flank in ramps.flanks if cycles is None or flank.cycle in cycles]
    return [_mean(ramps, law, [f for f in flanks if f.branch == branch]) for branch in BRANCHES]


def _mean(ramps: Ramps, law: Law | None, flanks: Sequence[Flank]) -> Branch:
    low = max(flank.wound.min() for flank in flanks)
    high = min(flank.wound.max() for flank in flanks)
    grid = np.linspace(low, high, min(len(flank.wound) for flank in flanks))
    tensions = np.array([_on(grid, flank.wound, flank.tension) for flank in flanks])
    quotients = np.array([_on(grid, flank.wound, flank.stiffness) for flank in flanks])
    winding = Winding(ramps, law)
    each = np.stack([tensions, quotients / winding.share(grid)], axis=1)
    tension, stiffness = each.mean(axis=0)
    scatter = each - [tension, stiffness]
    return Branch(flanks[0].branch, tension, stiffness, winding.elastic(grid), scatter)


def _on(grid: Array, wound: Array, values: Array) -> Array:
    order = np.argsort(wound)
    return np.interp(grid, wound[order], values[order])
