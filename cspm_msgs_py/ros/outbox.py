"""What a node sends in lockstep, in the order in which others need it."""

from __future__ import annotations

from collections.abc import Callable, Collection

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.graph import RECORDER
from cspm_msgs_py.ros.contract_node import ContractNode
from cspm_msgs_py.topics import Topic
from cspm_msgs_py.wire import WireWriter

Array = NDArray[np.float64]
Publish = Callable[[int, int, Array], None]


class Outbox:
    """Sends at once what somebody computes from, and keeps what is only recorded until then."""

    def __init__(self, node: ContractNode) -> None:
        self._node = node
        self._rest: list[tuple[Callable[[bytes], None], bytes]] = []

    def publisher(self, topic: Topic, readers: Collection[str]) -> Publish:
        """Return what publishes (log time [ns], stamp [ns], row) to these nodes."""
        if set(readers) - {RECORDER}:
            return self._node.publisher(topic, readers)
        encode, publish = WireWriter(topic).encode, self._node.raw_publisher(topic, readers)
        rest = self._rest

        def keep(_: int, stamp_ns: int, row: Array) -> None:
            rest.append((publish, encode(stamp_ns, row)))

        return keep

    def send_rest(self) -> None:
        """Send what was kept."""
        for publish, payload in self._rest:
            publish(payload)
        self._rest.clear()
