"""A simulated sensor as two compiled phases: a sample is taken, and one arrives."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_model.phase import make_phase
from cspm_sim.kernels.phases import (
    COLUMN,
    IS_POSE,
    NOISE,
    SENSOR_INTEGERS,
    arrival_phase,
    sample_phase,
)
from cspm_sim.sensors import SensorModel

Array = NDArray[np.float64]


class SensorPhases:
    """What a sensor does from a step on, in its place.

    Attributes:
        sample: takes a sample.
        arrival: brings one into the row, `delay` steps later.
        divider: steps from one sample to the next.
        delay: steps from sample to arrival.
    """

    def __init__(self, sensor: SensorModel, values: Array, column: int) -> None:
        """Go on where the sensor is.

        Args:
            sensor: without faults.
            values: what it measures, which changes in place.
            column: first one of its messages in the row.
        """
        self._sensor = sensor
        self.divider, self.delay = sensor.divider, sensor.delay_steps
        samples = [sample for _, _, sample in sensor.underway]
        width = 7 if sensor.is_pose else len(values)
        underway = np.zeros((len(samples) + 1 + self.delay // self.divider, width))
        underway[: len(samples)] = np.array(samples).reshape(len(samples), width)
        self._integers = np.zeros(SENSOR_INTEGERS, dtype=np.int64)
        self._integers[IS_POSE], self._integers[COLUMN] = sensor.is_pose, column
        # Samples taken, and arrived.
        counts = np.array([len(samples), 0], dtype=np.int64)
        self._noise = np.zeros_like(sensor.noise)
        self._integers[NOISE] = len(self._noise)
        if sensor.drawn % len(self._noise):
            self._noise[:] = sensor.noise
            self._integers[NOISE] = sensor.drawn % len(self._noise)
        shared = self._integers, counts
        self.sample = make_phase(
            sample_phase,
            *shared,
            values,
            self._noise,
            sensor.deviation,
            sensor.resolution,
            underway,
            np.zeros(sensor.width),
            room=self._room,
        )
        self.arrival = make_phase(arrival_phase, *shared, *6 * (underway,))

    def _room(self, step: int) -> int:
        """Draw noise where none is left; return the step from which on it is needed again."""
        left = len(self._noise) - int(self._integers[NOISE])
        next_sample = -(-step // self.divider) * self.divider
        if left == 0:
            self._noise[:] = self._sensor.draw()
            self._integers[NOISE], left = 0, len(self._noise)
        return next_sample + left * self.divider
