"""How the tension of a cable on a rig follows what is wound in, by a law."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from cspm_ident.rig.flanks import Ramps
from cspm_ident.rig.law import Law

Array = NDArray[np.float64]

# Of the tension; the absolute one [N] far below what a filter's derivative makes of it.
ACCURACY, ROUNDING = 1e-8, 1e-9
GRID = 2000
# A stretched cable's elastic length is shorter by its elongation, which follows from that length.
ROUNDS = 2


class Winding:
    """The lengths of a specimen's cable over what is wound in.

    The winch takes stretched cable, so the unstretched length l0 falls by l0/l of what is wound,
    thesis (2-18). How far the cable is stretched at the lowest tension no sensor measures; the law
    does, and without it nothing.
    """

    def __init__(self, ramps: Ramps, law: Law | None) -> None:
        """Take the lowest point of the ramps as the start."""
        self._specimen, (self._place, self._least) = ramps.specimen, ramps.lowest
        self._highest = 2.0 * max(float(flank.tension.max()) for flank in ramps.flanks)
        self._law, self._start, self._bend = law, 0.0, np.inf
        if law is not None:
            for _ in range(ROUNDS):
                self._start = law.elongation(self._least, self._specimen.length - self._start)
            self._bend = law.bend(self._specimen.length - self._start, self._highest)

    def unstretched(self, wound: Array) -> Array:
        """Return l0 [m] where so much is wound in [m]."""
        distance = self._specimen.distance
        return np.asarray((distance - self._start) * np.exp(-(wound - self._place) / distance))

    def elastic(self, wound: Array) -> Array:
        """Return the elastic length [m]: l0 and the cable beyond the ends."""
        return self.unstretched(wound) + self._specimen.cable.offset_length

    def share(self, wound: Array) -> Array:
        """Return Δt/Δwound over the stiffness of the cable at constant l0.

        As l0 falls, t rises also because a shorter cable is stiffer: by −∂t/∂l0 = k·lost/l_e. Up to
        the bend of the law t depends on ε/l_e^b and `lost` is b·ε, on the asymptote it grows as ε.
        """
        distance = self._specimen.distance
        unstretched = self.unstretched(wound)
        lost = distance - unstretched
        if self._law is not None:
            lost = lost + (self._law.b - 1.0) * np.minimum(lost, self._bend)
        return np.asarray(unstretched / distance * (1.0 + lost / self.elastic(wound)))

    def tension(self, wound: Array) -> Array:
        """Return the tension [N] of a cable that obeys the law and begins as the specimen does.

        Raises:
            ValueError: there is no law.
        """
        law = self._law
        if law is None:
            raise ValueError("a tension needs a law")

        def rise(place: float, tension: Array) -> Array:
            where = np.array([place])
            stiffness = law.stiffness(np.minimum(tension, self._highest), self.elastic(where))
            return np.asarray(stiffness * self.share(where))

        low, high = min(float(wound.min()), self._place), max(float(wound.max()), self._place)
        grid = np.linspace(low, high, GRID)
        found = np.empty_like(grid)
        for side, end in ((grid <= self._place, low), (grid > self._place, high)):
            if side.any() and end != self._place:
                run = solve_ivp(
                    rise,
                    (self._place, end),
                    [self._least],
                    method="DOP853",
                    rtol=ACCURACY,
                    atol=ROUNDING,
                    dense_output=True,
                )
                found[side] = run.sol(grid[side])[0]
            else:
                found[side] = self._least
        return np.interp(wound, grid, np.maximum(found, 0.0))
