"""Prescribed torques as a stage, in the place of the force controllers, guarded."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from cspm_control.controllers.torque_profile import TorqueGenerator
from cspm_control.safety import GuardedStage
from cspm_msgs_py.diagnostics import Level, Status
from cspm_msgs_py.safety_spec import Safety
from cspm_msgs_py.schedule import WINCH_STATE
from cspm_msgs_py.stepping.safe_state import SafeState
from cspm_msgs_py.stepping.stage import Send

Array = NDArray[np.float64]


class TorqueStage(GuardedStage):
    """Sends the prescribed motor torques; it knows no tension but that of its last torques."""

    def __init__(
        self,
        generator: TorqueGenerator,
        radii: Array,
        safe_state: SafeState,
        safety: Safety,
        period_ns: int,
    ) -> None:
        """Take the torques, cable wound per radian (n,) [m], and the guard's arguments."""
        super().__init__(safe_state, safety, period_ns, len(radii))
        self._generator = generator
        self._radii = radii
        self._torque: Array | None = None
        self._start_ns = 0

    def start(self, start_ns: int) -> None:
        """Let the prescribed torques begin at an instant [ns]; without a call they begin at 0."""
        self._start_ns = start_ns

    def step(self, now_ns: int, inputs: Mapping[str, Array], send: Send) -> None:
        """Send the torques at `now_ns`."""
        self._begin_step(now_ns, inputs.get(WINCH_STATE))
        if self._latch.open:
            self._send_safe(now_ns, send)
            return
        self._torque = self._generator.step(now_ns - self._start_ns)
        self._send(now_ns, self._torque, send)

    def status(self) -> Status:
        """Return that all is well, since a prescribed torque has nothing to follow; or not."""
        found = Status(Level.OK, self.node, "ok", {})
        return self._latch.status(self._safe_state.name, found)

    def _restart(self) -> None:
        """Nothing to start: the torques are those of the instant."""

    def _present_tensions(self) -> Array | None:
        return None if self._torque is None else self._torque / self._radii
