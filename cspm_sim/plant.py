"""The plant: the machine's state, stepped at a fixed period."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cspm_model.equilibrium import (
    Equilibrium,
    find_equilibrium,
    gravity_wrench,
    unstretched_lengths,
)
from cspm_model.kernels.cable import DIRECTION, HAS_CABLE, TORQUE_LIMIT
from cspm_model.kernels.machine import BAR_STATES
from cspm_model.kernels.native import address_of
from cspm_model.motion import Motion
from cspm_model.phase import Phase, make_phase
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import DivergenceError, InputError
from cspm_msgs_py.testbed import Testbed
from cspm_sim.effect_entries import read_actions
from cspm_sim.effects import Hook
from cspm_sim.kernels.affected_cables import reported_torques
from cspm_sim.kernels.hooks import HOOK
from cspm_sim.kernels.phases import (
    ADDRESS,
    ADVANCE,
    ADVANCE_INTEGERS,
    BAD,
    LOCKED,
    NEXT_CUT,
    PERIODIC,
    SUBSTEPS,
    TORQUE,
    UPRIGHT,
    advance_phase,
)
from cspm_sim.kernels.plant import make_scratch, plant_advance, plant_tensions, state_count
from cspm_sim.parameters import plant_parameters
from cspm_sim.rest import frame_shift, memory_at_rest, static_wrench

Array = NDArray[np.float64]

SETTLING_STEPS = 50
SETTLING_SHARE = 0.02  # of the length
SETTLING_TOLERANCE = 1e-9  # [N]
SETTLING_PROBE = 1e-7  # [m]


class Plant:
    """Bar, cables and winches on a moving winch frame.

    Time is a count of steps of `period_ns`; `step` advances it by one. Read-only views of the
    current state: `bar_state` (12: position, Euler angles, velocity in world axes, ω in bar axes),
    `unstretched_lengths`, `angles`, `speeds` (n each), `tensions` (n) and `frame` (18). `locked`
    may be set at any time: the brakes, which stop the motors at once. `cut` names the cables that
    have parted. `substeps` is how many steps of the integration a period has; see `step_stability`.
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
        cuts: Mapping[int, Sequence[int]] | None = None,
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
            cuts: indices of the cables that part, by the step from which they carry nothing.

        Raises:
            InputError: the test-bed has a bar and no pose for it, or a cable of length zero.
            ConvergenceError: no tensions hold the bar at this pose.
        """
        self.testbed = testbed
        self.parameters = plant_parameters(testbed)
        self._actions = read_actions(testbed)
        self.period_ns = period_ns
        self.frame_motion = frame_motion
        self.steps, self.substeps = 0, 1
        self.cut: tuple[str, ...] = ()
        self._cuts = dict(cuts or {})
        n = len(testbed.cables)
        first = BAR_STATES if testbed.bar else 0
        self.state: Array = np.zeros(state_count(self.parameters))
        self.bar_state = self.state[:first]
        self.unstretched_lengths = self.state[first : first + n]
        self.angles = self.state[first + n : first + 2 * n]
        self.speeds = self.state[first + 2 * n : first + 3 * n]
        self._memory = self.state[first + 3 * n :]
        self.has_drives = bool((self.parameters.effects[:, HOOK] == Hook.DRIVE).any())
        self.locked = locked
        self.frame: Array = frame_motion.at(0.0)
        self.outputs = np.zeros((2, n))
        self.tensions = self.outputs[0]
        self.lengths = self.outputs[1]
        self._frames = np.zeros((3, 18))
        self.scratch = make_scratch(len(self.state), n)
        self._place(bar_pose, tensions)
        self._part()
        self._own = self.advance_phase(0, upright=False)

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
        self._own.refresh()
        # A cable parts only once the step is made.
        self._own.arrays[0][NEXT_CUT] = -1
        self._own.kernel(self.steps, np.ascontiguousarray(torque), self._own.places)
        self.finish_step(int(self._own.arrays[0][BAD]))

    def finish_step(self, bad: int) -> None:
        """Count the step that the states have made, and look at what came of it.

        Args:
            bad: the first state that is not finite, −1 for none.

        Raises:
            DivergenceError: as `step`.
        """
        self.steps += 1
        if bad >= 0:
            raise DivergenceError(f"t = {self.time:.3f} s: {self.state_name(bad)} is not finite")
        if self.testbed.bar and abs(self.bar_state[4]) > 0.5 * np.pi:
            raise past_vertical(self.time, self.bar_state[4])
        if self.steps in self._cuts:
            self._part()

    def advance_phase(self, torque: int, *, upright: bool) -> Phase:
        """Return the step as a compiled phase, which leaves a step with a cut to `step`.

        Args:
            torque: the first column of the torques in the row.
            upright: whether a bar that has turned over is to be looked at.
        """
        integers = np.zeros(ADVANCE_INTEGERS, dtype=np.int64)
        integers[TORQUE], integers[UPRIGHT] = torque, upright
        integers[PERIODIC] = self.frame_motion.periodic
        integers[ADDRESS] = address_of(plant_advance, ADVANCE)

        numbers = np.array([self.frame_motion.spacing, 0.0])

        def refresh() -> None:
            integers[LOCKED], integers[SUBSTEPS] = self._locked, self.substeps
            integers[NEXT_CUT] = min(self._cuts, default=-1)
            numbers[1] = self.period_ns * 1e-9 / self.substeps

        return make_phase(
            advance_phase,
            integers,
            numbers,
            self.state,
            self.frame,
            self._frames,
            self.outputs,
            self.frame_motion.knots,
            *self.parameters,
            *self.scratch,
            refresh=refresh,
        )

    def state_name(self, index: int) -> str:
        """Return the name of a state, such as `speed of surge_2`."""
        first, n = len(self.bar_state), len(self.testbed.cables)
        if index < first:
            kind, dof = divmod(index, 6)
            return f"bar {DOFS[dof]}" + (" rate" if kind else "")
        if index >= first + 3 * n:
            index -= first + 3 * n
            for action in self._actions:
                if index < action.effect.physics.states:
                    return f"state {index} of {action.effect.id} of {action.name}"
                index -= action.effect.physics.states
        kind, cable = divmod(index - first, n)
        name = ("unstretched length", "motor angle", "motor speed")[kind]
        return f"{name} of {self.testbed.cable_names[cable]}"

    def applied_torque(self, torque: Array) -> Array:
        """Return what the drives report for a torque command, (n,) [N·m]: limits and lags apply."""
        limits = self.parameters.cables[:, TORQUE_LIMIT]
        applied = np.minimum(limits, np.maximum(-limits, torque))
        if self.has_drives:
            p, scratch = self.parameters, self.scratch
            reported_torques(
                self.state,
                torque,
                len(self.bar_state),
                p.cables,
                p.effects,
                p.effect_parameters,
                scratch.signals,
                scratch.stages[0],
                applied,
            )
        return applied

    def _observe(self) -> None:
        plant_tensions(self.state, self.frame, self.parameters, self.scratch, self.outputs)

    def part(self, cable: str) -> None:
        """Let a cable part now."""
        self._cuts[self.steps] = [self.testbed.cable_names.index(cable)]
        self._part()

    def _part(self) -> None:
        """Let the cables part whose step has come; what remains of them is not wound."""
        for i in self._cuts.pop(self.steps, ()):
            self.parameters.cables[i, HAS_CABLE] = 0.0
            self.cut += (self.testbed.cable_names[i],)
        self._observe()

    def _place(self, bar_pose: ArrayLike | None, tensions: ArrayLike | None) -> None:
        if self.testbed.bar is None:
            # The lengths are needed first; any positive unstretched length serves for them.
            self.unstretched_lengths[:] = 1.0
            self._observe()
            carried = np.zeros(len(self.lengths)) if tensions is None else np.asarray(tensions)
            self.unstretched_lengths[:] = unstretched_lengths(
                self.parameters, self.lengths.copy(), carried
            )
            self._settle(carried, carried @ self.scratch.spans[:, DIRECTION : DIRECTION + 3])
            return
        if bar_pose is None:
            raise InputError("plant: this test-bed has a bar, a pose to start from is required")
        rest, force = self._hang(bar_pose)
        self.bar_state[:6] = rest.bar_pose
        self.unstretched_lengths[:] = rest.unstretched_lengths
        self._settle(rest.tensions, force)

    def _hang(self, bar_pose: ArrayLike) -> tuple[Equilibrium, Array]:
        """Return the equilibrium with all that effects add at rest, and the frame's force."""
        limits = np.array([cable.tension_limits for cable in self.testbed.cables], dtype=float)
        frame = self.frame[:6].copy()
        rest = find_equilibrium(self.parameters, bar_pose, frame, limits)
        if not self._actions:
            return rest, np.zeros(3)
        # The load at the pose at which the first load is held: it depends on the pose but little.
        for _ in range(2):
            load = static_wrench(self._actions, self.parameters, rest.bar_pose, frame)
            force = (gravity_wrench(self.parameters, rest.bar_pose) + load)[:3]
            frame[:3] = self.frame[:3] + frame_shift(self._actions, force)
            rest = find_equilibrium(self.parameters, bar_pose, frame, limits, load)
        return rest, force

    def _settle(self, tensions: Array, force: Array) -> None:
        """Bring the states of effects to rest, and the cables with them to their tensions."""
        lengths, loaded = self.unstretched_lengths, tensions > 0.0
        hooks = {hook for action in self._actions for hook in action.effect.physics.kernels}
        for _ in range(SETTLING_STEPS):
            self._memory[:] = memory_at_rest(
                self._actions, self.parameters, tensions, lengths, force
            )
            if not hooks & {Hook.CABLE, Hook.LOADED_CABLE, Hook.FRAME}:
                break
            excess = self._tensions_at_rest() - tensions
            if np.abs(excess[loaded]).max(initial=0.0) <= SETTLING_TOLERANCE:
                break
            begin = lengths.copy()
            lengths[:] += SETTLING_PROBE
            slope = (self._tensions_at_rest() - tensions - excess) / SETTLING_PROBE
            # A cable that is slack is shortened first; from the taut side Newton's steps converge.
            step = np.where(loaded, SETTLING_SHARE * self.lengths, 0.0)
            np.divide(excess, slope, out=step, where=loaded & (slope < 0.0))
            lengths[:] = begin - step

    def _tensions_at_rest(self) -> Array:
        frame = np.concatenate([self.frame[:6], np.zeros(12)])
        plant_tensions(self.state, frame, self.parameters, self.scratch, self.outputs)
        return self.tensions.copy()


def past_vertical(time: float, pitch: float) -> DivergenceError:
    """Return the error of a bar whose pitch [rad] left the Euler angles at a time [s]."""
    return DivergenceError(
        f"t = {time:.3f} s: pitch {pitch:.3f} rad passed ±π/2, where the Euler angles end"
    )
