"""The force controllers as a stage: wanted and measured tensions to motor torques, guarded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_control.controllers.force_controller import ForceController
from cspm_control.controllers.load_cell_bias import LoadCellBias
from cspm_control.feedforward.friction_feedforward import FrictionFeedforward
from cspm_control.feedforward.winch_feedforward import WinchFeedforward
from cspm_control.safety import GuardedStage
from cspm_msgs_py.diagnostics import Level, Status
from cspm_msgs_py.safety_spec import Safety
from cspm_msgs_py.schedule import (
    BAR_REFERENCE,
    FRAME_REFERENCE,
    TENSION,
    TENSION_COMMAND,
    WINCH_STATE,
)
from cspm_msgs_py.stepping.safe_state import SafeState
from cspm_msgs_py.stepping.stage import Send

Array = NDArray[np.float64]

_NO_ROW = np.zeros(0)
# The reference of a frame that does not move: pose, twist, acceleration.
_STILL = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0] + 12 * [0.0])


@dataclass(frozen=True)
class ForceLimits:
    """What tensions and torques may do.

    Attributes:
        tensions: lowest and highest wanted tension, (n, 2) [N].
        trip: highest tension that is measured while all is well, (n,) [N].
        torque_step: largest change of a torque from one step to the next [N·m]; None: any.
    """

    tensions: Array
    trip: Array
    torque_step: float | None


class ForceStage(GuardedStage):
    """Sends the motor torques, and those of the safe state when an input cannot be right."""

    def __init__(
        self,
        controller: ForceController,
        limits: ForceLimits,
        names: tuple[str, ...],
        safe_state: SafeState,
        safety: Safety,
        period_ns: int,
        bias: LoadCellBias | None = None,
        friction: FrictionFeedforward | None = None,
        winch: WinchFeedforward | None = None,
    ) -> None:
        """Take the controllers, their limits, the cables' names, and the guard's arguments.

        With `bias` the tensions are corrected before they are controlled; what trips is measured.
        With `friction` its torque at the references' speed is fed forward, with `winch` that of
        the winches' motion and tension.
        """
        super().__init__(safe_state, safety, period_ns, len(names))
        self._controller, self._bias = controller, bias
        self._friction, self._winch = friction, winch
        self._limits = limits
        self._names = names
        self._shape = (len(names),)
        self._sizes = (0, self._width)
        self._wanted, self._measured = np.zeros(len(names)), np.zeros(len(names))
        self._has_measured = False
        self._torque: Array | None = None
        self._steps = self._limited = self._clipped = self._slewed = 0

    def step(self, now_ns: int, inputs: Mapping[str, Array], send: Send) -> None:
        """Send the torques for the latest wanted and measured tensions."""
        wanted, measured = inputs[TENSION_COMMAND], inputs[TENSION]
        winches = inputs.get(WINCH_STATE)
        self._begin_step(now_ns, winches)
        fault, clipped = self._examine(wanted, measured, _NO_ROW if winches is None else winches)
        fault = fault or self._reference_fault(inputs)
        if fault or self._latch.open:
            self._latch.stand(now_ns, "input", fault)
            self._send_safe(now_ns, send)
            return
        corrected = self._corrected(measured, winches)
        ahead = self._ahead(inputs)
        torque = self._slew(self._controller.step(self._wanted, corrected, ahead))
        self._steps += 1
        self._limited += self._controller.saturated > 0
        self._clipped += clipped
        self._send(now_ns, torque, send)

    def status(self) -> Status:
        """Return shares of steps with a limit met since the last call, or the safe state.

        And the largest bias of a load cell, where biases are estimated.
        """
        steps = max(1, self._steps)
        values = {
            "limited_share": f"{self._limited / steps:.3f}",
            "slew_share": f"{self._slewed / steps:.3f}",
            "tension_limited_share": f"{self._clipped / steps:.3f}",
        }
        if self._bias is not None:
            most = int(np.argmax(np.abs(self._bias.values)))
            values["load_cell_bias"] = f"{self._names[most]} {self._bias.values[most]:+.2f} N"
        trouble = "ok"
        if self._limited:
            trouble = "torque at its limit"
        elif self._slewed:
            trouble = "torque slew at its limit"
        elif self._clipped:
            trouble = "tension command beyond the tension limits"
        level = Level.OK if trouble == "ok" else Level.WARN
        self._steps = self._limited = self._clipped = self._slewed = 0
        found = Status(level, self.node, trouble, values)
        return self._latch.status(self._safe_state.name, found)

    def _restart(self) -> None:
        self._controller.restart()
        self._torque = None
        if self._bias is not None:
            self._bias.restart()
        if self._winch is not None:
            self._winch.restart()

    def _present_tensions(self) -> Array | None:
        return self._measured.copy() if self._has_measured else None

    def _corrected(self, measured: Array, winches: Array | None) -> Array:
        """Return tensions without the biases of their load cells, as far as these are known."""
        if self._bias is None:
            return measured
        n = len(self._names)
        if self._torque is not None and winches is not None and winches.size:
            self._bias.step(measured, winches[n : 2 * n], self._torque)
        return measured - self._bias.values

    def _reference_fault(self, inputs: Mapping[str, Array]) -> str | None:
        if self._friction is None and self._winch is None:
            return None
        for topic in (BAR_REFERENCE, FRAME_REFERENCE):
            row = inputs.get(topic, _STILL)
            if row.shape != _STILL.shape:
                return f"{topic}: a row of shape {row.shape}, allowed: {_STILL.shape}"
            if not np.isfinite(row).all():
                return f"{topic}: {row[~np.isfinite(row)][0]}, allowed: finite numbers"
        return None

    def _ahead(self, inputs: Mapping[str, Array]) -> Array | None:
        """Return what is fed forward (n,) [N·m], None for nothing or before a reference came."""
        bar = inputs.get(BAR_REFERENCE)
        ahead = [each for each in (self._friction, self._winch) if each is not None]
        if bar is None or not ahead:
            return None
        frame = inputs.get(FRAME_REFERENCE, _STILL)
        first, *more = [each.torque(bar, frame, self._wanted) for each in ahead]
        for torque in more:
            first = first + torque
        return first

    def _slew(self, torque: Array) -> Array:
        step = self._limits.torque_step
        if step is not None and self._torque is not None:
            wanted, torque = torque, np.clip(torque, self._torque - step, self._torque + step)
            self._slewed += bool((wanted != torque).any())
        self._torque = torque
        return torque

    def _examine(self, wanted: Array, measured: Array, winches: Array) -> tuple[str | None, bool]:
        """Keep the tensions, wanted ones within their limits; return a fault, and if any was not.

        Only tensions without fault are kept.
        """
        if not wanted.shape == measured.shape == self._shape or winches.size not in self._sizes:
            return self._shape_fault(wanted, measured, winches), False
        limits = self._limits
        bad, clipped = _keep(
            wanted, measured, winches, limits.tensions, limits.trip, self._wanted, self._measured
        )
        if bad >= 0:
            return self._number_fault(bad, wanted, measured, winches), False
        self._has_measured = True
        return None, clipped

    def _shape_fault(self, wanted: Array, measured: Array, winches: Array) -> str:
        topic, row, shape = WINCH_STATE, winches, (self._width,)
        if measured.shape != self._shape:
            topic, row, shape = TENSION, measured, self._shape
        elif wanted.shape != self._shape:
            topic, row, shape = TENSION_COMMAND, wanted, self._shape
        return f"{topic}: a row of shape {row.shape}, allowed: {shape}"

    def _number_fault(self, bad: int, wanted: Array, measured: Array, winches: Array) -> str:
        n = len(self._names)
        name = self._names[bad % n]
        if bad >= 2 * n:
            return f"{WINCH_STATE}: {winches[bad - 2 * n]} of {name}, allowed: finite numbers"
        if bad >= n:
            return f"{TENSION_COMMAND}: {wanted[bad - n]} N of {name}, allowed: finite numbers"
        if np.isfinite(measured[bad]):
            trip = self._limits.trip[bad]
            return f"{TENSION}: {measured[bad]:.1f} N in {name}, allowed: at most {trip:g} N"
        return f"{TENSION}: {measured[bad]} N in {name}, allowed: finite numbers"


@njit(cache=True, error_model="numpy")
def _keep(
    wanted: Array,
    measured: Array,
    winches: Array,
    limits: Array,
    trip: Array,
    wanted_out: Array,
    measured_out: Array,
) -> tuple[int, bool]:
    """Copy the tensions, wanted ones within `limits`, unless a number is at fault.

    Returns the first number at fault, −1 for none, counted through `measured`, `wanted` and
    `winches`; and whether a wanted one was not within the limits.
    """
    n = measured.shape[0]
    for i in range(n):
        # Written so that NaN fails as well; minus infinity is below no trip.
        if not (-np.inf < measured[i] <= trip[i]):
            return i, False
    for i in range(n):
        if not np.isfinite(wanted[i]):
            return n + i, False
    for i in range(winches.shape[0]):
        if not np.isfinite(winches[i]):
            return 2 * n + i, False
    clipped = False
    for i in range(n):
        measured_out[i] = measured[i]
        wanted_out[i] = min(limits[i, 1], max(limits[i, 0], wanted[i]))
        if wanted_out[i] != wanted[i]:
            clipped = True
    return -1, clipped
