"""The plant's own guard: what its drives do when nobody commands them any more."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.diagnostics import Level, Status
from cspm_msgs_py.schedule import PLANT, TORQUE_COMMAND
from cspm_msgs_py.stepping.latch import Latch
from cspm_msgs_py.stepping.lateness import too_busy
from cspm_msgs_py.stepping.safe_state import SafeState, Winches
from cspm_sim.any_plant import AnyPlant

Array = NDArray[np.float64]

_SILENCE, _COMMAND, _LATENESS = "silence", "command", "lateness"


class Watchdog:
    """Brings the drives into the safe state when torque commands end or cannot be right.

    It waits for a first command, and stays in the safe state until `reset`. It also keeps the
    brakes, which are set by it or by command.
    """

    name = f"{PLANT}/watchdog"

    def __init__(
        self,
        plant: AnyPlant,
        safe_state: SafeState,
        patience: float,
        oldest_ns: int | None = None,
    ) -> None:
        """Take the plant and where to go.

        Args:
            plant: whose drives are guarded.
            safe_state: where they go.
            patience: how long to wait for a command [s].
            oldest_ns: how old the state may be that the torques in force answer [ns]; None: any
                age.
        """
        self._plant, self._oldest_ns = plant, oldest_ns
        self._safe_state = safe_state
        self._patience_ns = round(patience * 1e9)
        self._latch = Latch()
        self._commanded_ns: int | None = None
        self._answered_ns: int | None = None
        self._entered = self._held = False
        self._brake_wanted = plant.locked

    @property
    def safe(self) -> bool:
        """Whether the drives are in their safe state."""
        return self._latch.open

    @property
    def reason(self) -> str:
        """Why the drives are in their safe state, empty if they are not."""
        return self._latch.reason or ""

    def command(self, now_ns: int, torque: Array, answered_ns: int | None = None) -> None:
        """Take note of a torque command (n,) [N·m] that came now, and answers a state of then."""
        self._commanded_ns, self._answered_ns = now_ns, answered_ns
        self._latch.stand(now_ns, _COMMAND, self._fault(torque))

    def trip(self, now_ns: int, reason: str) -> None:
        """Go to the safe state for a reason that came and went."""
        self._latch.trip(now_ns, reason)

    def hold(self, wanted: bool) -> None:
        """Be in the safe state while the force controller is in its own; it reports why.

        What it commands meanwhile comes late where the machine is busy, and is not needed.
        """
        self._held = wanted
        if not wanted and not self._latch.open:
            self._leave()

    def brake(self, wanted: bool) -> None:
        """Set the plant's brakes, or release them as far as the safe state does not need them."""
        self._brake_wanted = wanted
        self._set_brakes()

    def torque(self, now_ns: int) -> Array | None:
        """Return the safe state's torques (n,) [N·m]; None while commands are to be followed.

        To be called in every period, on the clock of `command`.
        """
        if self._commanded_ns is not None:
            self._latch.stand(now_ns, _SILENCE, self._silence(now_ns, self._commanded_ns))
        if self._answered_ns is not None and self._oldest_ns is not None:
            age, since = now_ns - self._answered_ns, now_ns - (self._commanded_ns or now_ns)
            # A sender that is gone looks like one that is late, but for this.
            what = f"{TORQUE_COMMAND} of {since * 1e-6:.1f} ms ago, the newest, answers a state of"
            self._latch.stand(now_ns, _LATENESS, too_busy(what, age, self._oldest_ns))
        if not (self._latch.open or self._held):
            return None
        if not self._entered:
            self._entered = True
            self._safe_state.begin(self._plant.tensions.copy())
            self._set_brakes()
        winches = Winches(self._plant.angles, self._plant.speeds)
        return self._safe_state.torque(now_ns, winches)

    def reset(self) -> str | None:
        """Follow commands again; return why not in one line while a reason lasts."""
        refusal = self._latch.release()
        if refusal is None and not self._held:
            self._leave()
        return refusal

    def status(self) -> Status:
        """Return that all is well, or the safe state with its reason."""
        waits = self._commanded_ns is None
        message = "waits for the first torque command" if waits else "ok"
        return self._latch.status(self._safe_state.name, Status(Level.OK, self.name, message, {}))

    def _leave(self) -> None:
        self._entered = False
        self._set_brakes()

    def _set_brakes(self) -> None:
        self._plant.locked = self._brake_wanted or (self._entered and self._safe_state.brake)

    def _silence(self, now_ns: int, commanded_ns: int) -> str | None:
        silent = now_ns - commanded_ns
        if silent < 0:
            before, now = commanded_ns * 1e-9, now_ns * 1e-9
            return f"clock went back from {before:.3f} s to {now:.3f} s"
        if silent <= self._patience_ns:
            return None
        old, allowed = -(-silent // 1_000_000), self._patience_ns * 1e-6
        return f"no {TORQUE_COMMAND} for {old} ms, allowed: {allowed:g} ms"

    def _fault(self, torque: Array) -> str | None:
        names = self._plant.testbed.cable_names
        if torque.shape != (len(names),):
            return f"{TORQUE_COMMAND}: a row of shape {torque.shape}, allowed: ({len(names)},)"
        good = np.isfinite(torque)
        if good.all():
            return None
        i = int(np.argmin(good))
        return f"{TORQUE_COMMAND}: {torque[i]} N·m of {names[i]}, allowed: finite numbers"
