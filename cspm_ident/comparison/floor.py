"""What noise alone would leave of the error, so that nobody fits below it."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from cspm_ident.block_simulation import BlockSimulation, Drive, Simulated, Window
from cspm_ident.signals.measurement import BAR, FRAME, TENSION, WINCHES, Measurement
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

_LONGEST_S = 60.0
_SEED = 20260101


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
    again = repeat.sensors if repeat is not None else {}
    for topic, samples in measurement.sensors.items():
        declared = _declared(measurement.machine, topic, samples.values.shape[1])
        if topic in again:
            found[topic], sources[topic] = (
                noise_between(samples, again[topic]),
                NoiseSource.REPEAT,
            )
        elif rest is not None and _enough(samples, rest):
            found[topic], sources[topic] = noise_at_rest(samples, rest), NoiseSource.REST
        elif declared is not None:
            found[topic], sources[topic] = declared, NoiseSource.TESTBED
        else:
            found[topic], sources[topic] = noise_above_band(samples), NoiseSource.BAND
    return found, sources


def _enough(samples: Samples, rest: tuple[float, float]) -> bool:
    return len(samples.within(*rest).times) >= 50


def _declared(machine: Testbed, topic: str, width: int) -> Array | None:
    """Return what the test-bed file says: its noise, and the rounding to its resolution."""
    sensor = machine.sensors.get(topic)
    if sensor is None:
        return None
    deviation = np.hypot(np.array(sensor.noise), np.array(sensor.resolution) / np.sqrt(12.0))
    if topic == WINCHES:
        return np.full(width, deviation[0])
    return np.repeat(deviation, width // len(deviation))


def propagated(
    timeline: Timeline,
    machine: Testbed,
    drive: Drive,
    windows: list[Window],
    noise: Mapping[str, Array],
) -> Simulated:
    """Return how a simulation scatters when its inputs get as much noise as they have.

    The difference of two simulations, of which one has the noise once more, over at most a minute.
    """
    inputs = {FRAME: "frame_pose", WINCHES: "angle"}
    if drive is Drive.TENSION:
        inputs[TENSION] = "tension"
    if drive is not Drive.WINCH:
        inputs[BAR] = "bar_pose"
    measurement = timeline.measurement
    more = {
        name: noise[topic]
        for topic, name in inputs.items()
        if getattr(measurement, name) is not None and topic in noise
    }
    noisy = Timeline(with_more_noise(measurement, more, _SEED), timeline.period_ns, timeline.delays)
    noisy.times = timeline.times
    noisy.__dict__["pose_band"] = timeline.pose_band
    some = _minute(windows, timeline.period)
    first = BlockSimulation(timeline, machine).run(drive, some)
    second = BlockSimulation(noisy, machine).run(drive, some)
    return Simulated(
        second.bars - first.bars,
        second.tensions - first.tensions,
        second.angles - first.angles,
        second.failed,
    )


def _minute(windows: list[Window], period: float) -> list[Window]:
    """Return the first windows that make up a minute, the last of them cut."""
    left, found = round(_LONGEST_S / period), []
    for start, end in windows:
        if left < 2:
            break
        found.append((start, min(end, start + left)))
        left -= end - start
    return found
