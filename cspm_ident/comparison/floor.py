"""What noise alone would leave of the error, so that nobody fits below it."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from cspm_ident.block_simulation import BlockSimulation, Drive, Simulated, Window
from cspm_ident.signals.measurement import (
    BAR,
    FRAME,
    SPEED,
    TENSION,
    TORQUE,
    WINCHES,
    Measurement,
)
from cspm_ident.signals.noise import (
    noise_above_band,
    noise_at_rest,
    noise_between,
    rest_of,
    with_more_noise,
)
from cspm_ident.signals.samples import Samples
from cspm_ident.signals.timeline import Timeline
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]

_LONGEST_S = 30.0
# More of the signals than is simulated, so that smoothing has both sides.
_MARGIN_S = 3.0
_SEED = 20260101
_WINCH_PARTS = (WINCHES, SPEED, TORQUE)
_POSES = {FRAME: "frame_pose", BAR: "bar_pose"}
_MOTION = {WINCHES: "angle", SPEED: "speed"}
# What noise goes to, by drive and topic: attributes of the measurement.
_INPUTS = {
    Drive.WINCH: {**_POSES, **_MOTION},
    Drive.CABLE: {**_POSES, **_MOTION},
    Drive.TORQUE: {**_POSES, **_MOTION, TORQUE: "torque"},
    Drive.TENSION: {**_POSES, TENSION: "tension"},
    Drive.SHAFT: {**_MOTION, TORQUE: "torque", TENSION: "tension"},
}


class NoiseSource(Enum):
    """Where a sensor's noise is known from, the best first."""

    REPEAT = "repeat of the experiment"
    REST = "recorded rest"
    TESTBED = "test-bed file"
    BAND = "what lies above the signal's band"


def noise_of(
    measurement: Measurement, repeat: Measurement | None
) -> tuple[dict[str, Array], dict[str, NoiseSource]]:
    """Return each sensor's standard deviation by topic, one per column, and where from."""
    rest = rest_of(measurement)
    found: dict[str, Array] = {}
    sources: dict[str, NoiseSource] = {}
    again = {} if repeat is None else _parts(repeat)
    for topic, samples in _parts(measurement).items():
        declared = _declared(measurement.machine, topic, samples.values.shape[1])
        if topic in again:
            found[topic], sources[topic] = (
                noise_between(samples, again[topic]),
                NoiseSource.REPEAT,
            )
        # At rest a drive still acts on the noise of the sensors that it is controlled by.
        elif topic != TORQUE and rest is not None and _enough(samples, rest):
            found[topic], sources[topic] = noise_at_rest(samples, rest), NoiseSource.REST
        elif declared is not None:
            found[topic], sources[topic] = declared, NoiseSource.TESTBED
        else:
            found[topic], sources[topic] = noise_above_band(samples), NoiseSource.BAND
    return found, sources


def _parts(measurement: Measurement) -> dict[str, Samples]:
    """Return the sensors, and speeds and torques that drives report beside their angles."""
    others = {SPEED: measurement.speed, TORQUE: measurement.torque}
    return measurement.sensors | {name: s for name, s in others.items() if s is not None}


def _enough(samples: Samples, rest: tuple[float, float]) -> bool:
    return len(samples.within(*rest).times) >= 50


def _declared(machine: Testbed, topic: str, width: int) -> Array | None:
    """Return what the test-bed file says: its noise, and the rounding to its resolution."""
    sensor = machine.sensors.get(topic.split(" ")[0])
    if sensor is None:
        return None
    deviation = np.hypot(np.array(sensor.noise), np.array(sensor.resolution) / np.sqrt(12.0))
    if topic in _WINCH_PARTS:
        return np.full(width, deviation[_WINCH_PARTS.index(topic)])
    return np.repeat(deviation, width // len(deviation))


def propagated(
    timeline: Timeline,
    machine: Testbed,
    drive: Drive,
    windows: list[Window],
    noise: Mapping[str, Array],
) -> Simulated:
    """Return how a simulation scatters when its inputs get as much noise as they have.

    The difference of two simulations, of which one has the noise once more, over half a minute.
    """
    some = _first(windows, timeline.period)
    if not some:
        return _nothing(len(machine.cables))
    first, last = some[0][0], max(end for _, end in some)
    clean = timeline.within(first, last)
    some = [(start - first, end - first) for start, end in some]
    noisy = _noisier(clean, drive, noise)
    before = BlockSimulation(clean, machine).run(drive, some)
    after = BlockSimulation(noisy, machine).run(drive, some)
    return Simulated(
        after.bars - before.bars,
        after.tensions - before.tensions,
        after.angles - before.angles,
        after.speeds - before.speeds,
        after.failed,
    )


def lasting_rms(scatter: Array, steps: int) -> float:
    """Return the RMS that a scatter (k,) has over so many steps, of which it shows the first.

    What it does in its last third it goes on doing: a start from a noisy state has died out.
    """
    squares = scatter[np.isfinite(scatter)] ** 2
    if not len(squares):
        return 0.0
    more = max(0, steps - len(squares))
    total = squares.sum() + more * squares[-max(1, len(squares) // 3) :].mean()
    return float(np.sqrt(total / (len(squares) + more)))


def _noisier(timeline: Timeline, drive: Drive, noise: Mapping[str, Array]) -> Timeline:
    """Return the timeline with the noise of what a drive takes once more."""
    start, end = timeline.times[0] - _MARGIN_S, timeline.times[-1] + _MARGIN_S
    measurement = timeline.measurement.within(start, end)
    more = {
        name: noise[topic]
        for topic, name in _INPUTS[drive].items()
        if getattr(measurement, name) is not None and topic in noise
    }
    noisy = Timeline(with_more_noise(measurement, more, _SEED), timeline.period_ns, timeline.delays)
    noisy.times = timeline.times
    noisy.__dict__["pose_band"] = timeline.pose_band
    return noisy


def _nothing(cables: int) -> Simulated:
    bars, joints = np.zeros((0, 6)), np.zeros((0, cables))
    return Simulated(bars, joints, joints, joints, [])


def _first(windows: list[Window], period: float) -> list[Window]:
    """Return the first windows that make up half a minute, the last of them cut."""
    left, found = round(_LONGEST_S / period), []
    for start, end in windows:
        if left < 2:
            break
        found.append((start, min(end, start + left)))
        left -= end - start
    return found
