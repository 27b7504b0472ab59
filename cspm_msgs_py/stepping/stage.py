"""What every controller of the cascade looks like to whoever steps it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.diagnostics import Status

Array = NDArray[np.float64]
Send = Callable[[str, Array], None]


class Stage(Protocol):
    """A controller bound to the topics that it reads and writes; time comes in with each step."""

    @property
    def node(self) -> str:
        """Name of the node that it is."""

    def step(self, now_ns: int, inputs: Mapping[str, Array], send: Send) -> None:
        """Compute once from the latest rows by topic; `send` gets each output's topic and row."""

    def status(self) -> Status:
        """Return what happened since the last call."""


class Guard(Protocol):
    """A stage that commands winches and has a safe state; see `cspm_control.safety`."""

    @property
    def safe(self) -> bool:
        """Whether it is in its safe state."""

    @property
    def brake(self) -> bool:
        """Whether the winches' brakes are to be set."""

    def trip(self, now_ns: int, reason: str) -> None:
        """Go to the safe state."""

    def emergency_stop(self, now_ns: int, pressed: bool) -> None:
        """Take the state of the emergency stop."""

    def reset(self, now_ns: int) -> str | None:
        """Leave the safe state, or return why not."""

    def watch(
        self,
        now_ns: int,
        ages_ns: Mapping[str, int],
        send: Send,
        inputs: Mapping[str, Array] | None = None,
    ) -> None:
        """Look after inputs that do not come."""
