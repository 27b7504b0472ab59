"""A unit of FMI 2 in a plant's place, with the face of `cspm_sim`'s plant."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_model.kernels.rotation import euler_rate_to_world_rate, rotate_back, rotation_from_euler
from cspm_msgs_py.errors import DivergenceError, InputError
from cspm_sim.fmu.unit import Places, Unit
from cspm_sim.fmu.unit_file import UnitFile
from cspm_sim.fmu.variables import (
    ANGLE,
    BRAKE,
    COMMAND,
    FRAME,
    LENGTH,
    POSE,
    SPEED,
    TENSION,
    TORQUE,
    TWIST,
    names_of,
)
from cspm_sim.plant import Plant, past_vertical

Array = NDArray[np.float64]

# Between a winch frame of the unit's own and the scenario's [m, rad].
FRAME_TOLERANCE = 1e-6


class FmuPlant:
    """A machine whose equations are somebody else's: a unit for co-simulation.

    The winch frame moves as the scenario has it. What the unit does not tell is derived: speeds
    from differences over a step, reported torques from the limits, cable on the drum from angles.

    The attributes are those of `cspm_sim.plant.Plant`.
    """

    def __init__(self, file: UnitFile, rest: Plant) -> None:
        """Load the unit, and let it begin.

        Args:
            file: the unit, and its names.
            rest: this machine at rest at the start, whose motors the unit holds until the first
                step.

        Raises:
            InputError: the unit does not load, lacks a variable, or is to brake and cannot.
        """
        self.testbed, self.period_ns = rest.testbed, rest.period_ns
        self.steps = 0
        self.cut: tuple[str, ...] = ()
        self._motion = rest.frame_motion
        self._unit = Unit(file)
        self.bar_state, self.frame = rest.bar_state.copy(), rest.frame.copy()
        self.angles, self.speeds = rest.angles.copy(), rest.speeds.copy()
        self.tensions = rest.tensions.copy()
        self.unstretched_lengths = rest.unstretched_lengths.copy()
        cables = self.testbed.cables
        self._wound = np.array([cable.wound_radius for cable in cables])
        self._limits = np.array([cable.torque_limit for cable in cables])
        self._find_places()
        self._locked = False
        self._give(self._wound * self.tensions)
        self._unit.begin()
        self.locked = rest.locked
        self._first_lengths = self.unstretched_lengths.copy()
        self._first_angles = self._unit.read(self._angle)
        self._observe(0.0)

    def _find_places(self) -> None:
        """Look up the plant's variables in the unit.

        Raises:
            InputError: it lacks one that cannot be derived.
        """
        self._command, self._angle = self._needed(COMMAND), self._needed(ANGLE)
        self._tension = self._needed(TENSION)
        self._pose = self._needed(POSE) if self.testbed.bar else None
        self._twist, self._speed = self._found(TWIST), self._found(SPEED)
        self._torque, self._length = self._found(TORQUE), self._found(LENGTH)
        self._frame = self._found(FRAME) if self.testbed.winch_frame else None
        self._brake = self._unit.places([BRAKE])

    def _found(self, quantity: str) -> Places | None:
        return self._unit.places(names_of(quantity, self.testbed))

    def _needed(self, quantity: str) -> Places:
        found = self._found(quantity)
        if found is None:
            absent = self._unit.absent(names_of(quantity, self.testbed))
            raise InputError(f"plant {self._unit.path}: {absent}")
        return found

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        return self.steps * self.period_ns * 1e-9

    @property
    def locked(self) -> bool:
        """Whether all motors are held still."""
        return self._locked

    @locked.setter
    def locked(self, value: bool) -> None:
        if value == self._locked:
            return
        if self._brake is None:
            raise InputError(
                f"plant {self._unit.path}: {self._unit.absent([BRAKE])}, so it cannot brake"
            )
        self._unit.switch(self._brake, value)
        self._locked = value
        if value:
            self.speeds[:] = 0.0

    def step(self, torque: Array) -> None:
        """Advance by one period with the motor torques (n,) [N·m] held.

        Raises:
            InputError: another number of torques than cables, or a winch frame that moves otherwise
                than the scenario's.
            DivergenceError: the unit gives up, a state is no longer finite, or the pitch passed
                ±π/2.
        """
        if torque.shape != self.speeds.shape:
            raise InputError(
                f"torque: shape {torque.shape}, allowed: {self.speeds.shape}, one per cable"
            )
        self._give(torque)
        period = self.period_ns * 1e-9
        self._unit.step(self.time, period)
        self.steps += 1
        self.frame[:] = self._motion.at(self.time)
        self._observe(period)
        self._check()

    def applied_torque(self, torque: Array) -> Array:
        """Return what the drives deliver at this instant for a torque command, (n,) [N·m]."""
        if self._torque is None:
            return np.asarray(np.clip(torque, -self._limits, self._limits))
        self._give(torque)
        return self._unit.read(self._torque)

    def part(self, cable: str) -> None:
        """Refuse to cut a cable.

        Raises:
            InputError: always.
        """
        raise InputError(f"{cable}: this plant cannot cut a cable, allowed: plant sim")

    def _give(self, torque: Array) -> None:
        self._unit.write(self._command, torque)

    def _observe(self, period: float) -> None:
        """Bring the state to the unit's outputs, `period` [s] after the last."""
        unit = self._unit
        angles = unit.read(self._angle) - self._first_angles
        if self._speed is not None:
            self.speeds[:] = unit.read(self._speed)
        elif period:
            self.speeds[:] = (angles - self.angles) / period
        self.angles[:] = angles
        self.tensions[:] = unit.read(self._tension)
        if self._length is None:
            self.unstretched_lengths[:] = self._first_lengths - self._wound * angles
        else:
            self.unstretched_lengths[:] = unit.read(self._length)
        if self._pose is not None:
            self._observe_bar(unit.read(self._pose), period)

    def _observe_bar(self, pose: Array, period: float) -> None:
        """Bring the bar's state to a pose (6,), and to the twist that goes with it."""
        state = self.bar_state
        if self._twist is not None:
            twist = self._unit.read(self._twist)
        elif period:
            rates = (pose - state[:6]) / period
            turn = euler_rate_to_world_rate(pose[4], pose[5], rates[3], rates[4], rates[5])
            twist = np.array([*rates[:3], *turn])
        else:
            twist = np.zeros(6)
        state[:6], state[6:9] = pose, twist[:3]
        rotation = rotation_from_euler(pose[3], pose[4], pose[5])
        state[9:12] = rotate_back(rotation, twist[3], twist[4], twist[5])

    def _check(self) -> None:
        read = (self.bar_state, self.angles, self.speeds, self.tensions)
        if not all(np.isfinite(each).all() for each in read):
            raise DivergenceError(f"t = {self.time:.3f} s: {self._unit.path.name} is not finite")
        if self.testbed.bar and abs(self.bar_state[4]) > 0.5 * np.pi:
            raise past_vertical(self.time, self.bar_state[4])
        if self._frame is None:
            return
        apart = np.abs(self._unit.read(self._frame) - self.frame[:6]).max()
        if apart > FRAME_TOLERANCE:
            raise InputError(
                f"plant {self._unit.path}: its winch frame is {apart:.3g} m or rad from the"
                f" scenario's at {self.time:.3f} s, allowed: the scenario that it was made of, and"
                " its seed"
            )
