"""The plant: the machine's state, stepped at a fixed period."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import DivergenceError, InputError
from cspm_msgs_py.testbed import Testbed
from cspm_sim.equilibrium import find_equilibrium, unstretched_lengths
from cspm_sim.kernels.cable import TORQUE_LIMIT
from cspm_sim.kernels.plant import (
    BAR_STATES,
    make_scratch,
    plant_advance,
    plant_tensions,
)
from cspm_sim.motion import Motion
from cspm_sim.parameters import plant_parameters

Array = NDArray[np.float64]


class Plant:
    """Bar, cables and winches on a moving winch frame.

    Time is a count of steps of `period_ns`; `step` advances it by one. Read-only views of the
    current state: `bar_state` (12: position, Euler angles, velocity in world axes, ω in bar axes),
    `unstretched_lengths`, `angles`, `speeds` (n each), `tensions` (n) and `frame` (18). `locked`
    may be set at any time: the brakes, which stop the motors at once.
    """

    def __init__(
        self,
        testbed: Testbed,
        frame_motion: Motion,
        period_ns: int,
        *,
        bar_pose: ArrayLike | None = None,
        tensions: ArrayLike | None = None,
        locked: bool = False,
    ) -> None:
        """Put the machine at rest in equilibrium.

        Args:
            testbed: the machine.
            frame_motion: the winch frame's motion; it stands still where the machine has none.
            period_ns: step [ns].
            bar_pose: where the bar hangs at the start, x y z φ θ ψ.
            tensions: what the cables carry at the start, (n,) [N], where there is no bar to hold;
                absent: nothing.
            locked: hold all motors still.

        Raises:
            InputError: the test-bed has a bar and no pose for it, or a cable of length zero.
            ConvergenceError: no tensions hold the bar at this pose.
        """
        self.testbed = testbed
        self.parameters = plant_parameters(testbed)
        self.period_ns = period_ns
        self.frame_motion = frame_motion
        self.steps = 0
        n = len(testbed.cables)
        first = BAR_STATES if testbed.bar else 0
        self.state: Array = np.zeros(first + 3 * n)
        self.bar_state = self.state[:first]
        self.unstretched_lengths = self.state[first : first + n]
        self.angles = self.state[first + n : first + 2 * n]
        self.speeds = self.state[first + 2 * n :]
        self.locked = locked
        self.frame: Array = frame_motion.at(0.0)
        self._outputs = np.zeros((2, n))
        self.tensions = self._outputs[0]
        self.lengths = self._outputs[1]
        self._frames = np.zeros((3, 18))
        self._scratch = make_scratch(len(self.state), n)
        self._place(bar_pose, tensions)
        self._observe()

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
        self._locked = value
        if value:
            self.speeds[:] = 0.0

    def step(self, torque: Array) -> None:
        """Advance by one period with the motor torques (n,) [N·m] held.

        Raises:
            InputError: another number of torques than cables.
            DivergenceError: a state is no longer finite, or the pitch passed ±π/2.
        """
        if torque.shape != self.speeds.shape:
            raise InputError(
                f"torque: shape {torque.shape}, allowed: {self.speeds.shape}, one per cable"
            )
        bad = plant_advance(
            self.state,
            torque,
            self.frame_motion.knots,
            self.frame_motion.spacing,
            self.frame_motion.periodic,
            self.steps,
            1,
            self._locked,
            self.period_ns * 1e-9,
            self.parameters,
            self._frames,
            self._scratch,
            self._outputs,
        )
        self.steps += 1
        self.frame[:] = self._frames[0]
        if bad >= 0:
            raise DivergenceError(f"t = {self.time:.3f} s: {self.state_name(bad)} is not finite")
        if self.testbed.bar and abs(self.bar_state[4]) > 0.5 * np.pi:
            raise DivergenceError(
                f"t = {self.time:.3f} s: pitch {self.bar_state[4]:.3f} rad passed ±π/2, where the"
                " Euler angles end"
            )

    def state_name(self, index: int) -> str:
        """Return the name of a state, such as `speed of surge_2`."""
        first = len(self.bar_state)
        if index < first:
            kind, dof = divmod(index, 6)
            return f"bar {DOFS[dof]}" + (" rate" if kind else "")
        kind, cable = divmod(index - first, len(self.testbed.cables))
        name = ("unstretched length", "motor angle", "motor speed")[kind]
        return f"{name} of {self.testbed.cable_names[cable]}"

    def applied_torque(self, torque: Array) -> Array:
        """Return what the drives deliver for a torque command, (n,) [N·m]: the limits applied."""
        limits = self.parameters.cables[:, TORQUE_LIMIT]
        return np.minimum(limits, np.maximum(-limits, torque))

    def _observe(self) -> None:
        plant_tensions(self.state, self.frame, self.parameters, self._scratch, self._outputs)

    def _place(self, bar_pose: ArrayLike | None, tensions: ArrayLike | None) -> None:
        if self.testbed.bar is None:
            # The lengths are needed first; any positive unstretched length serves for them.
            self.unstretched_lengths[:] = 1.0
            self._observe()
            carried = np.zeros(len(self.lengths)) if tensions is None else np.asarray(tensions)
            self.unstretched_lengths[:] = unstretched_lengths(
                self.parameters, self.lengths.copy(), carried
            )
            return
        if bar_pose is None:
            raise InputError("plant: this test-bed has a bar, a pose to start from is required")
        limits = np.array([cable.tension_limits for cable in self.testbed.cables], dtype=float)
        rest = find_equilibrium(self.parameters, bar_pose, self.frame[:6], limits)
        self.bar_state[:6] = rest.bar_pose
        self.unstretched_lengths[:] = rest.unstretched_lengths
