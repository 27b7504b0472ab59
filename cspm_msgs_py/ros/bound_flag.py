"""A true-or-false topic that is believed of one publisher alone."""

from __future__ import annotations

from collections.abc import Callable

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.ros.contract_node import ContractNode
from cspm_msgs_py.ros.graph_publishers import GraphPublishers
from cspm_msgs_py.ros.rcl.tagged_taker import Tagged
from cspm_msgs_py.stepping.publisher_binding import PublisherBinding
from cspm_msgs_py.topics import Topic

# CDR: four bytes that name the byte order, then the flag.
_BYTES, _FLAG = 5, 4


def read_flag(topic: str, payload: bytes) -> bool:
    """Return what a `std_msgs/Bool` says.

    Raises:
        InputError: it is none.
    """
    if len(payload) < _BYTES:
        raise InputError(f"{topic}: {len(payload)} bytes, allowed: {_BYTES} of a std_msgs/msg/Bool")
    return payload[_FLAG] != 0


class BoundFlag:
    """Hands on a flag, and refuses strangers'."""

    def __init__(
        self,
        node: ContractNode,
        topic: Topic,
        sender: str,
        receive: Callable[[bool], None],
        refuse: Callable[[str, str], None],
    ) -> None:
        """Subscribe `node` to the topic.

        Args:
            node: who reads.
            topic: of `std_msgs/Bool`.
            sender: the node that is believed.
            receive: called with the flag.
            refuse: called with topic and reason, once the sender is known.
        """
        self._node, self._topic = node, topic.name
        self._receive, self._refuse = receive, refuse
        publishers = GraphPublishers(node.node, topic)
        self._binding = PublisherBinding(topic.name, [sender], publishers)
        node.subscribe_tagged(topic, self._take)

    def _take(self, message: Tagged) -> None:
        fault = self._binding.fault(message.gid, self._node.now_ns(), safe=True)
        if fault is not None:
            if self._binding.bound is not None:
                self._refuse(self._topic, fault)
            return
        try:
            self._receive(read_flag(self._topic, message.payload))
        except InputError as err:
            self._refuse(self._topic, str(err))
