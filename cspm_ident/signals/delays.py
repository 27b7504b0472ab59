"""How late motion capture is: what it says of the cables' lengths must fit winches and load cells.

Drives and load cells are the reference; a load cell that is late cannot be told from a cable whose
damping is wrong, so that is not tried. A late pose shows in all cables alike, in proportion to how
fast it changes the length. Wrong compliance and damping show otherwise and are fitted beside it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from cspm_ident.estimation import Parameter, Record, fit_linear
from cspm_ident.signals.elongation import cable_motion, damping_of, elongations
from cspm_ident.signals.measurement import BAR, FRAME
from cspm_ident.signals.timeline import Timeline
from cspm_msgs_py.testbed import Testbed
from cspm_sim.kernels.cable import RADIUS
from cspm_sim.kernels.plant import PlantParameters
from cspm_sim.parameters import plant_parameters

Array = NDArray[np.float64]

# What smoothing and noise make up where there is no delay.
RESOLUTION_S = 1.5e-3
_SCALE_S = 0.02
# Nothing here has dynamics that would ask for a shorter step.
_PERIOD_NS = 5_000_000
_ROUNDS = 6
_STILL_S = 1e-5
_LONGEST_S = 60.0
# With winches that wind less than this [m], damping and a delay of both poses are one and the same.
_LEAST_WOUND_M = 5e-4
# Poses are not seen above their band; the comparison stays well below it.
_BAND_SHARE = 0.7
_WIDEST_HZ = 20.0


@dataclass(frozen=True)
class Delay:
    """One sensor's delay.

    Attributes:
        topic: the sensor.
        seconds: by how much its stamps are late [s].
        interval: of 95 % [s]; infinite where the recording cannot tell.
    """

    topic: str
    seconds: float
    interval: tuple[float, float]

    @property
    def known(self) -> bool:
        """Whether the recording tells the delay at all."""
        return bool(np.isfinite(self.interval).all())

    @property
    def significant(self) -> bool:
        """Whether zero lies outside the interval."""
        return self.known and not self.interval[0] <= 0.0 <= self.interval[1]

    @property
    def matters(self) -> bool:
        """Whether it is surely there, and more than smoothing and noise can make up."""
        return self.significant and abs(self.seconds) > RESOLUTION_S

    def data(self) -> dict[str, Any]:
        """Return everything as plain data for JSON."""
        ends = list(self.interval) if self.known else None
        return {"topic": self.topic, "delay_s": self.seconds, "ci95_s": ends}


def find_delays(timeline: Timeline, testbed: Testbed) -> list[Delay]:
    """Return the delays of the motion capture of bar and winch frame.

    Without bar, motor angles or tensions the list is empty.
    """
    if timeline.bars is None or timeline.angles is None or timeline.tensions is None:
        return []
    parameters = plant_parameters(testbed)
    timeline = timeline.slowly(_PERIOD_NS, min(timeline.pose_band, _WIDEST_HZ))
    timeline = timeline.within(*_liveliest(timeline))
    wanted = [name for name in (BAR, FRAME) if name in timeline.measurement.sensors]
    delays = dict.fromkeys(wanted, 0.0)
    for _ in range(_ROUNDS):
        found = _step(timeline.delayed(delays), parameters, wanted)
        change = max(abs(d.seconds - delays[d.topic]) for d in found)
        delays = {d.topic: d.seconds if d.known else 0.0 for d in found}
        if change < _STILL_S:
            break
    return found


def _liveliest(timeline: Timeline) -> tuple[int, int]:
    """Return first and last step of the stretch in which winches or bar move most."""
    steps = len(timeline.times)
    length = min(steps - 1, round(_LONGEST_S / timeline.period))
    if length == steps - 1 or timeline.speeds is None or timeline.bars is None:
        return 0, steps - 1
    motion = np.nansum(timeline.speeds**2, axis=1) / (np.nanvar(timeline.speeds) + 1e-12)
    motion += np.nansum(timeline.bars[:, 6:9] ** 2, axis=1) / (np.nanvar(timeline.bars[:, 6:9]))
    summed = np.concatenate([[0.0], np.cumsum(np.nan_to_num(motion))])
    first = int(np.argmax(summed[length:] - summed[:-length]))
    first = min(first, steps - 1 - length)
    return first, first + length


def _step(timeline: Timeline, parameters: PlantParameters, wanted: list[str]) -> list[Delay]:
    """Return the delays that a linear step from those of the timeline leads to."""
    target, columns = _equation(timeline, parameters)
    names = [*wanted, "compliance"]
    wound = np.asarray(timeline.angles) * parameters.cables[:, RADIUS]
    if (np.nanmax(wound, axis=0) - np.nanmin(wound, axis=0)).max() > _LEAST_WOUND_M:
        names.append("damping")
    regressors = np.stack([columns[name] for name in names], axis=2)
    whole = np.asarray(
        np.isfinite(target).all(axis=1) & np.isfinite(regressors).all(axis=(1, 2)), dtype=np.bool_
    )
    band = min(_BAND_SHARE * timeline.pose_band, _WIDEST_HZ)
    records = [
        Record(
            _in_band(target[a:b], timeline.period, band),
            _in_band(regressors[a:b], timeline.period, band),
        )
        for a, b in _pieces(whole, round(2.0 / timeline.period))
    ]
    parameters_ = [Parameter(name, "s", scale=_SCALE_S) for name in wanted]
    parameters_ += [Parameter(name, "1", scale=1.0) for name in names[len(wanted) :]]
    estimate = fit_linear(records, parameters_).estimate
    found = []
    for name, value, (low, high) in zip(wanted, estimate.values, estimate.ci95, strict=False):
        at = timeline.delays[name]
        found.append(Delay(name, float(value) + at, (float(low) + at, float(high) + at)))
    return found


def _equation(timeline: Timeline, parameters: PlantParameters) -> tuple[Array, dict[str, Array]]:
    """Return l + wound − ε(t) per cable, (k, n) [m], and how each unknown shows in it."""
    motion = cable_motion(timeline, parameters)
    tensions = np.asarray(timeline.smooth_tensions)
    damping = damping_of(parameters, motion.lengths)
    # The elongation's rate from the load cells: that of the poses is too noisy to be multiplied
    # by the damping, and its noise would come back in what the delays are fitted by.
    stretch = elongations(parameters, tensions, motion.lengths)
    rates = np.gradient(stretch, timeline.period, axis=0)
    elastic = tensions - damping * rates
    stretch = elongations(parameters, elastic, motion.lengths)
    target = motion.lengths + motion.wound - stretch
    softness = np.gradient(stretch, axis=0) / (np.gradient(elastic, axis=0) + 1e-12)
    softness = np.clip(softness, 0.0, 1e-2)
    return target, {
        BAR: -motion.bar_rates,
        FRAME: -motion.frame_rates,
        "compliance": stretch,
        "damping": -softness * damping * rates,
    }


def _pieces(whole: NDArray[np.bool_], shortest: int) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], whole, [False]]).astype(int)))
    pairs = zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    return [(a, b) for a, b in pairs if b - a > shortest]


def _in_band(values: Array, period: float, band: float) -> Array:
    """Return the values without what is above the band and without means, at fewer samples."""
    sos = butter(4, band, fs=1.0 / period, output="sos")
    keep = max(1, round(1.0 / (4.0 * band * period)))
    return np.asarray(sosfiltfilt(sos, values - values.mean(axis=0), axis=0)[::keep])
