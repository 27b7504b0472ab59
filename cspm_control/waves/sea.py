"""A sea state as a finite sum of long-crested waves.

Elevation (upwards): η(x, y, t) = Σ a_n cos(ω_n t - k_n (x cos χ_n + y sin χ_n) + ε_n), deep water,
k = ω²/g. The frequencies are multiples of 1/period, so the sea repeats. Phase ε and direction χ
of a wave are drawn from the seed and the wave's frequency alone: whatever band or period another
body's sea has, the waves that both contain are the same waves.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import ceil, floor

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SEA_STREAM = 0x5EA  # keeps the draws for the sea apart from all others made with the same seed


@dataclass(frozen=True)
class WaveSet:
    """The waves of a sea, each array of shape (n,).

    Attributes:
        harmonic: frequency as a multiple of 1/period.
        direction: χ, direction of travel from the world's x axis towards y [rad].
        phase: ε [rad].
        period: time after which the sea repeats [s].
    """

    harmonic: NDArray[np.int64]
    direction: Array
    phase: Array
    period: float

    @property
    def frequency(self) -> Array:
        """Frequencies [Hz], increasing."""
        return self.harmonic / self.period

    @property
    def angular_frequency(self) -> Array:
        """ω [rad/s], increasing."""
        return 2.0 * np.pi * self.frequency

    def phasor(self, position: tuple[float, float], gravity: float) -> Complex:
        """Return exp(i(ε - k·r)) at `position` x, y [m], so that η = Re Σ a·phasor·exp(iωt)."""
        along = position[0] * np.cos(self.direction) + position[1] * np.sin(self.direction)
        lag = wave_number(self.angular_frequency, gravity) * along
        return np.asarray(np.exp(1j * (self.phase - lag)), dtype=np.complex128)


def wave_number(angular_frequency: Array, gravity: float) -> Array:
    """Return k = ω²/g [rad/m], the dispersion of waves on deep water."""
    return angular_frequency**2 / gravity


def draw_waves(
    band: tuple[float, float], period: float, heading: float, spreading: float, seed: int
) -> WaveSet:
    """Draw the waves with frequencies n/period inside `band`, both ends included.

    Args:
        band: lowest and highest frequency [Hz].
        period: [s]; read as the decimal number that it prints as.
        heading: mean direction of travel [rad].
        spreading: s of cos^2s((χ - heading)/2).
        seed: seed of the sea, ≥ 0.
    """
    exact = Fraction(repr(float(period)))
    lowest = ceil(Fraction(repr(float(band[0]))) * exact)
    highest = floor(Fraction(repr(float(band[1]))) * exact)
    harmonic = np.arange(lowest, highest + 1, dtype=np.int64)
    draws = np.array([_draw(Fraction(int(n)) / exact, seed) for n in harmonic]).reshape(-1, 2)
    direction = heading + spreading_offset(draws[:, 1], spreading)
    return WaveSet(harmonic, direction, 2.0 * np.pi * draws[:, 0], float(period))


def spreading_offset(probability: Array, spreading: float) -> Array:
    """Return the quantiles of cos^2s(θ/2) on (-π, π), s = `spreading` [rad].

    With α = θ/2, sin²α has the beta distribution (1/2, s + 1/2) and α is symmetric about 0.

    Args:
        probability: in [0, 1), any shape.
        spreading: s ≥ 0.
    """
    side = 2.0 * probability - 1.0
    square = scipy.special.betaincinv(0.5, spreading + 0.5, np.abs(side))
    return np.asarray(2.0 * np.sign(side) * np.arcsin(np.sqrt(square)))


def _draw(frequency: Fraction, seed: int) -> Array:
    key = (SEA_STREAM, frequency.numerator, frequency.denominator)
    generator = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
    return generator.random(2)
