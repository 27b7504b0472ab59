"""A small wiggle of one winch after the other, both ways, while the others hold where they are."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_control.safe_state import Hold
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.stepping.safe_state import Winches
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]

TRAVEL = 0.001  # m of cable, each way
FARTHEST = 0.008  # m that any winch may turn by
# At first all winches only hold [s], and hardly turn [m]: a torque of the wrong sign shows there.
HOLD_S, STILL = 0.2, 0.003
RAMP_S, SETTLE_S, MEASURE_S = 0.8, 0.1, 0.1
FEWEST_ROWS = 3  # of each topic on a plateau
SLOW = 0.005  # m/s, beyond which no more force is given
LONGEST_STEP_S = 0.02
# Shares of what is left to the upper tension limit, and of the tension that there is.
MORE_SHARE, LESS_SHARE = 0.3, 0.5
LEAST_FORCE = 1.0  # N at the cable, which a winch without one may be given as well
WAYS = (1.0, -1.0)


class Plateau(NamedTuple):
    """One winch held a little wound in or paid out.

    Attributes:
        winch: which was wiggled, by its number.
        way: 1: wound in, −1: paid out.
    """

    winch: int
    way: float


class WinchWiggle:
    """Gives the torques of the wiggle, and says when what it shows is to be measured.

    Each winch keeps the tension that it had, with spring and damper of the safe state `hold` about
    its angle. The force of the one that is wiggled grows until it has turned by `TRAVEL` of cable,
    or by as much as its tension may change.

    Attributes:
        measuring: the plateau that is being held, None in between.
        done: whether all winches were wiggled.
    """

    def __init__(self, testbed: Testbed, tensions: Array, slowest_hz: float) -> None:
        """Take what is wiggled.

        Args:
            testbed: the machine.
            tensions: what its drives hold now, (n,) [N].
            slowest_hz: the rate of its slowest sensor [Hz].
        """
        self._measure_s = max(MEASURE_S, (FEWEST_ROWS + 1) / slowest_hz)
        cables = testbed.cables
        self._names = testbed.cable_names
        self._hold = Hold(testbed, tensions, 0.0)
        self._hold.begin(tensions)
        self._radii = np.array([cable.wound_radius for cable in cables])
        self._most = np.array([cable.torque_limit for cable in cables])
        highest = np.array([c.tension_limits[1] if c.tension_limits else 0.0 for c in cables])
        more, less = MORE_SHARE * (highest - tensions), LESS_SHARE * tensions
        self._bounds = np.maximum(LEAST_FORCE, [more, less])
        self._before: Array | None = None
        self._first_ns, self._last_ns, self._arrived_ns = 0, 0, -1
        self._winch, self._way, self._force, self._measured = 0, 0, 0.0, 0
        self.measuring: Plateau | None = None

    @property
    def done(self) -> bool:
        """Whether all winches were wiggled, and the last is back."""
        return self._winch >= len(self._names)

    def torque(self, now_ns: int, winches: Winches) -> Array:
        """Return the motor torques (n,) [N·m] at an instant [ns].

        Raises:
            InputError: a winch turned farther than any may.
        """
        torque = self._hold.torque(now_ns, winches)
        if self._before is None:
            self._before = winches.angles.copy()
            self._first_ns = self._last_ns = now_ns
        holding = now_ns - self._first_ns < HOLD_S * 1e9
        turned = self._radii * (winches.angles - self._before)
        self._check(turned, STILL if holding else FARTHEST)
        passed = min(LONGEST_STEP_S, (now_ns - self._last_ns) * 1e-9)
        self._last_ns = now_ns
        if not (self.done or holding):
            speed = float(self._radii[self._winch] * winches.speeds[self._winch])
            self._advance(now_ns, passed, float(turned[self._winch]), speed)
        if not self.done:
            torque[self._winch] += self._radii[self._winch] * self._force
        limited: Array = np.clip(torque, -self._most, self._most)
        return limited

    def _advance(self, now_ns: int, passed: float, turned: float, speed: float) -> None:
        """Let the force of the winch that is wiggled go on by so many seconds."""
        if self._way == len(WAYS):
            self._go_back(passed)
            return
        way, bound = WAYS[self._way], self._bounds[self._way, self._winch]
        if self._arrived_ns < 0:
            if way * speed < SLOW:
                self._force += way * passed * self._bounds[:, self._winch].max() / RAMP_S
            if way * turned >= TRAVEL or way * self._force >= bound:
                self._arrived_ns = now_ns
            return
        held = (now_ns - self._arrived_ns) * 1e-9
        self.measuring = Plateau(self._winch, way) if held >= SETTLE_S else None
        self._measured += self.measuring is not None
        if held >= SETTLE_S + self._measure_s and self._measured > FEWEST_ROWS:
            self.measuring, self._arrived_ns, self._measured = None, -1, 0
            self._way += 1

    def _go_back(self, passed: float) -> None:
        step = passed * self._bounds[:, self._winch].max() / RAMP_S
        self._force -= float(np.clip(self._force, -step, step))
        if self._force == 0.0:
            self._winch, self._way = self._winch + 1, 0

    def _check(self, turned: Array, allowed: float) -> None:
        far = int(np.argmax(np.abs(turned)))
        if abs(turned[far]) <= allowed:
            return
        verb = "wound in" if turned[far] > 0.0 else "paid out"
        cause = "while all winches were to hold"
        if not self.done and self._force:
            cause = f"while {self._names[self._winch]} was given {self._force:+.2g} N"
        raise InputError(
            f"drivers: wiggle: {self._names[far]} {verb} {1e3 * abs(turned[far]):.1f} mm {cause},"
            f" allowed: {1e3 * allowed:g} mm; is a sign inverted, or the torque in another unit?"
        )
