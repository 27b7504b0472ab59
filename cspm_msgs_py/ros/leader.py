"""Who starts and ends a run in real time: when all is there, and when its time is over."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.rendezvous import PlantSide

_LOOK_EVERY_S = 0.02
_PROVING = "the drivers' proof, a wiggle of each winch"
# From the announcement to the start, so that all know in time.
_NOTICE_NS = 200_000_000


class Leader:
    """Waits for all nodes and inputs, sets the start, and announces the end.

    Services `~/start` and `~/stop` (std_srvs/Trigger) of its node do so on demand.

    Attributes:
        start_ns: when the run begins [ns], None while something is missing.
        end_ns: when it ended [ns].
    """

    def __init__(
        self,
        node: ContractNode,
        period_ns: int,
        others: Collection[str],
        duration_ns: int,
        *,
        missing: Callable[[], list[str]] = list,
        on_start: Callable[[int], None] = lambda _: None,
        on_end: Callable[[int], None] = lambda _: None,
    ) -> None:
        """Lead from `node`.

        Args:
            node: the leading node.
            period_ns: the plant's [ns].
            others: names of the other nodes of the run.
            duration_ns: how long the run lasts [ns].
            missing: what else is not there yet, in words.
            on_start: called with the first instant [ns].
            on_end: called with the last instant [ns].
        """
        self._node, self._duration_ns = node, duration_ns
        self._side = PlantSide(node, period_ns, others, lambda _name, _step: None)
        self._missing, self._on_start, self._on_end = missing, on_start, on_end
        self._timer = node.every(_LOOK_EVERY_S, self._look)
        self.start_ns: int | None = None
        self.end_ns: int | None = None
        self._called = True
        trigger = ros_class("std_srvs/srv/Trigger")
        node.node.create_service(trigger, "~/start", self._on_start_called)
        node.node.create_service(trigger, "~/stop", self._on_stop_called)

    def wait_for_call(self) -> None:
        """Start only once somebody calls `~/start`."""
        self._called = False

    def waiting(self) -> list[str]:
        """Return what is missing before the run can start."""
        # A topic that is missing says more than who misses it.
        missing, apart = self._missing(), ", ".join(sorted(self._side.apart))
        if apart and not missing:
            missing = [f"drivers to reach {apart}"]
        if self._side.proving and not missing:
            missing = [_PROVING]
        found = [*self._side.unmatched(), *missing]
        return found if found or self._called else [f"a call of /{self._node.name}/start"]

    @property
    def busy(self) -> bool:
        """Whether the start waits for a call, or for drivers that prove what they are."""
        return not self._called or self.waiting() == [_PROVING]

    @property
    def elapsed(self) -> float:
        """How long the run has lasted, or lasted [s]."""
        now = self.end_ns or self._node.now_ns()
        return 0.0 if self.start_ns is None else max(0.0, (now - self.start_ns) * 1e-9)

    def waits(self) -> str:
        """Return in one line what the start waits for; empty once the run has begun."""
        missing = [] if self.start_ns is not None else self.waiting()
        return f"waits for {', '.join(missing)}" if missing else ""

    def end(self) -> None:
        """End the run now."""
        if self.end_ns is None:
            self.end_ns = self._node.now_ns()
            self._timer.cancel()
            self._side.tell_end_at(self.end_ns)
            self._on_end(self.end_ns)

    def _on_start_called(self, _: Any, response: Any) -> Any:  # noqa: ANN401 - rosidl's classes
        self._called = True
        waits = self.waits()
        response.success, response.message = not waits, waits or "running"
        return response

    def _on_stop_called(self, _: Any, response: Any) -> Any:  # noqa: ANN401 - rosidl's classes
        began = self.start_ns is not None
        if began:
            self.end()
        text = f"ended after {self.elapsed:.3f} s" if began else f"not begun: {self.waits()}"
        response.success, response.message = began, text
        return response

    def _look(self) -> None:
        now = self._node.now_ns()
        if self.start_ns is None:
            waiting = self.waiting()
            if not waiting:
                # What is waited for may have taken its time to say that it is there.
                self.start_ns = self._node.now_ns() + _NOTICE_NS
                self._side.tell_start_at(self.start_ns)
                self._on_start(self.start_ns)
            elif self._called and waiting == [_PROVING]:
                self._side.ask_for_proofs()
        elif now >= self.start_ns + self._duration_ns:
            self.end()
