"""The test-bed on MuJoCo, with the face of `cspm_sim`'s plant."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from cspm_msgs_py.errors import DivergenceError, InputError
from cspm_msgs_py.testbed import Testbed
from cspm_sim.mujoco.exertion import RADIUS, cable_row, exert, turning
from cspm_sim.mujoco.extras import find_extras
from cspm_sim.mujoco.influence import Acting, Drive, Influence, Scene
from cspm_sim.mujoco.machine import BAR_BODY, build_model
from cspm_sim.mujoco.rest import hanging_roll, holding_tensions, pulls, resting_lengths

Array = NDArray[np.float64]

RUNAWAY = 1e9  # below the numbers at which MuJoCo would warn by itself


class MujocoPlant:
    """Bar, cables and winches on a moving winch frame, on MuJoCo's dynamics and integrator.

    MuJoCo holds and integrates the bar, the rotors and the unstretched lengths, by its Runge-Kutta
    scheme; at each of its stages this class sets what the cables exert. It does so through
    MuJoCo's control callback, of which a process has one: set during a step, put back after it.
    So only one thread may step such plants.

    The attributes are those of `cspm_sim.plant.Plant`.
    """

    def __init__(
        self,
        testbed: Testbed,
        frame_motion: Callable[[float], Array],
        period_ns: int,
        *,
        bar_pose: ArrayLike | None = None,
        tensions: ArrayLike | None = None,
        locked: bool = False,
        substeps: int = 1,
        influences: Sequence[Influence] = (),
        drive: Drive | None = None,
    ) -> None:
        """Put the machine at rest in equilibrium.

        Args:
            testbed: the machine.
            frame_motion: from time [s] to the winch frame's pose, rate and acceleration, (18,).
            period_ns: step [ns].
            bar_pose: where the bar hangs at the start, x y z φ θ ψ.
            tensions: what the cables carry at the start, (n,) [N], where there is no bar to hold;
                absent: nothing.
            locked: hold all motors still.
            substeps: MuJoCo's steps per period.
            influences: physics beside the test-bed's; none of them acts at rest.
            drive: what lies between command and torque; None: nothing but the limits.

        Raises:
            InputError: the test-bed has a bar and no pose for it, an effect that this plant does
                not have, or a body that MuJoCo refuses.
            ConvergenceError: no tensions hold the bar at this pose.
        """
        n = len(testbed.cables)
        self.testbed = testbed
        self.period_ns = period_ns
        self.steps = 0
        self.cut: tuple[str, ...] = ()
        self._substeps = substeps
        self._failure: DivergenceError | None = None
        self._motion = frame_motion
        extras = find_extras(testbed)
        self._rows = np.array([cable_row(cable) for cable in testbed.cables])
        self._radii = self._rows[:, RADIUS].copy()
        self._drag, self._across = extras.drag, extras.across
        self._influences = tuple(influences)
        self._drive = drive
        self._acting = Acting(n)
        self._acting.radius[:] = self._radii
        self._limits = np.array([cable.torque_limit for cable in testbed.cables])
        timestep = period_ns * 1e-9 / substeps
        self._model = build_model(testbed, extras, timestep)
        self._data = mujoco.MjData(self._model)
        self._take_views(n)
        self.locked = locked
        self.tensions: Array = np.zeros(n)
        self._winding, self._wrench, self._moment = np.zeros(n), np.zeros(6), np.zeros(3)
        self._frame_body, self._body = np.zeros(9), np.zeros(9)
        self.frame: Array = np.array(frame_motion(0.0), dtype=float)
        self._place(bar_pose, tensions)
        self._observe()

    def _take_views(self, n: int) -> None:
        """Name the parts of MuJoCo's state that this class reads and writes."""
        data = self._data
        first = 7 if self.testbed.bar else 0
        speed = 6 if self.testbed.bar else 0
        self.bar_state: Array = np.zeros(12 if self.testbed.bar else 0)
        self._bar_position: Array = data.qpos[:first]
        self._bar_velocity: Array = data.qvel[:speed]
        self.angles: Array = data.qpos[first:]
        self.speeds: Array = data.qvel[speed:]
        self.unstretched_lengths: Array = data.act
        self._torque: Array = data.ctrl[:n]
        self._length_rates: Array = data.ctrl[n:]
        self._load: Array = data.qfrc_applied[speed:]
        self._bar_wrench: Array = data.xfrc_applied[BAR_BODY]
        self._ends: Array = data.site_xpos
        self._origin: Array = data.xpos[BAR_BODY]
        self._rotation: Array = data.xmat[BAR_BODY].reshape(3, 3)
        self._centre: Array = data.xipos[BAR_BODY]
        self._frame_position: Array = data.mocap_pos[0]
        self._frame_quaternion: Array = data.mocap_quat[0]

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
            # What stands still and is not pushed stays where it is.
            for pushed in (self.speeds, self._torque, self._load, self._length_rates):
                pushed[:] = 0.0

    def step(self, torque: Array) -> None:
        """Advance by one period with the motor torques (n,) [N·m] held.

        Raises:
            InputError: another number of torques than cables.
            DivergenceError: a state is no longer finite, or the pitch passed ±π/2.
        """
        if torque.shape != self.tensions.shape:
            raise InputError(
                f"torque: shape {torque.shape}, allowed: {self.tensions.shape}, one per cable"
            )
        if not np.isfinite(torque).all():
            name = self.testbed.cable_names[int(np.argmin(np.isfinite(torque)))]
            raise DivergenceError(f"t = {self.time:.3f} s: torque of {name} is not finite")
        if not self._locked:
            self._torque[:] = self.applied_torque(torque)
        self._data.time = self.time
        before = mujoco.get_mjcb_control()
        mujoco.set_mjcb_control(self._at_stage)
        try:
            mujoco.mj_step(self._model, self._data, nstep=self._substeps)
        finally:
            mujoco.set_mjcb_control(before)
        if self._failure is not None:
            raise self._failure
        self.steps += 1
        self.frame[:] = self._motion(self.time)
        self._check_finite()
        self._observe()
        period = self.period_ns * 1e-9
        for influence in self._influences:
            influence.advance(self.scene(self.time), period)
        if self._drive is not None:
            self._drive.advance(self._limited(torque), period)

    def part(self, cable: str) -> None:
        """Refuse to cut a cable.

        Raises:
            InputError: always.
        """
        raise InputError(f"{cable}: this plant cannot cut a cable, allowed: plant sim")

    def applied_torque(self, torque: Array) -> Array:
        """Return what the drives deliver at this instant for a torque command, (n,) [N·m]."""
        limited = self._limited(torque)
        return limited if self._drive is None else self._drive.deliver(limited)

    def _limited(self, torque: Array) -> Array:
        return np.asarray(np.clip(torque, -self._limits, self._limits))

    def _at_stage(self, model: object, data: object) -> None:
        """Set MuJoCo's forces at the state and time of a stage of its integrator."""
        if self._failure is not None:
            return
        try:
            self._evaluate(self._motion(self._data.time), self._data.time)
        except DivergenceError as err:
            # Not every version of MuJoCo lets an exception pass; `step` raises it.
            self._failure = err
            self._bar_wrench[:] = 0.0
            self._load[:] = 0.0
            return
        self._bar_wrench[:] = self._wrench
        if not self._locked:
            np.multiply(self._acting.radius, self.tensions, out=self._load)
            np.subtract(self._acting.torque, self._load, out=self._load)
            self._length_rates[:] = self._winding

    def scene(self, time: float) -> Scene:
        """Return what influences see of MuJoCo's current state, the tensions those last found."""
        return Scene(
            time,
            self.angles,
            self.speeds,
            self._torque,
            self.tensions,
            self.unstretched_lengths,
            self._ends,
            self._frame_body,
            self._body,
            self._rotation,
        )

    def _evaluate(self, frame: Array, time: float) -> None:
        """Work out tensions and wrench at MuJoCo's current state with the winch frame there."""
        self._move_frame(frame)
        body = self._body
        if self.testbed.bar:
            body[:3] = self._origin
            body[3:6] = self._bar_velocity[:3]
            body[6:] = self._rotation @ self._bar_velocity[3:]
        acting = self._acting
        if self._influences:
            acting.clear(self._radii)
            scene = self.scene(time)
            for influence in self._influences:
                influence.act(scene, acting)
        lost = exert(
            self._ends,
            self._frame_body,
            body,
            self._centre,
            self.unstretched_lengths,
            self.speeds,
            self._rows,
            self._drag,
            self._across,
            acting.radius,
            acting.length,
            acting.tension,
            self.tensions,
            self._winding,
            self._wrench,
        )
        if self._influences:
            self._wrench[:3] += acting.wrench[:3]
            self._wrench[3:] += acting.wrench[3:]
            mujoco.mju_cross(self._moment, self._origin - self._centre, acting.wrench[:3])
            self._wrench[3:] += self._moment
        if lost >= 0:
            # Left to itself, MuJoCo would write a warning to a file of its own.
            raise DivergenceError(
                f"t = {self.time:.3f} s: tension of {self.testbed.cable_names[lost]} is not finite"
            )

    def _move_frame(self, frame: Array) -> None:
        """Move the winch frame, and let MuJoCo find all exits and attachments."""
        self._frame_position[:] = frame[:3]
        mujoco.mju_euler2Quat(self._frame_quaternion, frame[5:2:-1].copy(), "zyx")
        self._frame_body[:3] = frame[:3]
        self._frame_body[3:6] = frame[6:9]
        turning(frame[3:6], frame[9:12], self._frame_body[6:])
        mujoco.mj_kinematics(self._model, self._data)

    def _observe(self) -> None:
        """Bring tensions and the bar's state up to MuJoCo's."""
        self._evaluate(self.frame, self.time)
        if not self.testbed.bar:
            return
        angles = _euler_angles(self._rotation)
        before = self.bar_state[3:6]
        # Angles go on past ±π, as those of a body that keeps turning do.
        angles += 2.0 * np.pi * np.round((before - angles) / (2.0 * np.pi))
        if self.steps and np.abs(angles - before).max() > 0.5 * np.pi:
            raise DivergenceError(
                f"t = {self.time:.3f} s: pitch {angles[1]:.3f} rad passed ±π/2, where the Euler"
                " angles end"
            )
        self.bar_state[:3] = self._bar_position[:3]
        self.bar_state[3:6] = angles
        self.bar_state[6:] = self._bar_velocity

    def _check_finite(self) -> None:
        for name, values in (
            ("bar pose", self._bar_position),
            ("bar velocity", self._bar_velocity),
            ("motor speed", self.speeds),
            ("unstretched length", self.unstretched_lengths),
        ):
            # Written so that NaN fails as well.
            if not (np.abs(values) < RUNAWAY).all():
                raise DivergenceError(f"t = {self.time:.3f} s: {name} is not finite")

    def _place(self, bar_pose: ArrayLike | None, tensions: ArrayLike | None) -> None:
        bar, cables = self.testbed.bar, self.testbed.cables
        carried = np.zeros(len(cables)) if tensions is None else np.asarray(tensions, dtype=float)
        if bar is not None:
            if bar_pose is None:
                raise InputError("plant: this test-bed has a bar, a pose to start from is required")
            pose = np.array(bar_pose, dtype=float)
            attachments = np.array([cable.attachment for cable in cables], dtype=float)
            pose[3] = hanging_roll(bar, attachments, pose[3:])
            self.bar_state[:6] = pose
            self._bar_position[:3] = pose[:3]
            mujoco.mju_euler2Quat(self._bar_position[3:], pose[5:2:-1].copy(), "zyx")
        self._move_frame(self.frame)
        if bar is not None:
            limits = np.array([cable.tension_limits for cable in cables], dtype=float)
            weight = bar.mass * self.testbed.gravity
            carried = holding_tensions(pulls(self._ends, self._centre), weight, limits)
        exits, ends = np.split(self._ends, 2)
        lengths = np.linalg.norm(ends - exits, axis=1)
        self.unstretched_lengths[:] = resting_lengths(lengths, carried, self._rows)


def _euler_angles(R: Array) -> Array:
    """Return φ θ ψ of R = Rz(ψ)Ry(θ)Rx(φ)."""
    return np.array(
        [
            np.arctan2(R[2, 1], R[2, 2]),
            np.arctan2(-R[2, 0], np.hypot(R[2, 1], R[2, 2])),
            np.arctan2(R[1, 0], R[0, 0]),
        ]
    )
