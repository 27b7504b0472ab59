"""A recorded machine simulated block by block from its measured signals."""

from __future__ import annotations

from enum import Enum
from itertools import pairwise
from threading import Lock
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.side_by_side import side_by_side
from cspm_ident.signals.cable_motion import damping_of
from cspm_ident.signals.timeline import Timeline, whole_stretches
from cspm_model.equilibrium import Equilibrium, find_equilibrium, unstretched_lengths
from cspm_model.kernels.cable import RADIUS
from cspm_model.kinematics import geometry
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed
from cspm_sim.effect_entries import read_actions
from cspm_sim.effects import Hook, catalogue
from cspm_sim.parameters import plant_parameters
from cspm_sim.plant_blocks import BlockResponse, PlantBlocks
from cspm_sim.rest import memory_at_rest

Array = NDArray[np.float64]
Window = tuple[int, int]

_OFFSET_ROUNDS = 3
_OFFSET_STEP_M = 1e-6
_OFFSET_MOST_M = 5e-3
# A minute determines the zero of the lengths well enough.
_OFFSET_LONGEST_S = 60.0


class Input(Enum):
    """Which measured signals a simulation takes as its input.

    `winch`: motor angles and the frame's pose; bar and cables are simulated. `torque`: torques and
    the frame's pose; everything is. `tension`: tensions and the frame's pose; the bar is. `cable`:
    motor angles and both poses; the cables alone are. `shaft`: torques and tensions; the winches
    alone are.
    """

    WINCH = "winch"
    TORQUE = "torque"
    TENSION = "tension"
    CABLE = "cable"
    SHAFT = "shaft"


_WITHOUT_CABLES = (Input.TENSION, Input.SHAFT)


class Simulated(NamedTuple):
    """What came out, on the timeline's steps; NaN outside the windows.

    Attributes:
        bars: x y z φ θ ψ, shape (k, 6), empty (k, 0) where the bar is no output.
        tensions: shape (k, n) [N] or (k, 0).
        angles: at the motor shafts, shape (k, n) [rad] or (k, 0).
        speeds: at the motor shafts, shape (k, n) [rad/s] or (k, 0).
        failed: windows in which the simulation diverged.
    """

    bars: Array
    tensions: Array
    angles: Array
    speeds: Array
    failed: list[Window]


class BlockSimulation:
    """Simulates windows of a timeline on a described machine."""

    def __init__(self, timeline: Timeline, testbed: Testbed) -> None:
        """Take the signals and the machine, its effects included.

        Raises:
            InputError: an effect cannot be used.
        """
        self.timeline = timeline
        self.testbed = _as_reported(testbed)
        self.parameters = plant_parameters(self.testbed)
        self._actions = read_actions(self.testbed)
        self._plant = PlantBlocks(self.parameters, timeline.motion, timeline.period_ns)
        self._states: dict[int, Array] = {}
        self._offsets: dict[Window, Array] = {}
        self._lock = Lock()

    def check(self, given: Input) -> None:
        """Refuse an input for which a sensor is missing.

        Raises:
            InputError: naming the topics that the recording lacks.
        """
        missing = self.missing(given)
        if missing:
            raise InputError(
                f"{self.timeline.measurement.path}: --drive {given.value} needs"
                f" {', '.join(missing)}, allowed: a recording that has them"
            )

    @property
    def has_cables(self) -> bool:
        """Whether any winch has a cable."""
        return any(cable.has_cable for cable in self.testbed.cables)

    def missing(self, given: Input) -> list[str]:
        """Return the topics that an input needs and the recording lacks."""
        return [name for name, signal in self._needs(given).items() if signal is None]

    def windows(self, given: Input, horizon: float | None) -> list[Window]:
        """Return first and last step of each window.

        Args:
            given: what must have been measured throughout.
            horizon: longest window [s]; None for as long as nothing is missing.
        """
        columns = [signal for signal in self._needs(given).values() if signal is not None]
        if given is not Input.SHAFT:
            columns.append(self.timeline.frame_poses)
        stretches = whole_stretches(columns, 2)
        if horizon is None:
            return stretches
        steps = max(2, round(horizon / self.timeline.period))
        found = []
        for start, end in stretches:
            edges = [*range(start, end - steps // 2, steps), end]
            found += [(a, b) for a, b in pairwise(edges) if b - a >= 2]
        return found

    def run(self, given: Input, windows: list[Window], offsets: Array | None = None) -> Simulated:
        """Simulate each window from the state that was measured at its start.

        Args:
            given: the input.
            windows: first and last steps.
            offsets: as from `offsets`, for all windows; absent: found for each.
        """
        widths = self._widths(given)
        steps, first, n = len(self.timeline.times), self._plant.first, len(self.testbed.cables)
        found = [np.full((steps, width), np.nan) for width in widths]
        bars, tensions, angles, speeds = found
        failed = []
        for start, end in windows:
            shift = self.offsets((start, end), given) if offsets is None else offsets
            driven = self._simulate(given, start, end, shift)
            rows = slice(start, end + 1)
            bars[rows] = driven.states[:, : widths[0]]
            tensions[rows] = driven.tensions[:, : widths[1]]
            angles[rows] = driven.states[:, first + n : first + n + widths[2]]
            speeds[rows] = driven.states[:, first + 2 * n : first + 2 * n + widths[3]]
            if driven.good < end - start + 1:
                failed.append((start, end))
        return Simulated(bars, tensions, angles, speeds, failed)

    def _widths(self, given: Input) -> tuple[int, int, int, int]:
        """Return how many columns of bar, tensions, angles and speeds an input leads to."""
        n, bar = len(self.testbed.cables), 6 if self.testbed.bar is not None else 0
        return {
            Input.WINCH: (bar, n, 0, 0),
            Input.TORQUE: (bar, n, n, 0),
            Input.TENSION: (bar, 0, 0, 0),
            Input.CABLE: (0, n, 0, 0),
            Input.SHAFT: (0, 0, n, n),
        }[given]

    def offsets(self, window: Window, given: Input = Input.WINCH) -> Array:
        """Return what to add to the unstretched lengths of `state_at`, (n,) [m], for a window.

        Encoders count from an arbitrary zero, so one length per cable is unknown. It is the one at
        which the cables under measured winch and bar motion carry the mean tension measured in the
        window, or in its first minute; a single noisy sample at its start would determine it badly.
        Without load cells it is the one at which the bar under measured winch motion is on average
        where it was measured. Zero for an input that does not simulate cables.
        """
        line, n = self.timeline, len(self.testbed.cables)
        if given in _WITHOUT_CABLES or line.angles is None:
            return np.zeros(n)
        if line.tensions is None and (given is not Input.WINCH or line.bars is None):
            return np.zeros(n)
        # Drives that are simulated side by side share what the first one found.
        with self._lock:
            if window not in self._offsets:
                self._offsets[window] = (
                    self._offsets_by_pose(window, line.bars[:, :6])
                    if line.tensions is None and line.bars is not None
                    else self._find_offsets(window, np.asarray(line.tensions))
                )
        return self._offsets[window]

    def _offsets_by_pose(self, window: Window, poses: Array) -> Array:
        start, end = self._zeroing_part(window)
        measured = poses[start : end + 1]
        frame = np.nanmean(self.timeline.frame_poses[start : end + 1], axis=0)
        lengthening = geometry(self.parameters.cables, np.nanmean(measured, axis=0), frame).bar
        out = np.zeros(len(self.testbed.cables))
        for _ in range(_OFFSET_ROUNDS):
            simulated = self._simulate(Input.WINCH, start, end, out).states[:, :6]
            whole = np.isfinite(simulated).all(axis=1)
            if whole.any():
                missing = (measured - simulated)[whole].mean(axis=0)
                out += np.clip(lengthening @ missing, -_OFFSET_MOST_M, _OFFSET_MOST_M)
        return out

    def _find_offsets(self, window: Window, tensions: Array) -> Array:
        start, end = self._zeroing_part(window)
        out = np.zeros(len(self.testbed.cables))
        measured = tensions[start : end + 1]
        for _ in range(_OFFSET_ROUNDS):
            simulated, shifted = side_by_side(
                lambda each: self._simulate(Input.CABLE, start, end, each).tensions,
                (out, out + _OFFSET_STEP_M),
            )
            slope = np.nanmean(shifted - simulated, axis=0) / _OFFSET_STEP_M
            missing = np.nanmean(measured - simulated, axis=0)
            change = np.divide(missing, slope, out=np.zeros(len(out)), where=slope < 0.0)
            out += np.clip(change, -_OFFSET_MOST_M, _OFFSET_MOST_M)
        return out

    def _zeroing_part(self, window: Window) -> Window:
        """Return the part of a window that determines the zero of the lengths."""
        start, end = window
        return start, min(end, start + round(_OFFSET_LONGEST_S / self.timeline.period))

    def state_at(self, step: int) -> Array:
        """Return the plant's state that was measured at a step, its effects settled."""
        if step not in self._states:
            state = self._motion_at(step)
            first, n = self._plant.first, len(self.testbed.cables)
            state[first : first + n] = self._lengths_at(step)
            self._states[step] = state
        return np.array(self._states[step])

    def _motion_at(self, step: int) -> Array:
        """Return the state without the cables' lengths, which neither bar nor winches feel."""
        line, n, first = self.timeline, len(self.testbed.cables), self._plant.first
        state = np.zeros(self._plant.size)
        if line.bars is not None and first:
            state[:first] = line.bars[step]
        state[first : first + n] = 1.0
        if line.angles is not None and line.speeds is not None:
            state[first + n : first + 2 * n] = line.angles[step]
            state[first + 2 * n : first + 3 * n] = line.speeds[step]
        if len(state) > first + 3 * n:
            tensions, force = self._tensions_at(step)
            # Where poses are missing nothing depends on the lengths.
            lengths = self._lengths_at(step) if self._is_seen(step) else np.ones(n)
            state[first + 3 * n :] = memory_at_rest(
                self._actions, self.parameters, tensions, lengths, force
            )
        return state

    def _is_seen(self, step: int) -> bool:
        """Say whether the poses of bar and frame are known at a step."""
        line = self.timeline
        return bool(np.isfinite([line.bar_poses[step], line.frame_poses[step]]).all())

    def _tensions_at(self, step: int) -> tuple[Array, Array]:
        """Return tensions, (n,) [N], and their force on the winch frame, (3,); of rest if unknown.

        Where poses are missing there is no force.
        """
        line = self.timeline
        seen = self._is_seen(step)
        if line.smooth_tensions is not None:
            tensions = np.maximum(np.nan_to_num(line.smooth_tensions[step]), 0.0)
        elif seen and self.testbed.bar is not None:
            tensions = self._rest_at(step).tensions
        else:
            tensions = np.zeros(len(self.testbed.cables))
        if not seen or not all(cable.has_cable for cable in self.testbed.cables):
            return tensions, np.zeros(3)
        spans = geometry(self.parameters.cables, line.bar_poses[step], line.frame_poses[step])
        return tensions, -spans.frame[:, :3].T @ tensions

    def _rest_at(self, step: int) -> Equilibrium:
        limits = np.array([c.tension_limits for c in self.testbed.cables], dtype=float)
        pose, frame = self.timeline.bar_poses[step], self.timeline.frame_poses[step]
        return find_equilibrium(self.parameters, pose, frame, limits)

    def _lengths_at(self, step: int) -> Array:
        """Return the unstretched lengths, (n,) [m]: from the tensions, or of rest without them."""
        line, parameters = self.timeline, self.parameters
        if not self.has_cables:
            return np.ones(len(self.testbed.cables))
        if line.smooth_tensions is None and self.testbed.bar is not None:
            return self._rest_at(step).unstretched_lengths
        spans = geometry(parameters.cables, line.bar_poses[step], line.frame_poses[step])
        if line.smooth_tensions is None:
            return spans.lengths
        rate: Array = spans.bar @ line.bar_twists[step] + spans.frame @ line.frame_twists[step]
        if line.speeds is not None:
            rate += parameters.cables[:, RADIUS] * line.speeds[step]
        tensions = np.maximum(np.nan_to_num(line.smooth_tensions[step]), 0.0)
        elastic = np.maximum(tensions - damping_of(parameters, spans.lengths) * rate, 0.0)
        return unstretched_lengths(parameters, spans.lengths, elastic)

    def _offset_state(self, step: int, offsets: Array) -> Array:
        first = self._plant.first
        state = self.state_at(step)
        state[first : first + len(offsets)] += offsets
        return state

    def _simulate(self, given: Input, start: int, end: int, offsets: Array) -> BlockResponse:
        line, rows = self.timeline, slice(start, end + 1)
        if given is Input.TENSION:
            state, tensions = self._motion_at(start), np.asarray(line.tensions)[rows]
            return self._plant.by_tensions(start, state, tensions)
        if given is Input.SHAFT:
            torques = np.asarray(line.torques)[start:end]
            none = np.zeros((end - start + 1, len(offsets)))
            tensions = none if line.tensions is None else line.tensions[rows]
            return self._plant.shafts(self._motion_at(start), torques, tensions)
        state = self._offset_state(start, offsets)
        if given is Input.TORQUE:
            return self._plant.by_torques(start, state, np.asarray(line.torques)[start:end])
        bars = line.bars[rows] if given is Input.CABLE and line.bars is not None else None
        angles, speeds = np.asarray(line.angles)[rows], np.asarray(line.speeds)[rows]
        return self._plant.by_winches(start, state, angles, speeds, bars)

    def _needs(self, given: Input) -> dict[str, Array | None]:
        line = self.timeline
        bar = {"/bar/pose": line.bars} if self.testbed.bar is not None else {}
        frame: dict[str, Array | None] = {}
        if self.testbed.winch_frame is not None:
            measured = line.measurement.frame_pose is not None
            frame = {"/winch_frame/pose": line.frame_poses if measured else None}
        angle = {"/winches/state position": line.angles}
        torque = {"/winches/state effort": line.torques}
        if given is Input.TENSION:
            return frame | {"/bar/pose": line.bars, "/cables/tension": line.tensions}
        if given is Input.TORQUE:
            return frame | bar | angle | torque
        if given is Input.SHAFT:
            pull = {"/cables/tension": line.tensions} if self.has_cables else {}
            return angle | torque | pull
        return frame | bar | angle


def _as_reported(testbed: Testbed) -> Testbed:
    """Return the machine whose drives deliver their command: the torque that they reported."""
    effects = [
        entry
        for entry in testbed.effects
        if entry.effect not in catalogue()
        or set(catalogue()[entry.effect].physics.kernels) != {Hook.DRIVE}
    ]
    return testbed.model_copy(update={"effects": tuple(effects)})
