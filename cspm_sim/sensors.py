"""Sensors: from true quantities to measured messages, with noise, resolution, delay and rate."""

from __future__ import annotations

import zlib
from collections import deque
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cspm_model.kernels.rows import corrupt, pose_row
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.sensor_spec import Sensor, quantities
from cspm_msgs_py.topics import Topic
from cspm_sim.sensor_fault import Past, SensorFault

Array = NDArray[np.float64]

_DRAWN_AT_ONCE = 1000


class AnySensor(Protocol):
    """What a run needs of a sensor, whoever implements it."""

    def observe(self, step: int, now_ns: int, values: Array) -> tuple[int, Array] | None:
        """Take a sample if one is due; return stamp [ns] and row of one that arrives, if any."""


class SensorModel:
    """One simulated sensor.

    It is offered the true values at every plant step. Poses are offered as x y z φ θ ψ: noise and
    resolution act on these six, and the message carries the quaternion.
    """

    def __init__(
        self,
        topic: Topic,
        sensor: Sensor,
        *,
        rate: int,
        period_ns: int,
        seed: int,
        ideal: bool,
        faults: Sequence[SensorFault] = (),
    ) -> None:
        """Make the sensor of `topic` at `rate` [Hz] for a plant of period `period_ns`.

        Args:
            topic: what it measures.
            sensor: the test-bed's description of it.
            rate: samples per second; divides the plant's rate.
            period_ns: the plant's period [ns].
            seed: of the run; the topic's name makes each sensor's noise its own.
            ideal: leave out noise, resolution and delay.
            faults: what effects do to this sensor; see `sensor_faults`.

        Raises:
            InputError: the rate is above the sensor's, or the delay no multiple of the period.
        """
        if rate > sensor.rate:
            raise InputError(
                f"rates: {topic.name} at {rate} Hz, allowed: at most {sensor.rate} Hz, the sensor's"
            )
        delay = 0.0 if ideal else sensor.delay
        self._delay_steps = round(delay * 1e9 / period_ns)
        if abs(self._delay_steps * period_ns - delay * 1e9) > 1.0:
            raise InputError(
                f"sensors.{topic.name}.delay: {delay:g} s, allowed: a multiple of the plant's"
                f" period of {period_ns * 1e-9:g} s"
            )
        self._divider = round(1e9 / period_ns) // rate
        self._is_pose = topic.ros_type.endswith("PoseStamped")
        self._width = 6 if self._is_pose else topic.width
        repeats = self._width // len(quantities(topic))
        scale = 0.0 if ideal else 1.0
        self._deviation = scale * np.repeat(np.array(sensor.noise, dtype=float), repeats)
        self._resolution = scale * np.repeat(np.array(sensor.resolution, dtype=float), repeats)
        self._generator = np.random.default_rng([seed, zlib.crc32(topic.name.encode())])
        self._noise = np.zeros((_DRAWN_AT_ONCE, self._width))
        self._drawn = 0
        self._samples: deque[tuple[int, int, Array]] = deque()
        self._faults = tuple(faults)
        self._past = Past() if any(fault.is_late for fault in faults) else None

    def observe(self, step: int, now_ns: int, values: Array) -> tuple[int, Array] | None:
        """Take a sample if one is due; return stamp [ns] and row of one that arrives, if any."""
        if self._past is not None:
            self._past.note(now_ns * 1e-9, values)
        if step % self._divider == 0:
            sample = self._sample(self._faulty(now_ns * 1e-9, values))
            self._samples.append((step + self._delay_steps, now_ns, sample))
        if self._samples and self._samples[0][0] <= step:
            _, stamp_ns, row = self._samples.popleft()
            return stamp_ns, row
        return None

    def _faulty(self, time: float, values: Array) -> Array:
        if self._past is not None:
            values = self._past.at(time - sum(fault.lateness(time) for fault in self._faults))
        for fault in self._faults:
            values = fault.reading(values)
        return values

    def _sample(self, values: Array) -> Array:
        index = self._drawn % _DRAWN_AT_ONCE
        if index == 0 and self._deviation.any():
            self._noise = self._generator.standard_normal((_DRAWN_AT_ONCE, self._width))
        self._drawn += 1
        measured = np.empty(self._width)
        corrupt(values, self._noise[index], self._deviation, self._resolution, measured)
        if not self._is_pose:
            return measured
        row = np.empty(7)
        pose_row(measured, row)
        return row
