"""How late motion capture is: what it says of the cables' lengths must fit winches and load cells.

Drives and load cells are the reference; a load cell that is late cannot be distinguished from a
cable whose damping is wrong, so that is not tried. A late pose shows in all cables equally, in
proportion to how fast it changes the length. Wrong compliance and damping show otherwise and are
fitted beside it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from cspm_ident.estimation import Parameter, Record, fit_linear
from cspm_ident.signals.cable_motion import cable_motion, damping_of
from cspm_ident.signals.measurement import BAR, FRAME
from cspm_ident.signals.noise import noise_above_band
from cspm_ident.signals.samples import Samples
from cspm_ident.signals.timeline import Timeline, whole_stretches
from cspm_model.elastic_law import tabulated_elongation
from cspm_model.kernels.cable import RADIUS
from cspm_model.kernels.machine import PlantParameters
from cspm_msgs_py.testbed import Testbed
from cspm_sim.parameters import plant_parameters

Array = NDArray[np.float64]

# What smoothing and noise make up where there is no delay.
RESOLUTION_S = 1.5e-3
# With an interval that reaches farther to a side, a recording does not determine a delay.
WIDEST_S = 5e-3
# Error of the equation itself, as a standard deviation: what remains without noise.
EQUATION_S = 3e-4
SCALE_S = 0.02
# Nothing here has dynamics that would need a shorter step.
PERIOD_NS = 5_000_000
ROUNDS = 8
STILL_S = 1e-5
# By then the weights of the cables stand still; less than this is rounding [m].
_WEIGHTINGS, _LEAST_M = 4, 1e-9
# A step longer than this would leave where the equation is linear.
LONGEST_STEP_S = 0.03
LONGEST_S = 60.0
SHORTEST_S = 2.0
# With winches that wind less than this [m], damping and a delay of both poses are one and the same.
LEAST_WOUND_M = 5e-4
# Poses are not seen above their band; the comparison stays well below it.
_BAND_SHARE = 0.7
WIDEST_HZ = 20.0
NORMAL_95 = 1.96
# Standard deviations of the noise that a pose must move by.
_LEAST_MOTION = 20.0


@dataclass(frozen=True)
class Delay:
    """One sensor's delay.

    Attributes:
        topic: the sensor.
        seconds: by how much its stamps are late [s].
        interval: of 95 % [s]; infinite where the recording does not determine it.
        window: the time that was looked at, where most moves [s].
    """

    topic: str
    seconds: float
    interval: tuple[float, float]
    window: tuple[float, float]

    @property
    def known(self) -> bool:
        """Whether the recording determines the delay well enough to be of use."""
        return self.interval[1] - self.interval[0] <= 2.0 * WIDEST_S

    @property
    def significant(self) -> bool:
        """Whether zero lies outside the interval."""
        return self.known and not self.interval[0] <= 0.0 <= self.interval[1]

    @property
    def matters(self) -> bool:
        """Whether it is significant, and more than smoothing and noise can cause."""
        return self.significant and abs(self.seconds) > RESOLUTION_S

    @property
    def text(self) -> str:
        """What was found, in a few words."""
        if not self.known:
            return (
                "delay not found: this recording moves too slowly for it; use a livelier one, or"
                f" --delay {self.topic}=SECONDS"
            )
        low, high = (1e3 * end for end in self.interval)
        return (
            f"{1e3 * self.seconds:.2f} ms late (95 %: {low:.2f} to {high:.2f} ms; from"
            f" {self.window[0]:.0f} to {self.window[1]:.0f} s)"
        )

    def data(self) -> dict[str, Any]:
        """Return everything as plain data for JSON."""
        ends = list(self.interval) if np.isfinite(self.interval).all() else None
        return {
            "topic": self.topic,
            "delay_s": self.seconds if self.known else None,
            "ci95_s": ends,
            "window_s": list(self.window),
        }


def find_delays(timeline: Timeline, testbed: Testbed) -> list[Delay]:
    """Return the delays of the motion capture of bar and winch frame.

    From the minute in which winches and bar move most. Without bar, motor angles or tensions the
    list is empty.
    """
    if timeline.bars is None or timeline.angles is None or timeline.tensions is None:
        return []
    parameters = plant_parameters(testbed)
    timeline = timeline.within(*_liveliest(timeline))
    timeline = timeline.slowly(PERIOD_NS, min(timeline.pose_band, WIDEST_HZ))
    sensors = timeline.measurement.sensors
    topics = [name for name in (BAR, FRAME) if name in sensors]
    moving = [name for name in topics if moves(sensors[name])]
    found = {each.topic: each for each in _search(timeline, parameters, moving)}
    window = float(timeline.times[0]), float(timeline.times[-1])
    return [found.get(name, Delay(name, 0.0, (-np.inf, np.inf), window)) for name in topics]


def moves(samples: Samples) -> bool:
    """Return whether a pose does so much more than its noise that noise cannot pass for motion.

    Controllers answer the noise of motion capture with motion, which comes later than the noise.
    """
    noise = noise_above_band(samples)
    return bool((samples.values.std(axis=0) > _LEAST_MOTION * noise).any())


def _search(timeline: Timeline, parameters: PlantParameters, wanted: list[str]) -> list[Delay]:
    delays = dict.fromkeys(wanted, 0.0)
    records: list[Record] = []
    names = wanted
    for _ in range(ROUNDS if wanted else 0):
        records, names = delay_records(timeline.delayed(delays), parameters, wanted)
        if not records:
            return []
        steps = np.clip(least_squares(records)[: len(wanted)], -LONGEST_STEP_S, LONGEST_STEP_S)
        if np.abs(steps).max() < STILL_S:
            break
        delays = {name: delays[name] + float(s) for name, s in zip(wanted, steps, strict=True)}
    return _delays(timeline, records, names, delays) if records else []


def _liveliest(timeline: Timeline) -> tuple[int, int]:
    """Return first and last step of the stretch in which winches and bar move most."""
    steps = len(timeline.times)
    length = min(steps - 1, round(LONGEST_S / timeline.period))
    if length == steps - 1 or timeline.speeds is None or timeline.bars is None:
        return 0, steps - 1
    motion = np.nansum(timeline.speeds**2, axis=1) / (np.nanvar(timeline.speeds) + 1e-12)
    motion += np.nansum(timeline.bars[:, 6:9] ** 2, axis=1) / (np.nanvar(timeline.bars[:, 6:9]))
    summed = np.concatenate([[0.0], np.cumsum(np.nan_to_num(motion))])
    first = int(np.argmax(summed[length:] - summed[:-length]))
    first = min(first, steps - 1 - length)
    return first, first + length


def delay_records(
    timeline: Timeline, parameters: PlantParameters, wanted: list[str], drifting: bool = False
) -> tuple[list[Record], list[str]]:
    """Return the equation in the band that poses show, and the names of its unknowns.

    Args:
        timeline: its signals.
        parameters: of the machine.
        wanted: sensors whose delay [s] is an unknown.
        drifting: whether by how much the delay grows per second is one as well, behind the delays.
    """
    target, columns = _equation(timeline, parameters)
    grown = {f"{name} drift": columns[name] * timeline.times[:, None] for name in wanted}
    columns |= grown
    names = [*wanted, *(grown if drifting else ()), "compliance"]
    if winds(timeline, parameters):
        names.append("damping")
    regressors = np.stack([columns[name] for name in names], axis=2)
    band = min(_BAND_SHARE * timeline.pose_band, WIDEST_HZ)
    shortest = round(SHORTEST_S / timeline.period)
    records = [
        Record(
            _in_band(target[a : b + 1], timeline.period, band),
            _in_band(regressors[a : b + 1], timeline.period, band),
        )
        for a, b in whole_stretches([target, regressors], shortest)
    ]
    return records, names


def winds(timeline: Timeline, parameters: PlantParameters) -> bool:
    """Return whether winches move by so much that damping shows otherwise than a delay."""
    if timeline.angles is None:
        return False
    wound = timeline.angles * parameters.cables[:, RADIUS]
    return bool((np.nanmax(wound, axis=0) - np.nanmin(wound, axis=0)).max() > LEAST_WOUND_M)


def least_squares(records: list[Record]) -> Array:
    """Return the least squares solution, each cable weighted by what is left of it.

    Near zero tension a load cell's noise is half a millimetre of a soft cable, ten times that of
    the poses. Not whitened: that would give weight to high frequencies, at which the regressors are
    noise, and noise in regressors draws what is found towards zero.
    """
    rows = np.concatenate([record.regressors for record in records])
    target = np.concatenate([record.target for record in records])
    weights = np.ones(target.shape[1])
    for _ in range(_WEIGHTINGS):
        scaled = (rows * weights[:, None]).reshape(-1, rows.shape[2])
        found = np.linalg.lstsq(scaled, (target * weights).ravel(), rcond=None)[0]
        weights = 1.0 / np.maximum(np.std(target - rows @ found, axis=0), _LEAST_M)
    return np.asarray(found)


def _delays(
    timeline: Timeline, records: list[Record], names: list[str], delays: dict[str, float]
) -> list[Delay]:
    """Return the delays with intervals: of coloured noise, and of the equation's own error."""
    parameters = [
        Parameter(name, "s", scale=SCALE_S) if name in delays else Parameter(name, "1", scale=1.0)
        for name in names
    ]
    ends = fit_linear(records, parameters, whiten=False).estimate.ci95
    window = float(timeline.times[0]), float(timeline.times[-1])
    found = []
    for (topic, seconds), (low, high) in zip(delays.items(), ends, strict=False):
        half = float(np.hypot(0.5 * (high - low), NORMAL_95 * EQUATION_S))
        found.append(Delay(topic, seconds, (seconds - half, seconds + half), window))
    return found


def _equation(timeline: Timeline, parameters: PlantParameters) -> tuple[Array, dict[str, Array]]:
    """Return l − ε(t) − l0 per cable, (k, n) [m], and how each unknown shows in it.

    The unstretched length l0 at the first step, unknown since encoders count from anywhere, is the
    mean that the others say.
    """
    motion = cable_motion(timeline, parameters)
    tensions = np.asarray(timeline.smooth_tensions)
    damping = damping_of(parameters, motion.lengths)
    # The elongation's rate from the load cells: that of the poses is too noisy to be multiplied
    # by the damping, and its noise would come back in what the delays are fitted by.
    stretch = tabulated_elongation(parameters, tensions, motion.lengths)
    rates = np.gradient(stretch, timeline.period, axis=0)
    elastic = tensions - damping * rates
    stretch = tabulated_elongation(parameters, elastic, motion.lengths - stretch)
    target = motion.lengths - stretch
    target -= np.nanmean(target / motion.left, axis=0) * motion.left
    softness = np.gradient(stretch, axis=0) / (np.gradient(elastic, axis=0) + 1e-12)
    softness = np.clip(softness, 0.0, 1e-2)
    return target, {
        BAR: -motion.bar_rates,
        FRAME: -motion.frame_rates,
        "compliance": stretch,
        "damping": -softness * damping * rates,
    }


def _in_band(values: Array, period: float, band: float) -> Array:
    """Return the values without what is above the band and without means, at fewer samples."""
    sos = butter(4, band, fs=1.0 / period, output="sos")
    keep = max(1, round(1.0 / (4.0 * band * period)))
    return np.asarray(sosfiltfilt(sos, values - values.mean(axis=0), axis=0)[::keep])
