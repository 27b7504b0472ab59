"""How far a loop is from instability, and how fast it is."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from cspm_model.linearisation import StateSpace

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Response = Callable[[Array], ComplexArray]

POINTS_PER_DECADE = 60
HALF_POWER = np.sqrt(0.5)


class Margins(NamedTuple):
    """How far a loop is from instability, and how fast it is.

    Attributes:
        crossover: highest frequency with |L| = 1 [rad/s]; 0 where |L| never reaches 1.
        phase_margin: least phase above −180° at any crossover [rad].
        gain_margin: how much the gain may rise [dB]; infinite without a −180° crossing.
        low_frequency_gain: how much the gain may fall [dB]: |L| at the −180° crossing below the
            crossover, infinite without one.
        bandwidth: where |L/(1+L)| first falls below −3 dB [rad/s].
    """

    crossover: float
    phase_margin: float
    gain_margin: float
    low_frequency_gain: float
    bandwidth: float


class GridResponse:
    """A plant whose frequency response on one grid is computed once, for all of its loops."""

    def __init__(self, plant: StateSpace, grid: Array) -> None:
        """Compute it at angular frequencies of shape (m,) [rad/s]."""
        self._plant, self._grid = plant, grid
        self.inputs = plant.inputs
        self._values = plant.response(grid)

    def response(self, frequencies: ArrayLike) -> ComplexArray:
        """Return G(jω) as `StateSpace.response` does."""
        return self._values if frequencies is self._grid else self._plant.response(frequencies)


def margins(loop: Response, frequencies: Array) -> Margins:
    """Return the margins of the open loop L(jω).

    Args:
        loop: L at angular frequencies (m,) [rad/s].
        frequencies: rising grid that brackets each crossing once; the crossings are then refined.
    """
    values = loop(frequencies)

    def crossings(measure: Callable[[ComplexArray], Array]) -> Array:
        above = measure(values) > 0.0
        places = np.flatnonzero(above[1:] != above[:-1])
        pairs = [(frequencies[i], frequencies[i + 1]) for i in places]
        return np.array([_refine(loop, measure, *pair) for pair in pairs])

    unit = crossings(lambda value: np.abs(value) - 1.0)
    real = crossings(np.imag)
    at_real = np.real(loop(real)) if len(real) else np.zeros(0)
    half = crossings(lambda value: np.abs(value / (1.0 + value)) - HALF_POWER)
    at_unit = loop(unit) if len(unit) else np.zeros(0, dtype=np.complex128)
    return _margins(unit, at_unit, at_real, half)


def grid_margins(frequencies: Array, loop: ComplexArray) -> Margins:
    """Return the margins of the open loop L(jω) by interpolation between its values.

    Args:
        frequencies: rising angular frequencies (m,) [rad/s] that bracket each crossing once.
        loop: L there, shape (m,).
    """
    logarithm = np.log(frequencies)

    def crossings(measure: Array) -> tuple[Array, ComplexArray]:
        i = np.flatnonzero((measure[1:] > 0.0) != (measure[:-1] > 0.0))
        share = measure[i] / (measure[i] - measure[i + 1])
        at = logarithm[i] + share * (logarithm[i + 1] - logarithm[i])
        # Magnitude and phase are near straight lines over the logarithm; the values are not.
        return np.exp(at), loop[i] * (loop[i + 1] / loop[i]) ** share

    unit, at_unit = crossings(np.log(np.abs(loop)))
    _, at_real = crossings(loop.imag)
    half, _ = crossings(np.log(np.abs(loop / (1.0 + loop)) / HALF_POWER))
    return _margins(unit, at_unit, at_real.real, half)


def loop_frequencies(
    plant: StateSpace, frequency: float, points_per_decade: int = POINTS_PER_DECADE
) -> Array:
    """Return three decades on each side of `frequency`, and every resonance, which may be sharp."""
    even = np.geomspace(1e-3 * frequency, 1e3 * frequency, 6 * points_per_decade)
    resonances = np.abs(np.linalg.eigvals(plant.A))
    return np.union1d(even, resonances[(resonances > even[0]) & (resonances < even[-1])])


def _refine(
    loop: Response, measure: Callable[[ComplexArray], Array], low: float, high: float
) -> float:
    def at(frequency: float) -> float:
        return float(measure(loop(np.array([frequency])))[0])

    ends = at(low), at(high)
    if ends[0] * ends[1] > 0.0:  # a root on the grid itself, rounded to either side of it
        return low if abs(ends[0]) < abs(ends[1]) else high
    return float(scipy.optimize.brentq(at, low, high, xtol=1e-10 * low))


def _margins(unit: Array, at_unit: ComplexArray, at_real: Array, half: Array) -> Margins:
    gains = 20.0 * np.log10(-at_real[at_real < 0.0])
    return Margins(
        crossover=float(unit.max(initial=0.0)),
        phase_margin=float(np.angle(-at_unit).min(initial=np.inf)),
        gain_margin=float((-gains[gains <= 0.0]).min(initial=np.inf)),
        low_frequency_gain=float(gains[gains > 0.0].min(initial=np.inf)),
        bandwidth=float(half.min(initial=np.inf)),
    )
