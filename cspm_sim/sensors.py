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
from cspm_sim.sensor_fault import LowPass, Past, SensorFault

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

    Attributes:
        divider: steps from one sample to the next.
        delay_steps: steps from sample to arrival.
        is_pose: whether it measures a pose.
        width: how many numbers it measures.
        deviation: of the noise of each, (width,).
        resolution: of each, (width,); 0 for any value.
        noise: standard normal numbers, a row per sample.
        drawn: samples taken so far; sample i has row i modulo the rows of the noise drawn for it.
        underway: samples that have not arrived: step of arrival, stamp [ns] and row.
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
        self.delay_steps = round(delay * 1e9 / period_ns)
        if abs(self.delay_steps * period_ns - delay * 1e9) > 1.0:
            raise InputError(
                f"sensors.{topic.name}.delay: {delay:g} s, allowed: a multiple of the plant's"
                f" period of {period_ns * 1e-9:g} s"
            )
        self.divider = round(1e9 / period_ns) // rate
        self.is_pose = topic.ros_type.endswith("PoseStamped")
        self.width = 6 if self.is_pose else topic.width
        repeats = self.width // len(quantities(topic))
        scale = 0.0 if ideal else 1.0
        self.deviation = scale * np.repeat(np.array(sensor.noise, dtype=float), repeats)
        self.resolution = scale * np.repeat(np.array(sensor.resolution, dtype=float), repeats)
        self._generator = np.random.default_rng([seed, zlib.crc32(topic.name.encode())])
        self.noise = np.zeros((_DRAWN_AT_ONCE, self.width))
        self.drawn = 0
        self.underway: deque[tuple[int, int, Array]] = deque()
        self._faults = tuple(faults)
        self._low_passes = [LowPass(fault) for fault in faults if fault.time_constant > 0.0]
        self._past = Past() if any(fault.is_late for fault in faults) else None

    def observe(self, step: int, now_ns: int, values: Array) -> tuple[int, Array] | None:
        """Take a sample if one is due; return stamp [ns] and row of one that arrives, if any."""
        for low_pass in self._low_passes:
            values = low_pass.passed(now_ns * 1e-9, values)
        if self._past is not None:
            self._past.note(now_ns * 1e-9, values)
        if step % self.divider == 0:
            sample = self._sample(self._faulty(now_ns * 1e-9, values))
            self.underway.append((step + self.delay_steps, now_ns, sample))
        if self.underway and self.underway[0][0] <= step:
            _, stamp_ns, row = self.underway.popleft()
            return stamp_ns, row
        return None

    @property
    def is_faulty(self) -> bool:
        """Whether an effect changes its readings."""
        return bool(self._faults)

    def draw(self) -> Array:
        """Return the next standard normal numbers, a row per sample; zeros where noise is none."""
        if not self.deviation.any():
            return self.noise
        return self._generator.standard_normal((_DRAWN_AT_ONCE, self.width))

    def _faulty(self, time: float, values: Array) -> Array:
        if self._past is not None:
            times = np.full(len(values), time)
            for fault in self._faults:
                times[fault.read(len(values))] -= fault.lateness(time)
            values = self._past.at(times)
        read = values
        for fault in self._faults:
            read = fault.reading(time, values, read)
        return read

    def _sample(self, values: Array) -> Array:
        index = self.drawn % _DRAWN_AT_ONCE
        if index == 0:
            self.noise = self.draw()
        self.drawn += 1
        measured = np.empty(self.width)
        corrupt(values, self.noise[index], self.deviation, self.resolution, measured)
        if not self.is_pose:
            return measured
        row = np.empty(7)
        pose_row(measured, row)
        return row
