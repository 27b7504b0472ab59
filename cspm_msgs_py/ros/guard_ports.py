"""The outside of a guarded stage: emergency stop, reset and brakes."""

from __future__ import annotations

from collections.abc import Callable

from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.qos import contract_qos
from cspm_msgs_py.stepping.stage import Guard
from cspm_msgs_py.topics import BRAKE, EMERGENCY_STOP, QOS_DEPTH, SAFE

RESET = "~/reset"
_TELL_EVERY_S = 0.02
_REPEAT = 10


class GuardPorts:
    """Connects a guard: `/emergency_stop` in, `/winches/brake` and `/winches/safe` out, `~/reset`.

    States are sent when they change and now and then, for those who come late.
    """

    def __init__(self, node: ContractNode, guard: Guard, now_ns: Callable[[], int]) -> None:
        """Connect `guard`; `now_ns` tells the time on the clock that it is stepped with."""
        self._guard, self._now_ns = guard, now_ns
        self._bool = ros_class(BRAKE.ros_type)
        self._brake = node.node.create_publisher(self._bool, BRAKE.name, contract_qos())
        self._safe = node.node.create_publisher(self._bool, SAFE.name, contract_qos())
        stop_class = ros_class(EMERGENCY_STOP.ros_type)
        node.subscribe_objects(EMERGENCY_STOP.name, stop_class, self._stop, QOS_DEPTH)
        node.node.create_service(ros_class("std_srvs/srv/Trigger"), RESET, self._reset)
        node.every(_TELL_EVERY_S, self._tell)
        self._told: tuple[bool, bool] | None = None
        self._untold = 0

    def _stop(self, message: object) -> None:
        self._guard.emergency_stop(self._now_ns(), bool(message.data))  # type: ignore[attr-defined]

    def _reset(self, _: object, response: object) -> object:
        refusal = self._guard.reset(self._now_ns())
        response.success = refusal is None  # type: ignore[attr-defined]
        response.message = refusal or "running"  # type: ignore[attr-defined]
        return response

    def _tell(self) -> None:
        brake, safe = state = self._guard.brake, self._guard.safe
        self._untold += 1
        if state != self._told or self._untold >= _REPEAT:
            self._told, self._untold = state, 0
            self._brake.publish(self._bool(data=brake))
            self._safe.publish(self._bool(data=safe))
