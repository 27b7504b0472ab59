"""Sensors with coloured noise, steps of resolution, jitter, dropouts and clocks of their own."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Sequence
from statistics import NormalDist

import mujoco
import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.sensor_spec import Sensor, quantities
from cspm_msgs_py.topics import Topic

Array = NDArray[np.float64]
# From true values and time [s] to what the sensor takes in.
Fault = Callable[[Array, float], Array]

COLOURED_SHARE = 0.3  # of the noise's power
COLOUR_TIME = 0.02  # [s]
DROPOUT = 2e-4  # share of readings that are lost
JITTER = 1e-5  # of the stamps [s]
CLOCK_OFFSET = 5e-5  # between sensors, one standard deviation [s]
CLOCK_DRIFT = 2e-6
_DRAWN_AT_ONCE = 1000
_LOST = NormalDist().inv_cdf(1.0 - DROPOUT)


class RealSensor:
    """One sensor of a machine, with the face of the simulator's.

    The test-bed's noise is that of one reading. Part of it is coloured: white noise through a
    low-pass of first order. Its clock runs beside the machine's, and now and then a reading is
    lost.
    """

    def __init__(
        self,
        topic: Topic,
        sensor: Sensor,
        *,
        rate: int,
        period_ns: int,
        seed: int,
        faults: Sequence[Fault] = (),
    ) -> None:
        """Make the sensor of `topic` at `rate` [Hz] on a plant of period `period_ns` [ns]."""
        self._divider = round(1e9 / period_ns) // rate
        self._is_pose = topic.ros_type.endswith("PoseStamped")
        width = 6 if self._is_pose else topic.width
        repeats = width // len(quantities(topic))
        self._deviation = np.repeat(np.array(sensor.noise, dtype=float), repeats)
        self._step = np.repeat(np.array(sensor.resolution, dtype=float), repeats)
        self._kept = float(np.exp(-1.0 / (rate * COLOUR_TIME)))
        self._colour = np.zeros(width)
        self._faults = tuple(faults)
        self._generator = np.random.default_rng([seed, zlib.crc32(topic.name.encode()), 1])
        self._offset = float(self._generator.normal(0.0, CLOCK_OFFSET))
        self._drift = float(self._generator.normal(0.0, CLOCK_DRIFT))
        self._taken = 0
        self._noise: Array = np.zeros((0, 2 * width + 2))

    def observe(self, step: int, now_ns: int, values: Array) -> tuple[int, Array] | None:
        """Take a reading if one is due; return its stamp [ns] and row, None if it was lost."""
        time = now_ns * 1e-9
        # At every step, since a fault may remember.
        for fault in self._faults:
            values = fault(values, time)
        if step % self._divider:
            return None
        index = self._taken % _DRAWN_AT_ONCE
        if index == 0:
            self._noise = self._generator.standard_normal((_DRAWN_AT_ONCE, 2 * len(values) + 2))
        self._taken += 1
        drawn = self._noise[index]
        reading = self._noisy(values, drawn)
        # The first reading is what controllers begin from.
        if step and drawn[-1] > _LOST:
            return None
        late = self._offset + self._drift * time + JITTER * float(np.clip(drawn[-2], -3.0, 3.0))
        return now_ns + round(late * 1e9) * (step > 0), self._row(reading)

    def _noisy(self, values: Array, drawn: Array) -> Array:
        width = len(values)
        fresh = np.sqrt(1.0 - self._kept**2) * drawn[width : 2 * width]
        self._colour = self._kept * self._colour + fresh
        white = np.sqrt(1.0 - COLOURED_SHARE) * drawn[:width]
        noise = white + np.sqrt(COLOURED_SHARE) * self._colour
        reading: Array = values + self._deviation * noise
        coarse = self._step > 0.0
        reading[coarse] = self._step[coarse] * np.round(reading[coarse] / self._step[coarse])
        return reading

    def _row(self, reading: Array) -> Array:
        if not self._is_pose:
            return reading
        quaternion = np.zeros(4)
        mujoco.mju_euler2Quat(quaternion, reading[5:2:-1].copy(), "zyx")
        return np.concatenate([reading[:3], quaternion[1:], quaternion[:1]])
