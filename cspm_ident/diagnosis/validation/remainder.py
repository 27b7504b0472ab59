"""What a model leaves of a residual, against noise and accuracy in the unit that was measured."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import comb
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta

from cspm_ident.diagnosis.residuals.regressors import Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.diagnosis.validation.residual_curves import BINS, explained_by
from cspm_msgs_py.dofs import DOFS

Array = NDArray[np.float64]

# Windows start a quarter of their width apart, so that every fourth row is independent.
_OVERLAP = 4
# Order of the differences that noise is taken from, which a smooth remainder hardly enters.
_ORDER = 3
# Rows that differences at their ends lose.
_LOST = _ORDER * _OVERLAP
# With fewer rows the noise is known too badly for a judgement.
_FEWEST = 2 * _LOST
# White noise of n rows has a ratio below 1 + 5 / √(n − 12) with a probability of 0.999, by
# simulation for n of 40 to 1000; with 24 rows it is 0.99.
_SCATTER = 5.0
# Where no run is long enough for that, neighbouring rows are subtracted. Their windows share three
# quarters, so that differences of white noise are at most twice smaller.
_NEIGHBOURS = 2.0
# Probability with which white noise is taken for a function of one of its drivers.
_FALSE_ALARM = 1e-3
# With few rows the bins of a driver are fewer: so many independent rows fill one.
_ROWS_A_BIN = 6
_FEWEST_BINS = 3
# Rows further apart than this multiple of the usual step are no neighbours.
_GAP = 1.5
# Resolution of a sensor that is said to be exact, as a share of what was measured: 16 bits.
_FINEST = 2.0**-16
# Number of stretches among which the one with most of the remainder is sought.
_STRETCHES = 10


class Stretch(NamedTuple):
    """The tenth of the rows with the largest remainder: times [s], and its share of squares."""

    start: float
    end: float
    share: float


class Remainder(NamedTuple):
    """What a model leaves of one component of a residual, on data that were not searched.

    Attributes:
        place: which residual.
        component: one degree of freedom of the bar's wrench; else empty.
        rms: root mean square of what is left, in the residual's unit.
        noise: its white part, by third differences of independent rows; nan with too few rows.
        rows: number of rows.
        measured: standard deviation of the measured quantity.
        accuracy: standard deviation of the sensor's noise by the test-bed file; nan if not stated.
        driver: measured signal of which the largest share is a function; empty without any.
        share: that share of the squares, from 0 to 1.
        chance: share that white noise exceeds by chance with a probability of 0.001.
        stretch: when most of it occurs.
    """

    place: Place
    component: str
    rms: float
    noise: float
    rows: int
    measured: float
    accuracy: float
    driver: str
    share: float
    chance: float
    stretch: Stretch

    @property
    def ratio(self) -> float:
        """Level of what is left, in multiples of its noise."""
        if self.noise == 0.0:
            return float("inf") if self.rms > 0.0 else 1.0
        return self.rms / self.noise

    @property
    def is_function(self) -> bool:
        """Whether more of what is left is a function of a measured signal than by chance."""
        return self.share > self.chance

    @property
    def excess(self) -> float:
        """Root mean square beyond the noise, or as a function of its driver if that is more."""
        function = self.share * self.rms**2 if self.is_function else 0.0
        return float(np.sqrt(max(function, self.rms**2 - self.noise**2)))

    @property
    def is_judged(self) -> bool:
        """Whether there are enough rows to know the noise."""
        return bool(np.isfinite(self.noise))

    def is_excited(self, thresholds: Thresholds = DEFAULT_THRESHOLDS) -> bool:
        """Return whether the measured quantity exceeds its noise, so that a model can be judged."""
        return self.is_judged and self.measured > thresholds.certain_sigma * self.noise

    def is_at_noise(self, thresholds: Thresholds = DEFAULT_THRESHOLDS) -> bool:
        """Return whether what is left is noise, or immaterial; not with an unknown noise.

        White noise exceeds the allowed ratio with a probability of 0.001, and the share that is a
        function of a driver with the same. As noise is taken from differences of rows, a larger
        ratio also shows that the remainder is not white. Jumps from row to row enter the
        differences: only their driver gives them away.
        """
        scatter = _SCATTER / np.sqrt(max(self.rows - _LOST, 1))
        level = self.ratio <= max(thresholds.noise_floor_ratio, 1.0 + scatter)
        if self.is_judged and level and not self.is_function:
            return True
        sizes = self.excess, self.measured, self.accuracy
        return self.is_judged and is_immaterial(*sizes, thresholds)


def is_immaterial(
    size: float, measured: float, accuracy: float, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> bool:
    """Return whether a difference is too small to matter.

    It is if it is both a small share of the measured quantity and below the sensor's accuracy, or
    the resolution of 16 bits of what was measured where a file says that its sensor is exact.

    Args:
        size: root mean square of the difference, in the unit that was measured.
        measured: standard deviation of the measured quantity.
        accuracy: of its sensor; nan if not stated, when the share alone decides.
        thresholds: `immaterial_share`.
    """
    small = size <= thresholds.immaterial_share * measured
    coarse = size > _FINEST * measured
    return bool(small and not (coarse and size > accuracy))


def remainders_of(
    equations: Sequence[Equation], noise: Array, unit: Array, accuracy: float
) -> tuple[Remainder, ...]:
    """Return what is left of each component of one residual; empty without rows.

    Args:
        equations: those of one place after the model, without reversals, in units of `unit`.
        noise: white part of what is left of each channel, shape (channels,).
        unit: of each channel, shape (channels,).
        accuracy: standard deviation of the sensor's noise; nan if not stated.
    """
    equations = [each for each in equations if len(each.times)]
    if not equations:
        return ()
    unit = np.where(unit > 0.0, unit, 1.0)
    left = np.concatenate([each.left for each in equations]) * unit
    measured = np.concatenate([each.measured for each in equations]) * unit
    times = np.concatenate([each.times for each in equations])
    noise = noise * unit
    components = _components(noise)
    found = []
    for i, name in enumerate(components):
        own = left[:, i]
        rms, spread = float(np.sqrt(np.mean(own**2))), float(np.std(measured[:, i]))
        sizes = rms, float(noise[i]), len(own), spread, accuracy
        driver = _driver(equations, own, name)
        found.append(Remainder(equations[0].place, name, *sizes, *driver, _stretch(times, own)))
    return tuple(found)


def independent_noise(equations: Sequence[Equation]) -> Array:
    """Return the white part of what is left, from rows whose windows do not overlap, (channels,).

    Von Neumann's estimate (Ann. Math. Stat. 12(4), 1941) with third differences: their mean square
    over rows in the order of time, or of a measured signal where that is less. What is a function
    of the signal is smooth in its order, however fast it changes in time; nan with too few rows.
    """
    noise = _noise_in_time(equations)
    for name in equations[0].signals:
        if all(name in each.signals for each in equations) and not name.startswith("time"):
            own = _noise_along(equations, name)
            touched = [dof in name for dof in _components(noise)]
            noise = np.where(touched, np.fmin(noise, own), noise)
    return noise


def _components(channels: Array) -> Sequence[str]:
    return DOFS if len(channels) > 1 else ("",)


def _noise_in_time(equations: Sequence[Equation]) -> Array:
    """Return the noise by differences in time over all runs of rows without a gap.

    An upper bound where all runs are short.
    """
    for lag, factor in ((_OVERLAP, 1.0), (1, _NEIGHBOURS)):
        found = [
            differences
            for each in equations
            for run in _runs(each.times, each.left)
            if len(differences := _differences(run, lag))
        ]
        if sum(map(len, found)) >= _FEWEST - _LOST:
            return factor * _level(found)
    return np.full(equations[0].target.shape[1], np.nan)


def _noise_along(equations: Sequence[Equation], signal: str) -> Array:
    """Return the noise by differences in the order of a signal, of rows that share no window."""
    found = []
    for each in equations:
        for start in range(_OVERLAP):
            own = slice(start, None, _OVERLAP)
            order = np.argsort(each.signals[signal][own], kind="stable")
            found.append(_differences(each.left[own][order], 1))
    if sum(map(len, found)) < _FEWEST - _LOST:
        return np.full(equations[0].target.shape[1], np.nan)
    return _level(found)


def _level(differences: Sequence[Array]) -> Array:
    mean = np.mean(np.concatenate(differences) ** 2, axis=0)
    return np.asarray(np.sqrt(mean / comb(2 * _ORDER, _ORDER)))


def _differences(values: Array, lag: int) -> Array:
    for _ in range(_ORDER):
        values = values[lag:] - values[:-lag]
    return values


def _runs(times: Array, values: Array) -> Iterator[Array]:
    """Yield the values of each run of rows without a gap."""
    steps = np.diff(times)
    ends = np.flatnonzero(steps > _GAP * np.median(steps)) + 1 if len(steps) else np.array([], int)
    yield from np.split(values, ends)


def _driver(equations: Sequence[Equation], left: Array, component: str) -> tuple[str, float, float]:
    """Return the signal of which most of a remainder is a function, the share, and by chance."""
    names = [n for n in equations[0].signals if component in n and not n.startswith("time")]
    independent = len(left) / _OVERLAP
    bins = int(np.clip(independent / _ROWS_A_BIN, _FEWEST_BINS, BINS))
    shares = {
        name: explained_by(np.concatenate([e.signals[name] for e in equations]), left, bins)
        for name in names
        if all(name in e.signals for e in equations)
    }
    best = max(shares, key=lambda name: shares[name], default="")
    return best, shares.get(best, 0.0), _chance(independent, bins, len(shares))


def _chance(rows: float, bins: int, drivers: int) -> float:
    """Return the correlation ratio that white noise exceeds with one of its drivers by chance.

    That of n independent rows in k bins has a beta distribution of (k - 1)/2 and (n - k)/2 (Fisher,
    Statistical Methods for Research Workers, 1925); 1 where there are too few rows.
    """
    if rows <= bins or not drivers:
        return 1.0
    return float(beta.isf(_FALSE_ALARM / drivers, (bins - 1) / 2.0, (rows - bins) / 2.0))


def _stretch(times: Array, left: Array) -> Stretch:
    parts = np.array_split(np.arange(len(times)), min(_STRETCHES, len(times)))
    squares = np.array([np.sum(left[part] ** 2) for part in parts])
    most = int(np.argmax(squares))
    share = float(squares[most] / max(float(squares.sum()), 1e-300))
    return Stretch(float(times[parts[most][0]]), float(times[parts[most][-1]]), share)
