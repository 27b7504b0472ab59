"""Stages that command winches, and stop doing so when they cannot do it safely."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.safety_spec import Safety
from cspm_msgs_py.schedule import FORCE_CONTROLLER, TORQUE_COMMAND, WINCH_STATE, Schedule
from cspm_msgs_py.stepping.latch import Latch
from cspm_msgs_py.stepping.safe_state import SafeState, Winches
from cspm_msgs_py.stepping.stage import Send

Array = NDArray[np.float64]

EMERGENCY_STOP = "emergency stop set"
_SILENCE = "emergency stop silent"


class GuardedStage:
    """A stage that commands torques while all is well, and the safe state's when it is not.

    It leaves the safe state by `reset` alone. All times come in, from one clock.
    """

    node = FORCE_CONTROLLER

    def __init__(self, safe_state: SafeState, safety: Safety, period_ns: int, winches: int) -> None:
        """Make the guard.

        Args:
            safe_state: where to go.
            safety: the scenario's.
            period_ns: of the stage [ns].
            winches: how many there are.
        """
        self._safe_state = safe_state
        self._stale_ns = round(safety.stale_after * 1e9)
        beat = safety.stop_heartbeat
        self._beat_ns = None if beat is None else round(beat * 1e9)
        # When the emergency stop was last heard, at first when its silence began [ns].
        self._beaten_ns: int | None = None
        self._half_period_ns = period_ns // 2
        self._width = 3 * winches
        self._latch = Latch()
        self._winches: Array | None = None
        self._stepped_ns = self._sent_ns = -1
        self._entered = self._braked = False

    @property
    def safe(self) -> bool:
        """Whether the stage is in its safe state."""
        return self._latch.open

    @property
    def brake(self) -> bool:
        """Whether the winches' brakes are to be set: until there is a torque to hold the bar."""
        return self._safe_state.brake and (self._latch.open or self._braked)

    def trip(self, now_ns: int, reason: str) -> None:
        """Go to the safe state for a reason that came and went.

        The next `step` or `watch` sends its torques; the first reason stays.
        """
        self._latch.trip(now_ns, reason)

    def emergency_stop(self, now_ns: int, pressed: bool) -> None:
        """Take the state of the emergency stop, which refuses a reset while it is set."""
        self._beaten_ns = now_ns
        self._latch.stand(now_ns, EMERGENCY_STOP, EMERGENCY_STOP if pressed else None)

    def watch(
        self,
        now_ns: int,
        ages_ns: Mapping[str, int],
        send: Send,
        inputs: Mapping[str, Array] | None = None,
    ) -> None:
        """Look after inputs that do not come, and send the safe torques where no step does.

        For real time, once in every period, on the clock of `step`.

        Args:
            now_ns: the present instant [ns].
            ages_ns: by topic that has come, how long ago it last came [ns].
            send: gets topic and row of a torque command.
            inputs: the latest rows by topic; absent: those of the last step.
        """
        for topic, age in ages_ns.items():
            late = age > self._stale_ns
            if late or self._latch.open:
                self._latch.stand(now_ns, ("stale", topic), self._stale(topic, age, late))
        self._watch_stop(now_ns)
        if inputs is not None:
            self._winches = inputs.get(WINCH_STATE)
        elif now_ns - self._stepped_ns > self._stale_ns:
            self._winches = None
        recent = 0 <= now_ns - self._sent_ns < self._half_period_ns
        if self._latch.open and now_ns != self._sent_ns and not (self._entered and recent):
            self._send_safe(now_ns, send)

    def _watch_stop(self, now_ns: int) -> None:
        """Hear whether the emergency stop is still there, where it has to repeat itself."""
        if self._beat_ns is None:
            return
        if self._beaten_ns is None:
            self._beaten_ns = now_ns
        silent, allowed, reason = now_ns - self._beaten_ns, self._beat_ns, None
        if silent > allowed:
            reason = f"{_SILENCE} for {-(-silent // 1_000_000)} ms, allowed: {allowed * 1e-6:g} ms"
        self._latch.stand(now_ns, _SILENCE, reason)

    def reset(self, now_ns: int) -> str | None:
        """Leave the safe state; return why not in one line while a reason lasts."""
        if not self._latch.open:
            return None
        refusal = self._latch.release()
        if refusal is None:
            self._entered = False
            self._restart()
        return refusal

    def _restart(self) -> None:
        """Start anew from what is measured next."""
        raise NotImplementedError

    def _present_tensions(self) -> Array | None:
        """Return the tensions (n,) [N] that the cables carry as far as is known."""
        raise NotImplementedError

    def _stale(self, topic: str, age: int, late: bool) -> str | None:
        if not late:
            return None
        return (
            f"{topic} stale: {-(-age // 1_000_000)} ms old, allowed: {self._stale_ns * 1e-6:g} ms"
        )

    def _begin_step(self, now_ns: int, winches: Array | None) -> None:
        """Check the clock and keep the winches' row."""
        if now_ns < self._stepped_ns:
            before, now = self._stepped_ns * 1e-9, now_ns * 1e-9
            self._latch.trip(now_ns, f"clock went back from {before:.3f} s to {now:.3f} s")
        self._stepped_ns = now_ns
        self._winches = winches

    def _send(self, now_ns: int, torque: Array, send: Send) -> None:
        self._sent_ns = now_ns
        send(TORQUE_COMMAND, torque)
        self._braked = self._latch.open

    def _send_safe(self, now_ns: int, send: Send) -> None:
        """Send the safe state's torques, once for each instant."""
        if not self._entered:
            self._safe_state.begin(self._present_tensions())
        elif now_ns == self._sent_ns:
            return
        self._entered = True
        self._send(now_ns, self._safe_state.torque(now_ns, self._known_winches()), send)

    def _known_winches(self) -> Winches | None:
        row = self._winches
        if row is None or row.shape != (self._width,) or self._latch.stands(("stale", WINCH_STATE)):
            return None
        if not np.isfinite(row).all():
            return None
        count = self._width // 3
        return Winches(row[:count], row[count : 2 * count])


def check_real_time(safety: Safety, schedule: Schedule) -> None:
    """Check that nothing that comes in time counts as late; lockstep waits instead.

    Raises:
        InputError: an input of the force controller, or its torque command, comes less than twice
            in the time that the scenario allows.
    """
    plan = schedule.nodes.get(FORCE_CONTROLLER)
    if plan is None:
        return
    waits = [("stale_after", safety.stale_after, name) for name in (*plan.inputs, *plan.held)]
    for key, wait, topic in (*waits, ("watchdog", safety.watchdog, TORQUE_COMMAND)):
        least = 2 * schedule.topics[topic].divider * schedule.period_ns
        if round(wait * 1e9) < least:
            raise InputError(
                f"safety.{key}: {wait:g} s, allowed in real time: at least {least * 1e-9:g} s, two"
                f" periods of {topic}"
            )
