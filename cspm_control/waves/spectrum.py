"""The JONSWAP wave spectrum.

Source: Hasselmann et al. 1973 (Joint North Sea Wave Project); shape as in DNV-RP-C205, 3.5.5.
"""

from __future__ import annotations

from math import exp, log
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]
Normalisation = Literal["height", "fitted"]

WIDTH_BELOW = 0.07  # σ of the peak enhancement below the peak frequency
WIDTH_ABOVE = 0.09  # and above it


def jonswap(
    frequency: Array,
    significant_wave_height: float,
    peak_period: float,
    peak_enhancement: float = 3.3,
    normalisation: Normalisation = "height",
) -> Array:
    """Return the one-sided spectral density S(f) of the sea surface [m²/Hz].

    S(f) = C·(5/16) Hs² fp⁴ f⁻⁵ exp(-(5/4)(fp/f)⁴)·γ^r, r = exp(-(f/fp - 1)²/(2σ²)).

    Args:
        frequency: f [Hz], any shape, > 0.
        significant_wave_height: Hs [m].
        peak_period: Tp = 1/fp [s].
        peak_enhancement: γ; 1 gives the Pierson-Moskowitz spectrum.
        normalisation: `height` takes C such that 4√m0 = Hs exactly, over all frequencies;
            `fitted` takes the customary C = 1 - 0.287 ln γ, which misses Hs by some per mille.
    """
    ratio = np.asarray(frequency, dtype=np.float64) * peak_period
    scale = 5.0 / 16.0 * significant_wave_height**2 * peak_period
    shape = scale * ratio**-5.0 * np.exp(-1.25 * ratio**-4.0)
    gain = (
        enhancement_gain(peak_enhancement)
        if normalisation == "height"
        else 1.0 - 0.287 * log(peak_enhancement)
    )
    return gain * shape * _enhancement(ratio, peak_enhancement)


def enhancement_gain(peak_enhancement: float) -> float:
    """Return the factor C that keeps 4√m0 = Hs whatever γ is.

    With v = exp(-(5/4)(fp/f)⁴) the spectrum without its peak is uniform in v over (0, 1), so
    1/C is the mean of γ^r over v.
    """

    def integrand(v: float) -> float:
        ratio = np.asarray((-log(v) / 1.25) ** -0.25)
        return float(_enhancement(ratio, peak_enhancement))

    peak = exp(-1.25)
    below, _ = scipy.integrate.quad(integrand, 0.0, peak, epsabs=1e-11, epsrel=1e-11, limit=200)
    above, _ = scipy.integrate.quad(integrand, peak, 1.0, epsabs=1e-11, epsrel=1e-11, limit=200)
    return 1.0 / (float(below) + float(above))


def significant_wave_height(frequency: Array, density: Array) -> float:
    """Return 4√m0 [m] of a tabulated spectrum; m0 by the trapezoidal rule.

    Args:
        frequency: shape (n,), increasing [Hz].
        density: shape (n,) [m²/Hz].
    """
    m0 = np.sum(0.5 * (density[1:] + density[:-1]) * np.diff(frequency))
    return float(4.0 * np.sqrt(m0))


def _enhancement(ratio: Array, peak_enhancement: float) -> Array:
    width = np.where(ratio <= 1.0, WIDTH_BELOW, WIDTH_ABOVE)
    exponent = np.exp(-((ratio - 1.0) ** 2) / (2.0 * width**2))
    return np.asarray(peak_enhancement**exponent)
