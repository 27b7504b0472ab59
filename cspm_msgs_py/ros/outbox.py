"""What a node sends in lockstep, in the order in which others need it."""

from __future__ import annotations

from collections.abc import Callable, Collection

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.graph import RECORDER
from cspm_msgs_py.ros.contract_node import ContractNode
from cspm_msgs_py.topics import Topic

Array = NDArray[np.float64]
Publish = Callable[[int, int, Array], None]


class Outbox:
    """Sends at once what somebody computes from, and keeps what is only recorded until then."""

    def __init__(self, node: ContractNode) -> None:
        self._node = node
        self._rest: list[tuple[Publish, int, int, Array]] = []

    def publisher(self, topic: Topic, readers: Collection[str]) -> Publish:
        """Return what publishes (log time [ns], stamp [ns], row) to these nodes."""
        send, rest = self._node.publisher(topic, readers), self._rest

        def keep(log_ns: int, stamp_ns: int, row: Array) -> None:
            rest.append((send, log_ns, stamp_ns, row.copy()))

        return send if set(readers) - {RECORDER} else keep

    def send_rest(self) -> None:
        """Send what was kept."""
        for send, log_ns, stamp_ns, row in self._rest:
            send(log_ns, stamp_ns, row)
        self._rest.clear()
