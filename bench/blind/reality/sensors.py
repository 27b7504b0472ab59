"""Sensors with coloured noise, steps of resolution, jitter, dropouts and clocks of their own."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping, Sequence
from statistics import NormalDist
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from cspm_msgs_py.sensor_spec import Sensor, quantities
from cspm_msgs_py.topics import Topic

Array = NDArray[np.float64]
# From true values and time [s] to what the sensor takes in.
Fault = Callable[[Array, float], Array]

COLOUR_TIME = 0.02  # [s]
_DRAWN_AT_ONCE = 1000


class Quality(NamedTuple):
    """What a sensor does beside noise and resolution.

    Attributes:
        coloured_share: of the noise's power.
        dropout: share of readings that are lost.
        jitter: of the stamps, one standard deviation [s].
        clock_offset: between sensors, one standard deviation [s].
        clock_drift: of each clock, one standard deviation.
    """

    coloured_share: float
    dropout: float
    jitter: float
    clock_offset: float
    clock_drift: float


REAL, PLAIN = "real", "plain"
# `PLAIN` shows by comparison what the sensors themselves cost a diagnosis.
QUALITIES: Mapping[str, Quality] = {
    REAL: Quality(0.3, 2e-4, 1e-5, 5e-5, 2e-6),
    PLAIN: Quality(0.0, 0.0, 0.0, 0.0, 0.0),
}


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
        quality: Quality = QUALITIES[REAL],
        faults: Sequence[Fault] = (),
        skew: float = 0.0,
    ) -> None:
        """Make the sensor of `topic` at `rate` [Hz] on a plant of period `period_ns` [ns].

        Its clock runs faster than time by `skew`, beside the drift that any clock has.
        """
        self._divider = round(1e9 / period_ns) // rate
        self._is_pose = topic.ros_type.endswith("PoseStamped")
        width = 6 if self._is_pose else topic.width
        repeats = width // len(quantities(topic))
        self._deviation = np.repeat(np.array(sensor.noise, dtype=float), repeats)
        step = np.repeat(np.array(sensor.resolution, dtype=float), repeats)
        self._coarse = np.flatnonzero(step)
        self._step = step[self._coarse]
        self._kept = float(np.exp(-1.0 / (rate * COLOUR_TIME)))
        self._memory = np.zeros((1, width))
        self._faults = tuple(faults)
        self._generator = np.random.default_rng([seed, zlib.crc32(topic.name.encode()), 1])
        self._quality = quality
        self._lost = NormalDist().inv_cdf(1.0 - quality.dropout) if quality.dropout else np.inf
        self._offset = float(self._generator.normal(0.0, quality.clock_offset))
        self._drift = skew + float(self._generator.normal(0.0, quality.clock_drift))
        self._taken = 0
        self._noise: Array = np.zeros((0, width))
        self._late: list[float] = []
        self._drops: list[bool] = []

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
            self._draw()
        self._taken += 1
        # The first reading is what controllers begin from.
        if step and self._drops[index]:
            return None
        reading = values + self._noise[index]
        reading[self._coarse] = self._step * np.round(reading[self._coarse] / self._step)
        late = self._offset + self._drift * time + self._late[index]
        return now_ns + round(late * 1e9) * (step > 0), self._row(reading)

    def _draw(self) -> None:
        """Draw noise, lateness and losses of the next readings."""
        width = len(self._deviation)
        drawn = self._generator.standard_normal((_DRAWN_AT_ONCE, 2 * width + 2))
        fresh, kept = np.sqrt(1.0 - self._kept**2), self._kept
        colour, self._memory = lfilter(
            [fresh], [1.0, -kept], drawn[:, width : 2 * width], axis=0, zi=self._memory
        )
        share = self._quality.coloured_share
        noise = np.sqrt(1.0 - share) * drawn[:, :width] + np.sqrt(share) * colour
        self._noise = self._deviation * noise
        self._late = (self._quality.jitter * np.clip(drawn[:, -2], -3.0, 3.0)).tolist()
        self._drops = (drawn[:, -1] > self._lost).tolist()

    def _row(self, reading: Array) -> Array:
        if not self._is_pose:
            return reading
        quaternion = np.zeros(4)
        mujoco.mju_euler2Quat(quaternion, reading[5:2:-1].copy(), "zyx")
        return np.concatenate([reading[:3], quaternion[1:], quaternion[:1]])
