"""Whose messages of a topic count in real time: those of one publisher, known by its identity."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

# While the winches are in their safe state another publisher may take the place of one that has
# been silent for so long [ns]: a driver that was started anew. Ten periods of motion capture.
SILENT_NS = 100_000_000
_MOST_STRANGERS = 100
_UNKNOWN = "an unknown node"
# What ROS names a publisher's node before it has heard of it, which comes apart from its messages.
NOT_YET_NAMED = "_NODE_NAME_UNKNOWN_"

Publishers = Callable[[], Mapping[bytes, str]]


class PublisherBinding:
    """Binds a topic to the one publisher that there is, and refuses all others.

    Attributes:
        bound: the publisher's identity, None before it is known.
    """

    def __init__(self, topic: str, senders: Collection[str], publishers: Publishers) -> None:
        """Take what is bound to whom.

        Args:
            topic: name of the topic.
            senders: nodes of this run that send it; empty: somebody's driver does, of any name.
            publishers: returns the publishers that are there, node by identity.
        """
        self._topic, self._senders, self._publishers = topic, frozenset(senders), publishers
        self.bound: bytes | None = None
        self._node = ""
        self._heard_ns = 0
        self._strangers: dict[bytes, str] = {}

    def missing(self) -> str:
        """Bind if exactly one publisher may send; return what is missing, empty once bound."""
        found = self._candidates()
        if self.bound in found and len(found) == 1:
            return ""
        if len(found) > 1:
            return self.excess()
        if not found:
            by = f" by {' or '.join(sorted(self._senders))}" if self._senders else ""
            return f"a publisher of {self._topic}{by}"
        ((gid, node),) = found.items()
        self._bind(gid, node)
        return ""

    @property
    def left(self) -> bool:
        """Whether the bound publisher is no longer there."""
        return self.bound is not None and self.bound not in self._publishers()

    def excess(self) -> str:
        """Return in one line that several publishers may send, empty if not."""
        found = self._candidates()
        if len(found) < 2:
            return ""
        names = ", ".join(sorted(found.values()))
        return f"one publisher of {self._topic} instead of {len(found)} ({names})"

    def _candidates(self) -> dict[bytes, str]:
        return {gid: node for gid, node in self._publishers().items() if self._may_send(node)}

    def fault(self, gid: bytes | None, now_ns: int, *, safe: bool = False) -> str | None:
        """Return why a message does not count, None if it does.

        Args:
            gid: identity of its publisher; None where the middleware gives none: then messages
                count while there is one publisher.
            now_ns: the present instant [ns].
            safe: whether one that fell silent may be replaced, as in the winches' safe state.
        """
        if gid is not None and gid == self.bound:
            self._heard_ns = now_ns
            return None
        if gid is None:
            return self._anonymous_fault()
        if self.bound is None:
            return self._unbound_fault(gid, now_ns)
        if safe and now_ns - self._heard_ns > SILENT_NS and self._take_over(gid):
            self._heard_ns = now_ns
            return None
        return self._stranger(gid)

    def fault_if_known(
        self, gid: bytes | None, now_ns: int, *, begun: bool, safe: bool = False
    ) -> str | None:
        """Return `fault`; None while nobody is bound and it is not known whose a message is.

        Before the run who is missing is reported by its leader, and messages of a node come before
        its name does.

        Args:
            gid: identity of its publisher, see `fault`.
            now_ns: the present instant [ns].
            begun: whether the run has begun.
            safe: whether the winches are in their safe state.
        """
        found = self.fault(gid, now_ns, safe=safe)
        known = self.bound is not None or (begun and self._is_named(gid))
        return found if known else None

    def _is_named(self, gid: bytes | None) -> bool:
        return gid is None or self._publishers().get(gid, NOT_YET_NAMED) != NOT_YET_NAMED

    def _may_send(self, node: str) -> bool:
        return not self._senders or node in self._senders

    def _bind(self, gid: bytes, node: str) -> None:
        self.bound, self._node = gid, node
        self._strangers.pop(gid, None)

    def _take_over(self, gid: bytes) -> bool:
        node = self._candidates().get(gid)
        if node is None:
            return False
        self._bind(gid, node)
        return True

    def _unbound_fault(self, gid: bytes, now_ns: int) -> str | None:
        missing = self.missing()
        if self.bound == gid:
            self._heard_ns = now_ns
            return None
        return f"{self._topic}: not bound to a publisher, waits for {missing}"

    def _anonymous_fault(self) -> str | None:
        missing = "" if self.bound is None else self.missing()
        return f"{self._topic}: waits for {missing}" if missing else None

    def _stranger(self, gid: bytes) -> str:
        found = self._strangers.get(gid)
        if found is None:
            node = self._publishers().get(gid, NOT_YET_NAMED)
            named = node != NOT_YET_NAMED
            found = (
                f"{self._topic}: a second publisher, of {node if named else _UNKNOWN}, "
                f"allowed: that of {self._node} alone"
            )
            if named and len(self._strangers) < _MOST_STRANGERS:
                self._strangers[gid] = found
        return found
