"""Which drives are at their torque limit, how much of the time, and how long at a time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Tally = NDArray[np.int64]

# A drive that is at its limit so long at a time does not follow [s]; a loop that touches it for
# shorter chatters.
STRETCH_S = 0.1
# Of each drive in a tally: instants at the limit, those of the present stretch, of the longest.
KINDS = 3


class DriveSaturation(NamedTuple):
    """How one drive met its torque limit.

    Attributes:
        drive: name of its cable.
        share: of the time at the limit, 0 to 1.
        longest: at a time [s].
    """

    drive: str
    share: float
    longest: float

    @property
    def lasts(self) -> bool:
        """Whether it is at its limit for stretches, in which it does not follow."""
        return self.longest >= STRETCH_S

    @property
    def words(self) -> str:
        """Share and kind, such as `sway_3 34.0 % (chatter, 9 ms at most)`."""
        kind = "stretches, up to" if self.lasts else "chatter, at most"
        length = f"{self.longest:.2g} s" if self.longest >= 1.0 else f"{1e3 * self.longest:.3g} ms"
        return f"{self.drive} {100.0 * self.share:.1f} % ({kind} {length})"


@njit(cache=True)
def count_at_limit(tally: Tally, torques: Array, limits: Array) -> bool:
    """Count an instant, and return whether any torque (n,) is at its limit (n,) or beyond [N·m].

    `tally` has KINDS numbers for each drive, (KINDS·n,).
    """
    found = 0
    for i in range(limits.shape[0]):
        at = KINDS * i
        if abs(torques[i]) >= limits[i]:
            found += 1
            tally[at] += 1
            tally[at + 1] += 1
            tally[at + 2] = max(tally[at + 2], tally[at + 1])
        else:
            tally[at + 1] = 0
    return found > 0


def of_tally(
    tally: Tally, instants: int, period: float, names: Sequence[str]
) -> list[DriveSaturation]:
    """Return what was counted of each drive, in the order of its names.

    Args:
        tally: see `count_at_limit`.
        instants: how many were counted.
        period: from one to the next [s].
        names: of the drives.
    """
    counts = tally.reshape(-1, KINDS)
    return [
        DriveSaturation(name, float(at / max(instants, 1)), float(longest * period))
        for name, (at, _, longest) in zip(names, counts, strict=True)
    ]


def saturation_of(
    times: Array, torques: Array, limits: Array, names: Sequence[str]
) -> list[DriveSaturation]:
    """Return how each drive of a recording met its torque limit.

    Args:
        times: shape (k,) [s].
        torques: as recorded, shape (k, n) [N·m].
        limits: shape (n,) [N·m]; a little less than the drives' own where these round.
        names: of the n drives.
    """
    tally = np.zeros(KINDS * len(names), dtype=np.int64)
    for row in np.ascontiguousarray(torques):
        count_at_limit(tally, row, limits)
    period = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    return of_tally(tally, len(times), period, names)


def saturation_words(found: Iterable[DriveSaturation], least: float) -> str:
    """Return those drives in words that are at their limit for a share of `least` or more."""
    return ", ".join(each.words for each in found if each.share >= least)
