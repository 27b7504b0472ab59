"""Mean stiffness over the cycles, stretching and releasing kept apart."""

from __future__ import annotations

from collections.abc import Container, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.rig.flanks import DOWN, UP, Flank, Ramps
from cspm_ident.rig.law import Law

Array = NDArray[np.float64]

BRANCHES = (UP, DOWN)


class Branch(NamedTuple):
    """The mean of one direction's flanks, in order of the wound cable.

    Attributes:
        branch: `up` or `down`.
        tension: (n,) [N].
        stiffness: of the cable at constant unstretched length, (n,) [N/m].
        length: elastic length, (n,) [m].
    """

    branch: str
    tension: Array
    stiffness: Array
    length: Array


def mean_branches(
    ramps: Ramps, law: Law | None, cycles: Container[int] | None = None
) -> list[Branch]:
    """Return the mean branches, up and down, of some cycles by number; of all where none is named.

    The winch takes stretched cable, so the unstretched length l0 falls by l0/l of what is wound,
    thesis (2-18). How far the cable is stretched at the lowest tension no sensor tells; `law` does,
    and without it nothing.
    """
    flanks = [flank for flank in ramps.flanks if cycles is None or flank.cycle in cycles]
    return [_mean(ramps, law, [f for f in flanks if f.branch == branch]) for branch in BRANCHES]


def _mean(ramps: Ramps, law: Law | None, flanks: Sequence[Flank]) -> Branch:
    low = max(flank.wound.min() for flank in flanks)
    high = min(flank.wound.max() for flank in flanks)
    grid = np.linspace(low, high, min(len(flank.wound) for flank in flanks))
    tension = np.mean([_on(grid, flank.wound, flank.tension) for flank in flanks], axis=0)
    quotient = np.mean([_on(grid, flank.wound, flank.stiffness) for flank in flanks], axis=0)
    specimen, (place, least) = ramps.specimen, ramps.lowest
    start = law.elongation(least, specimen.length) if law else 0.0
    unstretched = (specimen.distance - start) * np.exp(-(grid - place) / specimen.distance)
    elastic = unstretched + specimen.cable.offset_length
    lost = _lost(law, tension, specimen.distance - unstretched, elastic)
    stiffness = quotient * (specimen.distance / unstretched) / (1.0 + lost / elastic)
    return Branch(flanks[0].branch, tension, stiffness, elastic)


def _lost(law: Law | None, tension: Array, elongation: Array, elastic: Array) -> Array:
    """Return −∂t/∂l0·l_e/k at constant ε: what the tension loses as the cable gets longer.

    It is b·ε up to the bend, where t depends on ε/l_e^b, and grows as ε on the asymptote.
    """
    if law is None:
        return elongation
    below = law.uncapped(tension, elastic) <= law.rigidity / elastic
    bend = float(elongation[below].max(initial=0.0))
    return np.asarray(elongation + (law.b - 1.0) * np.minimum(elongation, bend))


def _on(grid: Array, wound: Array, values: Array) -> Array:
    order = np.argsort(wound)
    return np.interp(grid, wound[order], values[order])
