"""What effects do to sensors: readings that are changed or older than their stamps say."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.schedule import WINCH_STATE
from cspm_msgs_py.sensor_spec import JOINT_QUANTITIES
from cspm_msgs_py.testbed import Testbed
from cspm_sim.effect_entries import Action, read_actions
from cspm_sim.effects import Elements

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SensorFault:
    """One effect on one element of a sensor."""

    action: Action

    @property
    def is_late(self) -> bool:
        """Whether readings can be older than their stamps say."""
        sense = self.action.effect.physics.sense
        return sense is not None and sense.lateness is not None

    def read(self, width: int) -> slice:
        """Return the columns of the sensor's `width` quantities that it acts on."""
        effect, i = self.action.effect, self.action.element
        if effect.physics.sense and effect.physics.sense.quantity:
            # Angles, speeds and torques, each of all winches.
            i += width - width // len(JOINT_QUANTITIES[WINCH_STATE])
        elif effect.acts_on is not Elements.CELLS or self.action.name == Elements.CELLS.value:
            return slice(None)
        return slice(i, i + 1)

    def lateness(self, time: float) -> float:
        """Return by how much a reading stamped `time` [s] is older than that [s]."""
        sense = self.action.effect.physics.sense
        if sense is None or sense.lateness is None:
            return 0.0
        return sense.lateness(time, self._parameters)

    @property
    def time_constant(self) -> float:
        """Of the low pass that the quantities in `read` pass [s]; 0: of none."""
        sense = self.action.effect.physics.sense
        if sense is None or sense.time_constant is None:
            return 0.0
        return sense.time_constant(self._parameters)

    def reading(self, time: float, true: Array, values: Array) -> Array:
        """Return the quantities as the faulty sensor takes them in.

        Args:
            time: since the run's start [s].
            true: the quantities.
            values: as faults before this one have them.
        """
        sense, element = self.action.effect.physics.sense, self.action.element
        if sense is not None and sense.reading is not None:
            values = sense.reading(values, element, self._parameters)
        if sense is not None and sense.added is not None:
            values = values.copy()
            values[element] += sense.added(time, true, element, self._parameters)
        return values

    @property
    def _parameters(self) -> Array:
        return np.array(list(self.action.values.values()))


class Past:
    """The latest history of a sensor's quantities, as far as it is still needed.

    Between instants it is a straight line, before the first it stands still.
    """

    def __init__(self) -> None:
        """Begin without history."""
        self._rows: deque[tuple[float, Array]] = deque()

    def note(self, time: float, values: Array) -> None:
        """Add the present, later than all before."""
        self._rows.append((time, values.copy()))

    def at(self, times: Array) -> Array:
        """Return each quantity at a time of its own [s], none earlier than any before."""
        rows, least = self._rows, times.min()
        while len(rows) > 1 and rows[1][0] <= least:
            rows.popleft()
        noted, values = (np.array(each) for each in zip(*rows, strict=True))
        columns = zip(times, values.T, strict=True)
        return np.array([np.interp(time, noted, own) for time, own in columns])


class LowPass:
    """A low pass of first order, exact where its input is straight between instants.

    It begins at rest.
    """

    def __init__(self, fault: SensorFault) -> None:
        """Take the fault, whose time constant is above 0."""
        self._fault, self._time_constant = fault, fault.time_constant
        self._before: tuple[float, Array, Array] | None = None

    def passed(self, time: float, values: Array) -> Array:
        """Return the quantities of the present [s], later than all before, as they pass."""
        out, read = values.copy(), self._fault.read(len(values))
        if self._before is not None:
            then, given, lagging = self._before
            step, slow = time - then, self._time_constant
            behind = slow * (values - given)[read] / step
            kept = np.exp(-step / slow)
            rest = lagging - given[read] + behind
            out[read] = values[read] - behind + rest * kept
        self._before = time, values.copy(), out[read].copy()
        return out


def sensor_faults(testbed: Testbed, topic: str) -> list[SensorFault]:
    """Return what a test-bed's effects do to the sensor of a topic.

    Raises:
        InputError: an effect, one of its elements or parameters is unknown or out of bounds, or
            readings would have to be newer than the present.
    """
    faults = []
    for action in read_actions(testbed):
        sense = action.effect.physics.sense
        if sense and topic in (name.format(action.name) for name in sense.topics):
            faults.append(SensorFault(action))
            if faults[-1].lateness(1.0) < 0.0:
                raise InputError(
                    f"{action.where}: readings newer than their stamps cannot be simulated, allowed"
                    " in a simulation: no number below 0"
                )
    return faults
