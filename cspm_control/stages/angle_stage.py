"""Prescribed motor angles as a stage, in the place of the force controllers, guarded."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from cspm_control.controllers.angle_servo import AngleGenerator, AngleServo
from cspm_control.safety import GuardedStage
from cspm_msgs_py.diagnostics import Level, Status
from cspm_msgs_py.safety_spec import Safety
from cspm_msgs_py.schedule import TENSION, WINCH_STATE
from cspm_msgs_py.stepping.safe_state import SafeState
from cspm_msgs_py.stepping.stage import Send

Array = NDArray[np.float64]


class AngleStage(GuardedStage):
    """Sends the torques that keep the motors on their paths.

    Angles count from those measured first, since an encoder's zero is anywhere.

    Attributes:
        generator, servo: what computes torques, as `__init__` takes it.
        trip_tensions: highest that are measured while all is well, (n,) [N].
        first: angles less those wanted at the first step, (n,) [rad].
        tensions: measured last, (n,) [N].
        counts: steps since the last status, and those with a torque at its limit.
    """

    def __init__(
        self,
        generator: AngleGenerator,
        servo: AngleServo,
        radii: Array,
        trip: Array,
        names: tuple[str, ...],
        safe_state: SafeState,
        safety: Safety,
        period_ns: int,
    ) -> None:
        """Make the stage.

        Args:
            generator: the angles wanted.
            servo: what keeps them.
            radii: cable wound per radian of the motor, (n,) [m].
            trip: highest tension that is measured while all is well, (n,) [N].
            names: the cables'.
            safe_state: where to go.
            safety: the scenario's.
            period_ns: of the stage [ns].
        """
        super().__init__(safe_state, safety, period_ns, len(names))
        self.generator, self.servo, self.trip_tensions = generator, servo, trip
        self._radii, self._names = radii, names
        self.first, self.tensions = np.zeros(len(names)), np.zeros(len(names))
        self._begun = self._has_tensions = False
        self._start_ns = 0
        self.counts = np.zeros(2, dtype=np.int64)

    def start(self, start_ns: int) -> None:
        """Let the paths begin at an instant [ns]; without a call they begin at 0."""
        self._start_ns = start_ns

    def step(self, now_ns: int, inputs: Mapping[str, Array], send: Send) -> None:
        """Send the torques for the latest winch state."""
        winches, tensions = inputs[WINCH_STATE], inputs.get(TENSION)
        self._begin_step(now_ns, winches)
        fault = self._fault(winches, tensions)
        if fault:
            self._latch.trip(now_ns, fault)
        if self._latch.open:
            self._send_safe(now_ns, send)
            return
        self._has_tensions = tensions is not None
        if tensions is not None:
            self.tensions[:] = tensions
        angles, speeds, _ = np.split(winches, 3)
        wanted, rates = self.generator.step(now_ns - self._start_ns)
        if not self._begun:
            self.first[:], self._begun = angles - wanted, True
            self.servo.restart(self._holding())
        torque = self.servo.step(wanted + self.first, rates, angles, speeds)
        self.counts += 1, self.servo.saturated > 0
        self._send(now_ns, torque, send)

    @property
    def steady(self) -> bool:
        """Whether it commands torques, and has done so since the time began."""
        return self._begun and not self._latch.open and self._start_ns == 0

    def status(self) -> Status:
        """Return the servos' statistics since the last call."""
        steps, limited = self.counts.tolist()
        values = {"saturated_share": f"{limited / max(1, steps):.3f}"}
        self.counts[:] = 0
        level, text = (Level.WARN, "torque at its limit") if limited else (Level.OK, "ok")
        return self._latch.status(self._safe_state.name, Status(level, self.node, text, values))

    def _restart(self) -> None:
        # From where the motors are now, so that a reset brings no jump.
        self._begun = False

    def _present_tensions(self) -> Array | None:
        return self.tensions.copy() if self._has_tensions else None

    def _holding(self) -> Array:
        return self._radii * self.tensions if self._has_tensions else np.zeros(len(self._radii))

    def _fault(self, winches: Array, tensions: Array | None) -> str | None:
        if winches.shape != (self._width,):
            return f"{WINCH_STATE}: a row of shape {winches.shape}, allowed: {(self._width,)}"
        n = len(self._names)
        if not np.isfinite(winches).all():
            i = int(np.argmin(np.isfinite(winches)))
            return f"{WINCH_STATE}: {winches[i]} of {self._names[i % n]}, allowed: finite numbers"
        if tensions is None:
            return None
        if tensions.shape != (n,):
            return f"{TENSION}: a row of shape {tensions.shape}, allowed: {(n,)}"
        # Written so that NaN fails as well; minus infinity is below no trip.
        good = (tensions > -np.inf) & (tensions <= self.trip_tensions)
        if good.all():
            return None
        i = int(np.argmin(good))
        if np.isfinite(tensions[i]):
            most = f"at most {self.trip_tensions[i]:g} N"
            return f"{TENSION}: {tensions[i]:.1f} N in {self._names[i]}, allowed: {most}"
        return f"{TENSION}: {tensions[i]} N in {self._names[i]}, allowed: finite numbers"
