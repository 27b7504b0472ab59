"""Reports between the nodes of a run in real time of what must lead to the safe state.

On `/run/fault` a node that refuses a message, or whose clock was set, says so to the node that has
a safe state. Anybody may send there, as on `/emergency_stop`: it can only stop.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.local_name import local
from cspm_msgs_py.ros.qos import contract_qos
from cspm_msgs_py.topics import QOS_DEPTH

FAULT = "/run/fault"
_HEADER = "std_msgs/msg/Header"
# The same reason is sent again after so long [s].
_AGAIN_S = 0.05


class FaultLine:
    """One node's end of the line."""

    def __init__(self, node: ContractNode, take: Callable[[str], None] | None = None) -> None:
        """Connect a node; `take` gets what others report, in one line."""
        self._node, self._take = node, take
        self._header = ros_class(_HEADER)
        self._publisher = node.node.create_publisher(self._header, local(FAULT), contract_qos())
        self._last, self._sent = "", -_AGAIN_S
        if take is not None:
            node.subscribe_objects(FAULT, self._header, self._hear, QOS_DEPTH)

    def report(self, reason: str) -> None:
        """Report a reason, in one line; the same one again not more than 20 times a second."""
        now = time.monotonic()
        if reason == self._last and now - self._sent < _AGAIN_S:
            return
        self._last, self._sent = reason, now
        self._publisher.publish(self._header(frame_id=f"{self._node.name}: {reason}"))

    def _hear(self, message: object) -> None:
        text = str(message.frame_id)  # type: ignore[attr-defined]
        if self._take is not None and not text.startswith(f"{self._node.name}: "):
            self._take(text)
