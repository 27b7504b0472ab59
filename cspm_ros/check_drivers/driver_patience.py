"""How long a start waits for drivers that are there, and why it gives up."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.ros.contract_node import ContractNode
from cspm_msgs_py.ros.local_name import local
from cspm_msgs_py.topics import Topic
from cspm_ros.check_drivers.driver_endpoints import Endpoint, check_publishers
from cspm_ros.check_drivers.graph_endpoints import endpoint_of

# Discovery may show another publisher of the same topic a moment later [s].
_SETTLES_S = 2.0
_HINT = "`cspm check-drivers` lists all"


class DriverPatience:
    """Counts from when all drivers are there; before that somebody may still switch them on."""

    def __init__(
        self,
        node: ContractNode,
        topics: Collection[Topic],
        seconds: float,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Take who looks, the topics that drivers have to send, and how long to wait [s]."""
        self._node, self._topics = node, tuple(topics)
        self._seconds, self._clock = seconds, clock
        self._since: float | None = None

    def look(self, waiting: str, silent: Collection[str]) -> None:
        """Take what the start waits for, empty for nothing, and the topics without a message.

        Raises:
            InputError: no node of the run can hear a driver, or the start takes too long.
        """
        found = {topic.name: self._publishers(topic) for topic in self._topics}
        if not waiting or not all(found.values()):
            self._since = None
            return
        now = self._clock()
        self._since = now if self._since is None else self._since
        passed = now - self._since
        for topic in self._topics:
            if topic.name in silent and passed > min(_SETTLES_S, self._seconds):
                refuse_unheard(topic, found[topic.name])
        if passed > self._seconds:
            raise InputError(
                f"drivers: all are there, and the run did not begin within {self._seconds:g} s:"
                f" {waiting}; allowed: a start within --patience SECONDS; {_HINT}"
            )

    def _publishers(self, topic: Topic) -> list[Endpoint]:
        infos = self._node.node.get_publishers_info_by_topic(local(topic.name))
        return [endpoint_of(info) for info in infos]


def refuse_unheard(topic: Topic, publishers: Collection[Endpoint]) -> None:
    """Refuse publishers of which no message can come, by their type or quality of service.

    Raises:
        InputError: no publisher of the topic can be heard.
    """
    if any(each.ros_type == topic.ros_type and each.reliable for each in publishers):
        return
    types = ", ".join(sorted({each.ros_type for each in publishers}))
    text = f"type {types}, expected {topic.ros_type}"
    for finding in check_publishers(topic, list(publishers)):
        text = finding.text
    raise InputError(f"drivers: {topic.name}: {text}; allowed: as the contract has it; {_HINT}")
