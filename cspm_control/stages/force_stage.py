"""The force controllers as a stage: wanted and measured tensions to motor torques, guarded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_control.controllers.dither import Dither
from cspm_control.controllers.force_controller import ForceController
from cspm_control.controllers.load_cell_bias import LoadCellBias
from cspm_control.feedforward.friction_feedforward import FrictionFeedforward
from cspm_control.feedforward.winch_feedforward import WinchFeedforward
from cspm_control.safety import GuardedStage
from cspm_msgs_py.diagnostics import Level, Status
from cspm_msgs_py.safety_spec import Safety
from cspm_msgs_py.schedule import (
    BAR_REFERENCE,
    FORCE_INTERNALS,
    FRAME_REFERENCE,
    TENSION,
    TENSION_COMMAND,
    WINCH_STATE,
)
from cspm_msgs_py.stepping.safe_state import SafeState
from cspm_msgs_py.stepping.stage import Send

Array = NDArray[np.float64]

# What is counted since the last status: steps, and those with a torque at its limit, with a wanted
# tension beyond its limits, and with a torque that changes no faster than it may.
STEPS, LIMITED_STEPS, CLIPPED_STEPS, SLEWED_STEPS, COUNTS = range(5)
_NO_ROW = np.zeros(0)
# The reference of a frame that does not move: pose, twist, acceleration.
STILL = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0] + 12 * [0.0])


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
    """Sends the motor torques, and those of the safe state when an input cannot be right.

    Attributes:
        controller, bias, friction, winch, dither: what computes them, as `__init__` takes it.
        limits: what tensions and torques may do.
        tension_limits: of wanted tensions, (n, 2) [N]; a released cable's begin at 0.
        release_damping: what brings released winches to rest, (n,) [N·m·s/rad], if any are.
        released: which winches are, (n,).
        internals: whether the controllers' terms are sent too.
        wanted, measured: tensions that were controlled last, (n,) [N].
        torque: last torques, (n,) [N·m].
        counts: see `STEPS`.
    """

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
        dither: Dither | None = None,
        release_damping: Array | None = None,
        *,
        internals: bool = False,
    ) -> None:
        """Take the controllers, their limits, the cables' names, and the guard's arguments.

        With `bias` the tensions are corrected before they are controlled; what trips is measured.
        With `friction` its torque at the references' speed is fed forward, with `winch` that of
        the winches' motion and tension. `dither` comes on top of all. With `release_damping` (n,)
        [N·m·s/rad] a winch from which 0 N is wanted is released for good: this damping alone brings
        it to rest. With `internals` the controllers' terms are sent too, in the safe state zeros.
        """
        super().__init__(safe_state, safety, period_ns, len(names))
        self.controller, self.bias = controller, bias
        self.friction, self.winch, self.dither = friction, winch, dither
        self.limits, self.tension_limits = limits, limits.tensions.copy()
        self.release_damping, self.released = release_damping, np.zeros(len(names), dtype=bool)
        self.internals = internals
        self._names = names
        self._shape = (len(names),)
        self._sizes = (0, self._width)
        self.wanted, self.measured = np.zeros(len(names)), np.zeros(len(names))
        self._has_measured = False
        self.torque, self._has_torque = np.zeros(len(names)), False
        self.counts = np.zeros(COUNTS, dtype=np.int64)

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
            self._send_internals(np.zeros_like(self.controller.terms), send)
            return
        corrected = self._corrected(measured, winches)
        ahead = self._ahead(inputs)
        torque = self.controller.step(self.wanted, corrected, ahead)
        if self.dither is not None:
            torque = self.dither.added_to(torque, now_ns)
        torque = self._slew(self._with_released(torque, winches))
        self.counts += (1, self.controller.saturated > 0, clipped, 0)
        self._send(now_ns, torque, send)
        self._send_internals(self.controller.terms, send)

    @property
    def steady(self) -> bool:
        """Whether it commands torques and has done so before."""
        return self._has_torque and not self._latch.open

    def status(self) -> Status:
        """Return shares of steps with a limit met since the last call, or the safe state.

        And the largest bias of a load cell, where biases are estimated.
        """
        steps, limited, clipped, slewed = self.counts.tolist()
        steps = max(1, steps)
        values = {
            "limited_share": f"{limited / steps:.3f}",
            "slew_share": f"{slewed / steps:.3f}",
            "tension_limited_share": f"{clipped / steps:.3f}",
        }
        if self.bias is not None:
            most = int(np.argmax(np.abs(self.bias.values)))
            values["load_cell_bias"] = f"{self._names[most]} {self.bias.values[most]:+.2f} N"
        trouble = "ok"
        if limited:
            trouble = "torque at its limit"
        elif slewed:
            trouble = "torque slew at its limit"
        elif clipped:
            trouble = "tension command beyond the tension limits"
        level = Level.OK if trouble == "ok" else Level.WARN
        self.counts[:] = 0
        found = Status(level, self.node, trouble, values)
        return self._latch.status(self._safe_state.name, found)

    def _restart(self) -> None:
        self.controller.restart()
        self._has_torque = False
        if self.bias is not None:
            self.bias.restart()
        if self.winch is not None:
            self.winch.restart()

    def _send_internals(self, terms: Array, send: Send) -> None:
        if self.internals:
            send(FORCE_INTERNALS, terms.ravel())

    def _present_tensions(self) -> Array | None:
        return self.measured.copy() if self._has_measured else None

    def _corrected(self, measured: Array, winches: Array | None) -> Array:
        """Return tensions without the biases of their load cells, as far as these are known."""
        if self.bias is None:
            return measured
        n = len(self._names)
        if self._has_torque and winches is not None and winches.size:
            self.bias.step(measured, winches[n : 2 * n], self.torque)
        return measured - self.bias.values

    def _reference_fault(self, inputs: Mapping[str, Array]) -> str | None:
        if self.friction is None and self.winch is None:
            return None
        for topic in (BAR_REFERENCE, FRAME_REFERENCE):
            row = inputs.get(topic, STILL)
            if row.shape != STILL.shape:
                return f"{topic}: a row of shape {row.shape}, allowed: {STILL.shape}"
            if not np.isfinite(row).all():
                return f"{topic}: {row[~np.isfinite(row)][0]}, allowed: finite numbers"
        return None

    def _ahead(self, inputs: Mapping[str, Array]) -> Array | None:
        """Return what is fed forward (n,) [N·m], None for nothing or before a reference came."""
        bar = inputs.get(BAR_REFERENCE)
        ahead = [each for each in (self.friction, self.winch) if each is not None]
        if bar is None or not ahead:
            return None
        frame = inputs.get(FRAME_REFERENCE, STILL)
        first, *more = [each.torque(bar, frame, self.wanted) for each in ahead]
        for torque in more:
            first = first + torque
        return first

    def _slew(self, torque: Array) -> Array:
        step = self.limits.torque_step
        if step is not None and self._has_torque:
            wanted, torque = torque, np.clip(torque, self.torque - step, self.torque + step)
            self.counts[SLEWED_STEPS] += bool((wanted != torque).any())
        self.torque[:], self._has_torque = torque, True
        return torque

    def _examine(self, wanted: Array, measured: Array, winches: Array) -> tuple[str | None, bool]:
        """Keep the tensions, wanted ones within their limits; return a fault, and if any was not.

        Only tensions without fault are kept.
        """
        if not wanted.shape == measured.shape == self._shape or winches.size not in self._sizes:
            return self._shape_fault(wanted, measured, winches), False
        self._release(wanted)
        limits, kept = (self.tension_limits, self.limits.trip), (self.wanted, self.measured)
        bad, clipped = keep_tensions(wanted, measured, winches, *limits, *kept)
        if bad >= 0:
            return self._number_fault(bad, wanted, measured, winches), False
        self._has_measured = True
        return None, clipped

    def _release(self, wanted: Array) -> None:
        """Release the winches from which nothing is wanted."""
        if self.release_damping is None:
            return
        found = (wanted == 0.0) & ~self.released
        if found.any():
            self.released |= found
            self.tension_limits[found, 0] = 0.0
            self.controller.release(found)

    def _with_released(self, torque: Array, winches: Array | None) -> Array:
        damping, n = self.release_damping, len(self._names)
        if damping is not None and self.released.any():
            speeds = np.zeros(n) if winches is None else winches[n : 2 * n]
            most = self.controller.torque_limits
            torque[self.released] = np.clip(-damping * speeds, -most, most)[self.released]
        return torque

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
            trip = self.limits.trip[bad]
            return f"{TENSION}: {measured[bad]:.1f} N in {name}, allowed: at most {trip:g} N"
        return f"{TENSION}: {measured[bad]} N in {name}, allowed: finite numbers"


@njit(cache=True, error_model="numpy")
def keep_tensions(
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
