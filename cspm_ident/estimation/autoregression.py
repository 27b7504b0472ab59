"""The colour of a residual: an autoregressive model by Burg's method, and the filter to white."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

Array = NDArray[np.float64]


class Autoregression(NamedTuple):
    """x_t + a_1 x_{t-1} + … + a_p x_{t-p} = e_t, stored by what makes it stable.

    Attributes:
        reflections: the p reflection coefficients, all within ±1.
        variance: of e, in the residual's unit squared.
    """

    reflections: Array
    variance: float

    @property
    def coefficients(self) -> Array:
        """The numbers a_1 … a_p, shape (p,)."""
        return _predictors(self.reflections)[-1]

    @property
    def process_variance(self) -> float:
        """Variance of x."""
        return float(self.variance / np.prod(1.0 - self.reflections**2))

    @property
    def long_run_variance(self) -> float:
        """Samples times the variance of their mean, for many samples."""
        return float(self.variance / (1.0 + self.coefficients.sum()) ** 2)

    @property
    def effective_share(self) -> float:
        """Independent samples per sample, at most 1."""
        return min(1.0, self.process_variance / self.long_run_variance)


def fit_autoregression(
    series: Sequence[Array], max_order: int, floor: float = 0.0
) -> Autoregression:
    """Return the model of least AIC for pieces of one process; nothing spans two pieces.

    Burg's recursion with the errors of all pieces summed, because Yule-Walker's estimate is biased
    towards white where the colour is strong (Kay, Modern Spectral Estimation, 1988, 7.3, 7.7).

    Args:
        series: pieces, each of shape (n,); their mean is not removed.
        max_order: largest order tried.
        floor: standard deviation below which the residual is rounding.
    """
    total = sum(len(piece) for piece in series)
    variance = max(sum(float(piece @ piece) for piece in series) / total, floor**2)
    best, least = Autoregression(np.zeros(0), variance), total * np.log(variance)
    reflections: list[float] = []
    forward, backward = list(series), list(series)
    for order in range(1, max_order + 1):
        forward = [piece[1:] for piece in forward]
        backward = [piece[:-1] for piece in backward]
        power = sum(float(f @ f + b @ b) for f, b in zip(forward, backward, strict=True))
        product = sum(float(f @ b) for f, b in zip(forward, backward, strict=True))
        if power <= 2.0 * floor**2 * total:
            break
        k = float(np.clip(-2.0 * product / power, -_NEARLY_ONE, _NEARLY_ONE))
        reflections.append(k)
        variance *= 1.0 - k * k
        pairs = [(f + k * b, b + k * f) for f, b in zip(forward, backward, strict=True)]
        forward, backward = [f for f, _ in pairs], [b for _, b in pairs]
        criterion = total * np.log(variance) + 2.0 * order
        if criterion < least:
            best, least = Autoregression(np.array(reflections), variance), criterion
    return best


_NEARLY_ONE = 1.0 - 1e-9


def whiten(model: Autoregression, values: Array) -> Array:
    """Return values filtered so that the process becomes white with variance 1.

    The first p samples are predicted from fewer before them (Levinson), so that this is the exact
    likelihood of a stationary process and short pieces lose no sample.

    Args:
        model: of the process.
        values: one piece, or columns of one process, shape (n, …).
    """
    predictors = _predictors(model.reflections)
    result = lfilter(np.concatenate([[1.0], predictors[-1]]), [1.0], values, axis=0)
    variance = model.process_variance
    for k, predictor in enumerate(predictors[:-1][: len(values)]):
        error = values[k] + np.tensordot(predictor, values[:k][::-1], axes=1)
        result[k] = error * np.sqrt(model.variance / variance)
        variance *= 1.0 - model.reflections[k] ** 2
    return np.asarray(result / np.sqrt(model.variance))


def _predictors(reflections: Array) -> list[Array]:
    """Coefficients of the best predictors from 0, 1, … p samples (Levinson's step-up)."""
    found = [np.zeros(0)]
    for k in reflections:
        last = found[-1]
        found.append(np.concatenate([last + k * last[::-1], [k]]))
    return found
