"""Each sensor's noise, and where it is known from."""

from __future__ import annotations

from enum import Enum

import numpy as np
from numpy.typing import NDArray

from cspm_ident.signals.measurement import SPEED, TORQUE, WINCHES, Measurement
from cspm_ident.signals.noise import noise_above_band, noise_at_rest, noise_between, rest_of
from cspm_ident.signals.samples import Samples
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]

_WINCH_PARTS = (WINCHES, SPEED, TORQUE)


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
        declared = declared_noise(measurement.machine, topic, samples.values.shape[1])
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


def declared_noise(machine: Testbed, topic: str, width: int) -> Array | None:
    """Return a sensor's noise and rounding by the test-bed file, (width,); None if not stated.

    Args:
        machine: as described.
        topic: of the sensor; parts of the winches' state by their own names.
        width: number of columns.
    """
    sensor = machine.sensors.get(topic.split(" ")[0])
    if sensor is None:
        return None
    deviation = np.hypot(np.array(sensor.noise), np.array(sensor.resolution) / np.sqrt(12.0))
    if topic in _WINCH_PARTS:
        return np.full(width, deviation[_WINCH_PARTS.index(topic)])
    return np.repeat(deviation, width // len(deviation))
