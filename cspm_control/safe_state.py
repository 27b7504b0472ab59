"""Torques that keep a suspended bar where it is when nobody controls it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_model.equilibrium import find_equilibrium
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import ConvergenceError, InputError
from cspm_msgs_py.scenario import Scenario
from cspm_msgs_py.stepping.safe_state import SafeState, Winches
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]

# Far below the cables' own frequencies and far above the sea's.
FREQUENCY = 10.0  # rad/s


class Brake:
    """All brakes set, no torque."""

    name = "brake"
    brake = True

    def __init__(self, winches: int) -> None:
        self._zero = np.zeros(winches)

    def begin(self, tensions: Array | None) -> None:
        """Enter the state; nothing about it depends on the tensions."""

    def torque(self, now_ns: int, winches: Winches | None) -> Array:
        """Return no torque, (n,) [N·m]."""
        return self._zero.copy()


class Hold:
    """Each winch holds where it was: balancing torque, and a spring and damper about its angle.

    τ = r·(t_start + (t_balance − t_start)·share) − k·(q − q_start) − d·q̇, within the torques of the
    cable's tension limits. k and d are those of a mass (the bar's share and the rotor, at the
    cable) on a critically damped spring of `FREQUENCY`. The balancing torque alone leaves the bar
    with the speed that it had, and lets it drift away by metres.

    Where the winches' state is unknown the balancing torque is all there is, and the brakes are set
    as well, for good.
    """

    name = "hold"

    def __init__(self, testbed: Testbed, balance: Array, ramp_time: float) -> None:
        """Make the state.

        Args:
            testbed: the machine.
            balance: tensions that carry the bar, (n,) [N].
            ramp_time: from the tensions measured last to these [s].
        """
        cables = testbed.cables
        self._radii = np.array([cable.wound_radius for cable in cables])
        limits = np.array([cable.torque_limit for cable in cables])
        self._lowest, self._highest = -limits, limits
        share = 0.0
        if testbed.bar:
            tensions = np.array([cable.tension_limits for cable in cables], dtype=float)
            # Never slack, and never beyond what a cable may carry.
            self._lowest, self._highest = np.minimum(limits, self._radii * tensions.T)
            share = testbed.bar.mass / len(cables)
        # At the motor shaft: mass·r² plus the rotor's own inertia.
        inertia = share * self._radii**2 + np.array([cable.rotor_inertia for cable in cables])
        self._stiffness = inertia * FREQUENCY**2
        self._damping = 2.0 * inertia * FREQUENCY
        self._balance = self._radii * balance
        self._ramp_ns = ramp_time * 1e9
        self.begin(None)

    @property
    def brake(self) -> bool:
        """Whether a winch state was missing since the state was entered."""
        return self._blind

    def begin(self, tensions: Array | None) -> None:
        """Enter the state, from the tensions (n,) [N] measured last where they are known."""
        start = self._balance if tensions is None else self._radii * tensions
        self._start = np.clip(start, self._lowest, self._highest)
        self._elapsed = 0
        self._last_ns: int | None = None
        self._angles: Array | None = None
        self._blind = False

    def torque(self, now_ns: int, winches: Winches | None) -> Array:
        """Return the motor torques (n,) [N·m] at `now_ns`."""
        # A clock that was set back must not take the ramp back with it.
        self._elapsed += max(0, now_ns - (now_ns if self._last_ns is None else self._last_ns))
        self._last_ns = now_ns
        share = min(1.0, self._elapsed / self._ramp_ns) if self._ramp_ns else 1.0
        torque = self._start + (self._balance - self._start) * share
        if winches is None:
            self._blind = True
        else:
            if self._angles is None:
                self._angles = winches.angles.copy()
            torque -= self._stiffness * (winches.angles - self._angles)
            torque -= self._damping * winches.speeds
        return np.clip(torque, self._lowest, self._highest)


def make_safe_state(scenario: Scenario, testbed: Testbed) -> SafeState:
    """Return the scenario's safe state on a machine.

    Raises:
        InputError: it is to hold the bar where the bar cannot hang.
    """
    safety = scenario.safety
    if safety.state == "brake":
        return Brake(len(testbed.cables))
    return Hold(testbed, balancing_tensions(scenario, testbed), safety.ramp_time)


def balancing_tensions(scenario: Scenario, testbed: Testbed) -> Array:
    """Return tensions (n,) [N] that carry the bar at its mean pose; zeros where there is no bar.

    Raises:
        InputError: none within the tension limits do.
    """
    if testbed.bar is None:
        return np.zeros(len(testbed.cables))
    limits = np.array([cable.tension_limits for cable in testbed.cables], dtype=float)
    bar, frame = scenario.bar_mean_pose, scenario.winch_frame.mean_pose
    try:
        return find_equilibrium(nominal_parameters(testbed), bar, frame, limits).tensions
    except ConvergenceError as err:
        raise InputError(
            f"safety.state: hold at the bar's mean pose, {err}, allowed: brake, or a mean pose at"
            " which the bar can hang"
        ) from None
