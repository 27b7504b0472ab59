"""A stage of the cascade that a controller of the user's own computes."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cspm_control.safety import GuardedStage
from cspm_control.stages.wave_stage import WaveStage
from cspm_model.kernels.rotation import euler_from_quaternion
from cspm_msgs_py.diagnostics import Level, Status
from cspm_msgs_py.errors import ControllerError, InputError
from cspm_msgs_py.safety_spec import Safety
from cspm_msgs_py.schedule import BAR_REFERENCE, TENSION, TORQUE_COMMAND, WINCH_STATE
from cspm_msgs_py.stepping.safe_state import SafeState
from cspm_msgs_py.stepping.stage import Send, Stage

Array = NDArray[np.float64]
Output = Array | Mapping[str, Array]


class Computes(Protocol):
    """An object with `step`; see `cspm.Controller`."""

    def step(self, time: float, inputs: Mapping[str, Array]) -> Output:
        """Return the stage's output at `time` [s] from the latest rows by topic."""


class OwnStage:
    """A stage of the cascade that a controller of the user's own computes."""

    def __init__(
        self,
        node: str,
        controller: Computes,
        replaced: Stage | None,
        sizes: Mapping[str, int],
        begin: Callable[[], None] = lambda: None,
    ) -> None:
        """Take the place of a stage.

        Args:
            node: the stage's name.
            controller: what computes.
            replaced: the wave trajectory whose place it takes, which sends what it leaves out.
            sizes: of the rows that it has to return, by topic.
            begin: lets the controller begin anew.
        """
        self.node = node
        self._controller, self._replaced, self._sizes = controller, replaced, sizes
        self._begin, self._suspended, self._start_ns = begin, False, 0

    def start(self, start_ns: int) -> None:
        """Count the controller's time from an instant [ns]; without a call from 0."""
        self._start_ns = start_ns

    def suspend(self, suspended: bool) -> None:
        """Begin anew with every step while nobody follows the output; go on from there."""
        self._suspended = suspended

    def restart(self) -> None:
        """Let the controller begin anew."""
        self._begin()

    def step(self, now_ns: int, inputs: Mapping[str, Array], send: Send) -> None:
        """Send what the controller returns.

        Raises:
            InputError: it is no row of the topic's length, or has numbers that are not finite.
        """
        if self._suspended:
            self._begin()
        found = self._controller.step((now_ns - self._start_ns) / 1e9, inputs)
        rows = found if isinstance(found, Mapping) else dict.fromkeys(self._sizes, found)
        rows = {topic: self._checked(topic, row) for topic, row in rows.items()}
        if isinstance(self._replaced, WaveStage):
            rows = self._with_scenarios(self._replaced, now_ns, rows)
        for topic, row in rows.items():
            send(topic, row)

    def status(self) -> Status:
        """Return that it computed."""
        return Status(Level.OK, self.node, "ok", {"controller": type(self._controller).__name__})

    def _with_scenarios(
        self, replaced: WaveStage, now_ns: int, rows: Mapping[str, Array]
    ) -> dict[str, Array]:
        """Return the rows with those of the scenario where there are none of its own."""
        scenarios: dict[str, Array] = {}
        replaced.step(now_ns, {}, scenarios.__setitem__)
        row, trajectory = rows.get(BAR_REFERENCE), replaced.trajectories.get(BAR_REFERENCE)
        if row is not None and trajectory is not None:
            # The run's errors are those against the reference that was sent.
            trajectory.values[:3], trajectory.values[3:6] = row[:3], euler_from_quaternion(row[3:7])
        return scenarios | dict(rows)

    def _checked(self, topic: str, row: object) -> Array:
        name = f"{self.node}: {type(self._controller).__name__}"
        if topic not in self._sizes:
            raise InputError(f"{name} returned {topic}, allowed: {', '.join(self._sizes)}")
        try:
            found = np.array(row, dtype=np.float64)
        except (TypeError, ValueError):
            found = np.empty(0)
        if found.shape != (self._sizes[topic],):
            raise InputError(
                f"{name} returned {topic} of shape {found.shape}, allowed: ({self._sizes[topic]},)"
            )
        if not np.isfinite(found).all():
            raise InputError(f"{name} returned {topic} {found.tolist()}, allowed: finite numbers")
        return found


class NamedStage(OwnStage):
    """An own stage from a file that the scenario names; whatever it raises becomes one line."""

    # What the file is called in these lines.
    source = "own code"

    def step(self, now_ns: int, inputs: Mapping[str, Array], send: Send) -> None:
        """Send what the controller returns.

        Raises:
            ControllerError: it failed, or returned no row of the topic's length.
        """
        try:
            super().step(now_ns, inputs, send)
        except InputError as err:
            raise ControllerError(f"{err}, in {Path(self.source).name}") from err
        except Exception as err:
            raise ControllerError(f"{self.node}: {fault_of(err, self.source)}") from err


def fault_of(err: Exception, source: str) -> str:
    """Return an exception in one line: file, the line in it where it was, kind and text."""
    name = Path(source).name
    lines = [f.lineno for f in traceback.extract_tb(err.__traceback__) if f.filename == source]
    place = f"{name} line {lines[-1]}" if lines else name
    return " ".join(f"{place}: {type(err).__name__}: {err}".split()).removesuffix(":")


@dataclass(frozen=True)
class WinchLimits:
    """What tensions and torques may do.

    Attributes:
        trip: highest tension that is measured while all is well, (n,) [N].
        torque: largest motor torque, (n,) [N·m].
    """

    trip: Array
    torque: Array


class GuardedOwnStage(GuardedStage):
    """Force controllers of the user's own, within the motors' limits and with a safe state."""

    def __init__(
        self,
        own: OwnStage,
        limits: WinchLimits,
        names: tuple[str, ...],
        safe_state: SafeState,
        safety: Safety,
        period_ns: int,
    ) -> None:
        """Take the controller's stage, the limits, the cables' names, and the guard's arguments."""
        super().__init__(safe_state, safety, period_ns, len(names))
        self._own, self._limits, self._names = own, limits, names
        self._measured: Array | None = None
        self._steps = self._limited = 0

    def start(self, start_ns: int) -> None:
        """Count the controller's time from an instant [ns]; without a call from 0."""
        self._own.start(start_ns)

    def step(self, now_ns: int, inputs: Mapping[str, Array], send: Send) -> None:
        """Send the controller's torques within the motors' limits, or those of the safe state."""
        self._begin_step(now_ns, inputs.get(WINCH_STATE))
        fault = self._tension_fault(inputs.get(TENSION))
        if fault or self._latch.open:
            self._latch.stand(now_ns, "input", fault)
            self._send_safe(now_ns, send)
            return
        rows: dict[str, Array] = {}
        try:
            self._own.step(now_ns, inputs, rows.__setitem__)
        except ControllerError as err:
            self.trip(now_ns, str(err))
            self._send_safe(now_ns, send)
            return
        wanted = rows[TORQUE_COMMAND]
        torque = np.clip(wanted, -self._limits.torque, self._limits.torque)
        self._steps += 1
        self._limited += bool((torque != wanted).any())
        self._send(now_ns, torque, send)

    def status(self) -> Status:
        """Return the share of steps with a torque limit met since the last call, or the state."""
        _, name, message, values = self._own.status()
        values = {**values, "limited_share": f"{self._limited / max(1, self._steps):.3f}"}
        found = Status(Level.OK, name, message, values)
        if self._limited:
            found = Status(Level.WARN, name, "torque at its limit", values)
        self._steps = self._limited = 0
        return self._latch.status(self._safe_state.name, found)

    def _restart(self) -> None:
        self._own.restart()

    def _present_tensions(self) -> Array | None:
        return None if self._measured is None else self._measured.copy()

    def _tension_fault(self, measured: Array | None) -> str | None:
        """Keep the tensions (n,) [N], or return what is wrong with them."""
        if measured is None:
            return None
        if measured.shape != self._limits.trip.shape:
            return f"{TENSION}: shape {measured.shape}, allowed: {self._limits.trip.shape}"
        # Written so that NaN fails as well.
        bad = np.flatnonzero(~(np.isfinite(measured) & (measured <= self._limits.trip)))
        if len(bad):
            i = int(bad[0])
            most = f"at most {self._limits.trip[i]:g} N"
            return f"{TENSION}: {measured[i]:.1f} N in {self._names[i]}, allowed: {most}"
        self._measured = measured
        return None
