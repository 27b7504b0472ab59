"""The outside of a guarded stage: emergency stop, reset and brakes."""

from __future__ import annotations

from collections.abc import Callable

from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.local_name import local
from cspm_msgs_py.ros.qos import contract_qos
from cspm_msgs_py.stepping.stage import Guard
from cspm_msgs_py.topics import BRAKE, EMERGENCY_STOP, QOS_DEPTH, SAFE

RESET = "~/reset"
_REPORT_EVERY_S = 0.02
_REPEAT = 10


class GuardPorts:
    """Connects a guard: `/emergency_stop` in, `/winches/brake` and `/winches/safe` out, `~/reset`.

    States are sent when they change and now and then, for those who come late.
    """

    def __init__(
        self,
        node: ContractNode,
        guard: Guard,
        now_ns: Callable[[], int],
        reset: Callable[[int], str | None] | None = None,
        begun: Callable[[], bool] = lambda: True,
    ) -> None:
        """Connect `guard`; `now_ns` gives the time on the clock that it is stepped with.

        `reset` is asked in the guard's place whether it leaves its safe state. Before
        `begun` nothing is sent but a safe state: another run may be on its way there.
        """
        self._guard, self._now_ns = guard, now_ns
        self._release, self._begun = reset or guard.reset, begun
        self._bool = ros_class(BRAKE.ros_type)
        self._brake = node.node.create_publisher(self._bool, local(BRAKE.name), contract_qos())
        self._safe = node.node.create_publisher(self._bool, local(SAFE.name), contract_qos())
        stop_class = ros_class(EMERGENCY_STOP.ros_type)
        node.subscribe_objects(EMERGENCY_STOP.name, stop_class, self._stop, QOS_DEPTH)
        node.node.create_service(ros_class("std_srvs/srv/Trigger"), RESET, self._reset)
        node.every(_REPORT_EVERY_S, self._report)
        self._reported: tuple[bool, bool] | None = None
        self._since_report = 0

    def set_brake(self) -> None:
        """Set the brakes now, whatever the guard says: the run ends."""
        self._brake.publish(self._bool(data=True))

    def _stop(self, message: object) -> None:
        self._guard.emergency_stop(self._now_ns(), bool(message.data))  # type: ignore[attr-defined]

    def _reset(self, _: object, response: object) -> object:
        refusal = self._release(self._now_ns())
        # The drives hold by themselves until they hear of it.
        self._report()
        response.success = refusal is None  # type: ignore[attr-defined]
        response.message = refusal or "running"  # type: ignore[attr-defined]
        return response

    def _report(self) -> None:
        brake, safe = state = self._guard.brake, self._guard.safe
        if not (safe or self._begun()):
            return
        self._since_report += 1
        if state != self._reported or self._since_report >= _REPEAT:
            self._reported, self._since_report = state, 0
            self._brake.publish(self._bool(data=brake))
            self._safe.publish(self._bool(data=safe))
