"""Programs of the user's in a controller's place, as those who read from them see them."""

from __future__ import annotations

import time
from collections.abc import Collection

from cspm_msgs_py.ros.contract_node import ContractNode
from cspm_msgs_py.ros.local_name import local
from cspm_msgs_py.ros.rendezvous import SETTLE_S
from cspm_msgs_py.schedule import Schedule


class OwnSenders:
    """Whether all that a node reads from programs of the user's can be sent to it.

    These do not announce themselves, and nobody but they can see whom they reach: what a sender
    that we see sends before it sees us is lost.
    """

    def __init__(
        self,
        node: ContractNode,
        schedule: Schedule,
        own: Collection[str],
        read: Collection[str],
    ) -> None:
        """Look for senders of what a node reads.

        Args:
            node: the node.
            schedule: of the run.
            own: names of the nodes that are programs of the user's.
            read: topics that the node reads.
        """
        self._node = node.node
        sent = {topic for name in own for topic in schedule.nodes[name].outputs}
        self._topics = sorted(sent & {*read})
        self._since: float | None = None

    def ready(self) -> bool:
        """Return whether all senders have been there for half a second."""
        if not all(self._node.count_publishers(local(topic)) for topic in self._topics):
            self._since = None
            return False
        if not self._topics:
            return True
        now = time.monotonic()
        self._since = now if self._since is None else self._since
        return now - self._since >= SETTLE_S
