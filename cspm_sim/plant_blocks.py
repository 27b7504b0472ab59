"""The plant's blocks with given inputs: winch motion, torques, or tensions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_model.kernels.machine import BAR_STATES, PlantParameters
from cspm_model.motion import Motion
from cspm_sim.kernels.blocks import (
    simulate_from_tensions,
    simulate_from_torques,
    simulate_from_winches,
    simulate_shafts,
)
from cspm_sim.kernels.hooks import check_order
from cspm_sim.kernels.plant import make_scratch, state_count

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
        out = np.full((len(angles), self.size + self.cables), np.nan)
        good = simulate_from_winches(
            state.copy(),
            np.ascontiguousarray(angles),
            np.ascontiguousarray(speeds),
            np.zeros((0, BAR_STATES)) if bars is None else np.ascontiguousarray(bars),
            *self._motion(start),
            self.parameters,
            np.zeros((3, 18)),
            make_scratch(self.size, self.cables),
            np.zeros((2, self.cables)),
            out,
        )
        return self._result(out, good)

    def by_torques(self, start: int, state: Array, torques: Array) -> BlockResponse:
        """Return the whole plant's motion under given torques, (steps, n) [N·m], each held."""
        out = np.full((len(torques) + 1, self.size + self.cables), np.nan)
        good = simulate_from_torques(
            state.copy(),
            np.ascontiguousarray(torques),
            *self._motion(start),
            self.parameters,
            np.zeros((3, 18)),
            make_scratch(self.size, self.cables),
            np.zeros((2, self.cables)),
            out,
        )
        return self._result(out, good)

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

    def _motion(self, start: int) -> tuple[Array, float, int, float]:
        return self.frame_motion.knots, self.frame_motion.spacing, start, self.period

    def _result(self, out: Array, good: int) -> BlockResponse:
        out[good:] = np.nan
        return BlockResponse(out[:, : self.size], out[:, self.size :], good)
