"""The thesis's stiffness law as functions of arrays, thesis (3-7) and (3-10)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cspm_msgs_py.testbed import Cable, ExponentialStiffness

Array = NDArray[np.float64]

POINTS = 20001


class Law(NamedTuple):
    """k = min(a/l^b·(e^{ct} − e^{dt}), E·A/l) at the tension t, at least `floor` [N].

    Attributes:
        a: [N·m^(b−1)].
        b: exponent of the elastic length.
        c: [1/N].
        d: [1/N].
        rigidity: E·A [N].
        floor: tension below which the stiffness stays [N].
    """

    a: float
    b: float
    c: float
    d: float
    rigidity: float
    floor: float

    def stiffness(self, tension: ArrayLike, length: ArrayLike) -> Array:
        """Return k [N/m] at tensions [N] and elastic lengths [m] of shapes that fit together."""
        length = np.asarray(length, dtype=float)
        return np.minimum(self.uncapped(tension, length), self.rigidity / length)

    def uncapped(self, tension: ArrayLike, length: ArrayLike) -> Array:
        """Return a/l^b·(e^{ct} − e^{dt}) [N/m], thesis (3-7); arguments as `stiffness`."""
        t = np.maximum(np.asarray(tension, dtype=float), self.floor)
        scale = self.a * np.asarray(length, dtype=float) ** -self.b
        return np.asarray(scale * (np.exp(self.c * t) - np.exp(self.d * t)))

    def elongation(self, tension: float, length: float) -> float:
        """Return ε [m], the integral of dt/k from a slack cable to `tension` [N]."""
        curve = tension_curve(self, length, max(tension, self.floor))
        return float(np.interp(tension, curve.tensions, curve.elongations))

    def bend(self, length: float, highest: float) -> float:
        """Return ε [m] where the asymptote begins; infinite where `highest` [N] is below it."""
        curve = tension_curve(self, length, highest)
        above = self.uncapped(curve.tensions, length) > self.rigidity / length
        return float(curve.elongations[above.argmax()]) if above.any() else np.inf


def law_of(cable: Cable) -> Law:
    """Return the law that a test-bed file gives a cable; a linear one has no part below its cap."""
    stiffness = cable.stiffness
    if stiffness is None:
        raise ValueError(f"{cable.name} is a winch without cable")
    rigidity, floor = stiffness.axial_rigidity, stiffness.floor_tension
    if isinstance(stiffness, ExponentialStiffness):
        law = stiffness
        return Law(law.a, law.b, law.c, law.d, rigidity, floor)
    return Law(rigidity, 1.0, 0.0, -np.inf, rigidity, floor)


def section_of(cable: Cable) -> float:
    """Return the cross-section that a test-bed file gives a cable [m²]."""
    if cable.stiffness is None:
        raise ValueError(f"{cable.name} is a winch without cable")
    return float(0.25 * np.pi * cable.stiffness.diameter**2)


class TensionCurve(NamedTuple):
    """Tension over elongation of a cable of one elastic length, both from 0 on."""

    elongations: Array
    tensions: Array
    length: float
    exponent: float

    def tension(self, elongation: Array, length: Array) -> Array:
        """Return t [N] at ε [m] for elastic lengths [m] near the curve's own.

        t depends on ε/l^b, so the curve of one length serves its neighbours.
        """
        scaled = elongation * (self.length / length) ** self.exponent
        return np.asarray(np.interp(scaled, self.elongations, self.tensions))


def tension_curve(law: Law, length: float, highest: float) -> TensionCurve:
    """Return t(ε) of an elastic length [m] up to the tension `highest` [N]: dt/dε = k(l, t)."""
    # Equal ratios of tension, since below the bend of the law k is nearly proportional to it.
    tensions = np.geomspace(law.floor, max(highest, 1.01 * law.floor), POINTS)
    softness = tensions / law.stiffness(tensions, length)
    logarithm = np.log(tensions)
    steps = 0.5 * (softness[1:] + softness[:-1]) * np.diff(logarithm)
    first = law.floor / float(law.stiffness(law.floor, length))
    elongations = first + np.concatenate([[0.0], np.cumsum(steps)])
    return TensionCurve(
        np.concatenate([[0.0], elongations]), np.concatenate([[0.0], tensions]), length, law.b
    )
