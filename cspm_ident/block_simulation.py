"""A recorded machine simulated block by block from its measured signals."""

from __future__ import annotations

from enum import Enum
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.signals.timeline import Timeline, whole_stretches
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed
from cspm_sim.driven_plant import Driven, DrivenPlant
from cspm_sim.equilibrium import find_equilibrium, unstretched_lengths
from cspm_sim.kernels.cable import DAMPING_CONSTANT, DAMPING_SLOPE, OFFSET_LENGTH, RADIUS
from cspm_sim.kernels.rotation import euler_rate_to_world_rate
from cspm_sim.kinematics import geometry, rotation
from cspm_sim.parameters import plant_parameters

Array = NDArray[np.float64]
Window = tuple[int, int]

_OFFSET_ROUNDS = 3
_OFFSET_STEP_M = 1e-6
_OFFSET_MOST_M = 5e-3


class Drive(Enum):
    """Which measured signals drive the simulation.

    `winch`: motor angles and the frame's pose; bar and cables are simulated. `torque`: torques and
    the frame's pose; everything is. `tension`: tensions and the frame's pose; the bar is. `cable`:
    motor angles and both poses; the cables alone are.
    """

    WINCH = "winch"
    TORQUE = "torque"
    TENSION = "tension"
    CABLE = "cable"


class Simulated(NamedTuple):
    """What came out, on the timeline's steps; NaN outside the windows.

    Attributes:
        bars: x y z φ θ ψ, shape (k, 6), empty (k, 0) where the bar is no output.
        tensions: shape (k, n) [N] or (k, 0).
        angles: at the motor shafts, shape (k, n) [rad] or (k, 0).
        failed: windows in which the simulation diverged.
    """

    bars: Array
    tensions: Array
    angles: Array
    failed: list[Window]


class BlockSimulation:
    """Simulates windows of a timeline on a described machine."""

    def __init__(self, timeline: Timeline, testbed: Testbed) -> None:
        """Take the signals and the machine, its effects included.

        Raises:
            InputError: an effect cannot be used.
        """
        self.timeline = timeline
        self.testbed = testbed
        self.parameters = plant_parameters(testbed)
        self._plant = DrivenPlant(self.parameters, timeline.motion, timeline.period_ns)

    def check(self, drive: Drive) -> None:
        """Refuse a drive for which a sensor is missing.

        Raises:
            InputError: naming the topics that the recording lacks.
        """
        missing = [name for name, signal in self._needs(drive).items() if signal is None]
        if missing:
            raise InputError(
                f"{self.timeline.measurement.path}: --drive {drive.value} needs"
                f" {', '.join(missing)}, allowed: a recording that has them"
            )

    def windows(self, drive: Drive, horizon: float | None) -> list[Window]:
        """Return first and last step of each window.

        Args:
            drive: what must have been measured throughout.
            horizon: longest window [s]; None for as long as nothing is missing.
        """
        columns = [signal for signal in self._needs(drive).values() if signal is not None]
        stretches = whole_stretches([self.timeline.frame_poses, *columns], 2)
        if horizon is None:
            return stretches
        steps = max(2, round(horizon / self.timeline.period))
        found = []
        for start, end in stretches:
            edges = [*range(start, end - steps // 2, steps), end]
            found += [(a, b) for a, b in pairwise(edges) if b - a >= 2]
        return found

    def run(self, drive: Drive, windows: list[Window], offsets: Array | None = None) -> Simulated:
        """Simulate each window from the state that was measured at its start.

        Args:
            drive: what is given.
            windows: first and last steps.
            offsets: as from `offsets`, for all windows; absent: found for each.
        """
        steps, n = len(self.timeline.times), len(self.testbed.cables)
        # A drive's own inputs are no outputs.
        has_bar = self.testbed.bar is not None and drive is not Drive.CABLE
        bars = np.full((steps, 6 if has_bar else 0), np.nan)
        tensions = np.full((steps, 0 if drive is Drive.TENSION else n), np.nan)
        angles = np.full((steps, n if drive is Drive.TORQUE else 0), np.nan)
        failed = []
        first = self._plant.first
        for start, end in windows:
            if offsets is None:
                shift = np.zeros(n) if drive is Drive.TENSION else self.offsets((start, end))
            else:
                shift = offsets
            driven = self._drive(drive, start, end, shift)
            rows = slice(start, end + 1)
            bars[rows] = driven.states[:, : bars.shape[1]]
            tensions[rows] = driven.tensions[:, : tensions.shape[1]]
            angles[rows] = driven.states[:, first + n : first + n + angles.shape[1]]
            if driven.good < end - start + 1:
                failed.append((start, end))
        return Simulated(bars, tensions, angles, failed)

    def offsets(self, window: Window) -> Array:
        """Return what to add to the unstretched lengths of `state_at`, (n,) [m], for a window.

        Encoders count from an arbitrary zero, so one length per cable is unknown. It is the one at
        which the cables under measured winch and bar motion carry the mean tension measured in the
        window; a single noisy sample at its start would tell it badly.
        """
        start, end = window
        line, n = self.timeline, len(self.testbed.cables)
        out = np.zeros(n)
        if line.tensions is None or line.angles is None:
            return out
        measured = line.tensions[start : end + 1]
        for _ in range(_OFFSET_ROUNDS):
            simulated = self._drive(Drive.CABLE, start, end, out).tensions
            shifted = self._drive(Drive.CABLE, start, end, out + _OFFSET_STEP_M).tensions
            slope = np.nanmean(shifted - simulated, axis=0) / _OFFSET_STEP_M
            missing = np.nanmean(measured - simulated, axis=0)
            change = np.divide(missing, slope, out=np.zeros(n), where=slope < 0.0)
            out += np.clip(change, -_OFFSET_MOST_M, _OFFSET_MOST_M)
        return out

    def state_at(self, step: int) -> Array:
        """Return the plant's state that was measured at a step."""
        line, n, first = self.timeline, len(self.testbed.cables), self._plant.first
        state = np.zeros(self._plant.size)
        if line.bars is not None and first:
            state[:first] = line.bars[step]
        if line.angles is not None and line.speeds is not None:
            state[first + n : first + 2 * n] = line.angles[step]
            state[first + 2 * n : first + 3 * n] = line.speeds[step]
        state[first : first + n] = self._unstretched(state, step)
        return state

    def _unstretched(self, state: Array, step: int) -> Array:
        """Return the unstretched lengths: from the tensions, or of rest where there are none."""
        line, parameters = self.timeline, self.parameters
        first, n = self._plant.first, len(self.testbed.cables)
        frame = line.frame_poses[step]
        if not any(cable.has_cable for cable in self.testbed.cables):
            return np.ones(n)
        pose = state[:6] if first else np.zeros(6)
        if line.smooth_tensions is None:
            if not first:
                return geometry(parameters.cables, pose, frame).lengths
            limits = np.array([c.tension_limits for c in self.testbed.cables], dtype=float)
            return find_equilibrium(parameters, pose, frame, limits).unstretched_lengths
        spans = geometry(parameters.cables, pose, frame)
        tensions = np.maximum(line.smooth_tensions[step], 0.0)
        rate = spans.bar @ self._bar_twist(state) + spans.frame @ self._frame_twist(step)
        rate += parameters.cables[:, RADIUS] * state[first + 2 * n : first + 3 * n]
        elastic = spans.lengths + parameters.cables[:, OFFSET_LENGTH]
        damping = parameters.cables[:, DAMPING_CONSTANT]
        damping = np.maximum(damping - parameters.cables[:, DAMPING_SLOPE] * elastic, 0.0)
        return unstretched_lengths(
            parameters, spans.lengths, np.maximum(tensions - damping * rate, 0.0)
        )

    def _bar_twist(self, state: Array) -> Array:
        """Return v and ω of the bar in world axes, shape (6,)."""
        if not self._plant.first:
            return np.zeros(6)
        return np.concatenate([state[6:9], rotation(state[:6]) @ state[9:12]])

    def _frame_twist(self, step: int) -> Array:
        """Return v and ω of the winch frame in world axes, shape (6,), at a step."""
        frame = self.timeline.motion.at(step * self.timeline.period)
        rate = euler_rate_to_world_rate(frame[4], frame[5], frame[9], frame[10], frame[11])
        return np.concatenate([frame[6:9], rate])

    def _drive(self, drive: Drive, start: int, end: int, offsets: Array) -> Driven:
        line, state = self.timeline, self.state_at(start)
        first, n = self._plant.first, len(self.testbed.cables)
        state[first : first + n] += offsets
        rows = slice(start, end + 1)
        if drive is Drive.TENSION:
            return self._plant.by_tensions(start, state[:12], np.asarray(line.tensions)[rows])
        if drive is Drive.TORQUE:
            return self._plant.by_torques(start, state, np.asarray(line.torques)[start:end])
        bars = line.bars[rows] if drive is Drive.CABLE and line.bars is not None else None
        angles, speeds = np.asarray(line.angles)[rows], np.asarray(line.speeds)[rows]
        return self._plant.by_winches(start, state, angles, speeds, bars)

    def _needs(self, drive: Drive) -> dict[str, Array | None]:
        line = self.timeline
        bar = {"/bar/pose": line.bars} if self.testbed.bar is not None else {}
        frame: dict[str, Array | None] = {}
        if self.testbed.winch_frame is not None:
            measured = line.measurement.frame_pose is not None
            frame = {"/winch_frame/pose": line.frame_poses if measured else None}
        angle = {"/winches/state position": line.angles}
        if drive is Drive.TENSION:
            return frame | {"/bar/pose": line.bars, "/cables/tension": line.tensions}
        if drive is Drive.TORQUE:
            return frame | bar | angle | {"/winches/state effort": line.torques}
        return frame | bar | angle
