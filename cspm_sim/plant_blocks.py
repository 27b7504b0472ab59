"""The plant's blocks with given inputs: winch motion, torques, or tensions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from cspm_model.kernels.machine import BAR_STATES, PlantParameters
from cspm_model.kinematics import geometry
from cspm_model.motion import Motion
from cspm_msgs_py.errors import InputError
from cspm_sim.kernels.blocks import (
    simulate_from_tensions,
    simulate_from_torques,
    simulate_from_winches,
    simulate_shafts,
)
from cspm_sim.kernels.hooks import check_order
from cspm_sim.kernels.plant import make_scratch, state_count
from cspm_sim.step_stability import axial_modes, steps_needed

Array = NDArray[np.float64]


class BlockResponse(NamedTuple):
    """What came out, at each step from the start's on; rows after the first bad one are NaN.

    Attributes:
        states: shape (steps + 1, states), as in `plant`; of a bar alone its 12.
        tensions: shape (steps + 1, n) [N].
        good: how many rows are finite.
    """

    states: Array
    tensions: Array
    good: int


class PlantBlocks:
    """A machine on a moving winch frame, whose blocks are run window by window.

    Time is a count of steps from the frame motion's first knot. The states are the plant's:
    bar (12), unstretched lengths, angles, speeds. Nothing is kept between calls, and all may be
    made from several threads at once.
    """

    def __init__(self, parameters: PlantParameters, frame_motion: Motion, period_ns: int) -> None:
        """Take machine, frame motion and step [ns].

        Raises:
            ValueError: the effects' rows are out of order.
        """
        check_order(parameters.effects)
        self.parameters = parameters
        self.frame_motion = frame_motion
        self.period = period_ns * 1e-9
        self.cables = len(parameters.cables)
        self.first = BAR_STATES if len(parameters.bar) else 0
        self.size = state_count(parameters)

    def by_winches(
        self, start: int, state: Array, angles: Array, speeds: Array, bars: Array | None = None
    ) -> BlockResponse:
        """Return bar and tensions under given winch motion.

        Args:
            start: step at which the window begins.
            state: the state there; its angles and speeds are those given.
            angles: at the motor shafts, (steps + 1, n) [rad].
            speeds: their derivatives [rad/s].
            bars: the bar's states, (steps + 1, 12), where the cables alone are to be run.
        """
        count = 1 if bars is not None else self._substeps(start, state, locked=True)
        angles, speeds = _refined(angles, speeds, self.period, count)
        out = np.full((len(angles), self.size + self.cables), np.nan)
        good = simulate_from_winches(
            state.copy(),
            np.ascontiguousarray(angles),
            np.ascontiguousarray(speeds),
            np.zeros((0, BAR_STATES)) if bars is None else np.ascontiguousarray(bars),
            *self._motion(start, count),
            self.parameters,
            np.zeros((3, 18)),
            make_scratch(self.size, self.cables),
            np.zeros((2, self.cables)),
            out,
        )
        return self._result(out, good, count)

    def by_torques(self, start: int, state: Array, torques: Array) -> BlockResponse:
        """Return the whole plant's motion under given torques, (steps, n) [N·m], each held."""
        count = self._substeps(start, state, locked=False)
        out = np.full((count * len(torques) + 1, self.size + self.cables), np.nan)
        good = simulate_from_torques(
            state.copy(),
            np.repeat(torques, count, axis=0),
            *self._motion(start, count),
            self.parameters,
            np.zeros((3, 18)),
            make_scratch(self.size, self.cables),
            np.zeros((2, self.cables)),
            out,
        )
        return self._result(out, good, count)

    def by_tensions(self, start: int, state: Array, tensions: Array) -> BlockResponse:
        """Return the bar's motion under given tensions, (steps + 1, n) [N].

        Of `state`, the plant's, the bar's 12 and the effects' memory are used.
        """
        out = np.full((len(tensions), BAR_STATES), np.nan)
        good = simulate_from_tensions(
            state.copy(),
            np.ascontiguousarray(tensions),
            *self._motion(start),
            self.parameters,
            np.zeros((3, 18)),
            make_scratch(self.size, self.cables),
            out,
        )
        out[good:] = np.nan
        return BlockResponse(out, tensions, good)

    def shafts(self, state: Array, torques: Array, tensions: Array) -> BlockResponse:
        """Return the winches' motion under torques and tensions, whatever bar and frame do.

        Args:
            state: the plant's, of which angles, speeds and the effects' memory are used.
            torques: at the motor shafts, (steps, n) [N·m], each held.
            tensions: (steps + 1, n) [N].
        """
        out = np.full((len(tensions), self.size), np.nan)
        good = simulate_shafts(
            state.copy(),
            np.ascontiguousarray(torques),
            np.ascontiguousarray(tensions),
            self.period,
            self.parameters,
            make_scratch(self.size, self.cables),
            out,
        )
        out[good:] = np.nan
        return BlockResponse(out, tensions, good)

    def _substeps(self, start: int, state: Array, *, locked: bool) -> int:
        """Return how many steps of the integration a period needs at a state.

        One where no number would do: then what comes out is not finite, which the caller sees.
        """
        if not self.first or not np.isfinite(state).all():
            return 1
        frame = self.frame_motion.at(start * self.period)[:6]
        lengths = state[self.first : self.first + self.cables]
        try:
            stretched = geometry(self.parameters.cables, state[:6], frame).lengths
            modes = axial_modes(
                self.parameters, state[:6], frame, (lengths, stretched), None, locked=locked
            )
            return steps_needed(modes, round(1.0 / self.period))
        except InputError:
            return 1

    def _motion(self, start: int, count: int = 1) -> tuple[Array, float, int, float]:
        motion, period = self.frame_motion, self.period / count
        return motion.knots, motion.spacing, count * start, period

    def _result(self, out: Array, good: int, count: int) -> BlockResponse:
        out[good:] = np.nan
        rows = out[::count]
        return BlockResponse(rows[:, : self.size], rows[:, self.size :], -(-good // count))


def _refined(angles: Array, speeds: Array, period: float, count: int) -> tuple[Array, Array]:
    """Return angles and speeds at `count` steps per period, by their cubic Hermite interpolant."""
    if count == 1:
        return angles, speeds
    times = period * np.arange(len(angles))
    between = period / count * np.arange(count * (len(angles) - 1) + 1)
    curve = scipy.interpolate.CubicHermiteSpline(times, angles, speeds)
    return curve(between), curve(between, 1)
