"""The publishers of a topic as the ROS graph shows them."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping

from rclpy.node import Node
from rclpy.qos import ReliabilityPolicy

from cspm_msgs_py.graph import Edges
from cspm_msgs_py.ros.contract_node import ContractNode
from cspm_msgs_py.ros.local_name import local
from cspm_msgs_py.stepping.publisher_binding import PublisherBinding
from cspm_msgs_py.topics import Topic

# A look takes 50 µs; strangers may make one necessary for every message.
_FRESH_S = 0.02


def bind(node: ContractNode, topic: Topic, edges: Mapping[str, Edges]) -> PublisherBinding:
    """Return what binds a reader in `node` to the topic's sender; `edges` say who that is."""
    senders = edges[topic.name].senders if topic.name in edges else ()
    return PublisherBinding(topic.name, senders, GraphPublishers(node.node, topic))


def census_of(
    node: ContractNode, topics: Collection[Topic], edges: Mapping[str, Edges]
) -> Callable[[], list[str]]:
    """Return what says which of these topics have several publishers, a line each."""
    bindings = [bind(node, topic, edges) for topic in topics]
    return lambda: [text for binding in bindings if (text := binding.excess())]


class GraphPublishers:
    """Returns the publishers of a topic that its readers can hear, node by identity."""

    def __init__(self, node: Node, topic: Topic) -> None:
        """Take the node that looks, and the topic, named as before any remapping."""
        self._node, self._topic = node, topic
        self._found: dict[bytes, str] = {}
        self._looked = -_FRESH_S

    def __call__(self) -> dict[bytes, str]:
        """Return them, not older than 20 ms."""
        now = time.monotonic()
        if now - self._looked >= _FRESH_S:
            self._looked = now
            self._found = {
                bytes(info.endpoint_gid): str(info.node_name)
                for info in self._node.get_publishers_info_by_topic(local(self._topic.name))
                if info.topic_type == self._topic.ros_type
                and info.qos_profile.reliability != ReliabilityPolicy.BEST_EFFORT
            }
        return self._found
