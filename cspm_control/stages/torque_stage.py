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
    """Sends the prescribed motor torques; it knows no tension but that of its last torques.

    Attributes:
        generator: what prescribes them.
        torque: last torques, (n,) [N·m].
    """

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
        self.generator = generator
        self._radii = radii
        self.torque, self._has_torque = np.zeros(len(radii)), False
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
        self.torque[:] = self.generator.step(now_ns - self._start_ns)
        self._has_torque = True
        self._send(now_ns, self.torque.copy(), send)

    @property
    def steady(self) -> bool:
        """Whether it commands torques, and has done so since the time began."""
        return self._has_torque and not self._latch.open and self._start_ns == 0

    def status(self) -> Status:
        """Return that all is well, since a prescribed torque has nothing to follow; or not."""
        found = Status(Level.OK, self.node, "ok", {})
        return self._latch.status(self._safe_state.name, found)

    def _restart(self) -> None:
        """Nothing to start: the torques are those of the instant."""

    def _present_tensions(self) -> Array | None:
        return self.torque / self._radii if self._has_torque else None
