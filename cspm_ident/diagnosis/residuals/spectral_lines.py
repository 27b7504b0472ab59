"""Periodic external forces: spectral lines of the residuals above the machine's motion.

No effect of the catalogue causes them. The windows that suppress the poses' noise suppress them as
well, so they are searched for in residuals with the shortest windows.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.signal import periodogram

from cspm_ident.diagnosis.residuals.cable_and_bar_equations import fine_equations
from cspm_ident.diagnosis.residuals.corrected_measurement import as_found
from cspm_ident.diagnosis.residuals.machine_signals import MachineSignals, machine_signals
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.timeline import Timeline
from cspm_sim.effect_entries import read_actions

Array = NDArray[np.float64]

# Number of frequencies near a line, whose median is the noise there.
_BESIDE = 101
# Number of pieces in which an external force keeps its phase and size; a decaying one does not.
_PIECES = 8
HIGHEST_HZ = 10.0
"""Poses are smoothed to this band where lines are looked for."""
WIDTH_HZ = 0.1
"""Distance up to which two lines are one: the resolution of a spectrum over 10 s."""


class Line(NamedTuple):
    """A periodic part of a residual.

    Attributes:
        place: which residual.
        channel: which of its channels.
        frequency: [Hz].
        amplitude: in the residual's unit.
        chance: p-value of its height under noise, for all frequencies searched.
        alternates: whether it is an aliased reading rather than a line of a residual.
    """

    place: Place
    channel: int
    frequency: float
    amplitude: float
    chance: float
    alternates: bool = False

    def is_same(self, other: Line, thresholds: Thresholds = DEFAULT_THRESHOLDS) -> bool:
        """Return whether two lines have the same residual and frequency, within the line width."""
        near = abs(self.frequency - other.frequency) <= WIDTH_HZ
        return self.place == other.place and near


def lines_of(
    measurement: Measurement,
    weights: Mapping[Candidate, Array],
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> tuple[Line, ...]:
    """Return the spectral lines of bar and cables beyond the findings, most significant first.

    Args:
        measurement: what was recorded.
        weights: of the findings.
        thresholds: those of lines.
    """
    fitted = as_found(measurement, weights)
    stretches = machine_signals(Timeline(fitted, pose_band=HIGHEST_HZ))
    equations = fine_equations(stretches, fitted, read_actions(fitted.machine), thresholds)
    lowest = _driven_up_to(stretches, thresholds)
    series = [(e.place, c, e.times, e.target[:, c]) for e in equations for c in _channels(e)]
    found = [
        line
        for each in series
        if (line := highest_line(*each, lowest, len(series), thresholds)) is not None
    ]
    return tuple(_apart(sorted(found, key=lambda line: line.chance), thresholds))


def _channels(equation: Equation) -> range:
    return range(equation.target.shape[1])


def _noise_ratio(thresholds: Thresholds) -> float:
    """Return the multiple of its median that a bin of noise exceeds at the rate of false alarms."""
    return -float(np.log2(max(thresholds.line_false_alarm_rate, 1e-300)))


def _driven_up_to(stretches: Sequence[MachineSignals], thresholds: Thresholds) -> float:
    """Return the frequency above which neither winches nor frame move [Hz]."""
    highest = 0.0
    for signals in stretches:
        for moved in (signals.frame.poses, signals.angles):
            frequencies, power = periodogram(moved, 1.0 / signals.step, "hann", axis=0)
            power[power < _noise_ratio(thresholds) * np.median(power, axis=0)] = 0.0
            summed = np.cumsum(power.sum(axis=1))
            edge = np.searchsorted(summed, thresholds.whole_share * summed[-1])
            highest = max(highest, float(frequencies[edge]))
    return highest


def highest_line(
    place: Place,
    channel: int,
    times: Array,
    values: Array,
    lowest: float,
    tried: int,
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> Line | None:
    """Return a series' highest line, if it is significant and keeps its phase; else None.

    Args:
        place: residual of the series.
        channel: of the residual.
        times: at equal steps, shape (k,) [s].
        values: (k,).
        lowest: frequency above which to search [Hz].
        tried: number of series searched.
        thresholds: those of lines.
    """
    frequencies, power = periodogram(
        values, 1.0 / float(np.median(np.diff(times))), "hann", detrend="linear"
    )
    floor = median_filter(power, _BESIDE, mode="nearest") / np.log(2.0)
    looked = (frequencies > lowest) & (frequencies < HIGHEST_HZ)
    if not looked.any():
        return None
    height = np.where(looked, power / np.maximum(floor, 1e-300), 0.0)
    best = int(np.argmax(height))
    chance = float(np.exp(-height[best])) * int(looked.sum()) * tried
    if chance > thresholds.line_false_alarm_rate:
        return None
    frequency = _refined(times, values, float(frequencies[best]), float(frequencies[1]))
    if _coherence(times, values, frequency) < thresholds.line_coherence:
        return None
    amplitude = 2.0 * abs(_demodulated(times, values, frequency))
    return Line(place, channel, frequency, amplitude, chance)


def _demodulated(times: Array, values: Array, frequency: float) -> complex:
    window = np.hanning(len(times))
    turned = values * window * np.exp(-2j * np.pi * frequency * times)
    return complex(turned.sum() / window.sum())


def _refined(times: Array, values: Array, frequency: float, step: float) -> float:
    """Return the frequency of the highest amplitude, within one step of the spectrum."""
    near = frequency + step * np.linspace(-1.0, 1.0, 81)
    return float(near[np.argmax([abs(_demodulated(times, values, f)) for f in near])])


def _coherence(times: Array, values: Array, frequency: float) -> float:
    """Return |mean|²/mean|·|² of the line's complex amplitude over pieces of the series."""
    pieces = zip(np.array_split(times, _PIECES), np.array_split(values, _PIECES), strict=True)
    found = np.array([_demodulated(t, v - v.mean(), frequency) for t, v in pieces])
    return float(abs(found.mean()) ** 2 / np.mean(np.abs(found) ** 2))


def _apart(lines: Iterable[Line], thresholds: Thresholds) -> Iterable[Line]:
    """Yield the most significant line of those with the same frequency in one residual."""
    kept: list[Line] = []
    for line in lines:
        if not any(line.is_same(other, thresholds) for other in kept):
            kept.append(line)
            yield line


def with_lines(equations: Sequence[Equation], lines: Sequence[Line]) -> list[Equation]:
    """Return equations with the lines as nuisance regressors, so that no effect explains them."""
    return [_with(e, [line for line in lines if line.place == e.place]) for e in equations]


def _with(equation: Equation, lines: Sequence[Line]) -> Equation:
    if not lines:
        return equation
    columns = np.zeros((*equation.target.shape, 2 * len(lines)))
    for k, line in enumerate(lines):
        turned = 2.0 * np.pi * line.frequency * equation.times
        columns[:, line.channel, 2 * k] = np.cos(turned)
        columns[:, line.channel, 2 * k + 1] = np.sin(turned)
    before = equation.nuisance if equation.nuisance.size else columns[:, :, :0]
    return replace(equation, nuisance=np.concatenate([before, columns], axis=2))
