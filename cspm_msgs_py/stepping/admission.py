"""Which messages of a topic count in real time: by their publisher and by their stamp."""

from __future__ import annotations

from cspm_msgs_py.stepping.publisher_binding import PublisherBinding

# How far a stamp may be ahead of the receiver's clock [ns]: clocks of a laboratory that are kept by
# chrony agree within a few ms, and 50 ms is the age at which an input is stale by default.
AHEAD_NS = 50_000_000


class Admission:
    """Admits messages of one publisher whose stamps go on and are not in the future.

    Attributes:
        stamp_ns: of the last message that was admitted [ns], None before the first.
    """

    def __init__(self, topic: str, binding: PublisherBinding | None = None) -> None:
        """Take the topic's name, and to whom it is bound; None: whoever sends."""
        self._topic, self.binding = topic, binding
        self.stamp_ns: int | None = None

    def fault(
        self, stamp_ns: int, now_ns: int, gid: bytes | None = None, *, safe: bool = False
    ) -> str | None:
        """Take a message; return why it does not count, None if it does.

        While the winches are in their safe state a clock that went back counts as one that was
        restarted.

        Args:
            stamp_ns: its stamp [ns].
            now_ns: the present instant on the same clock [ns].
            gid: identity of its publisher, None if unknown.
            safe: whether the winches are in their safe state.
        """
        binding, before = self.binding, self.stamp_ns
        if binding is not None and (strange := binding.fault(gid, now_ns, safe=safe)):
            return strange
        if stamp_ns > now_ns + AHEAD_NS:
            return (
                f"{self._topic}: stamp {(stamp_ns - now_ns) * 1e-9:.3f} s in the future, allowed:"
                f" {AHEAD_NS * 1e-9:g} s"
            )
        if before is not None and stamp_ns < before and not safe:
            return (
                f"{self._topic}: stamp went back from {before * 1e-9:.3f} s to"
                f" {stamp_ns * 1e-9:.3f} s: a restarted clock or a second sender"
            )
        self.stamp_ns = stamp_ns
        return None
