"""Quality of service of every topic, from the contract's table."""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from cspm_msgs_py.topics import QOS_DEPTH, QOS_RELIABILITY


def contract_qos(
    depth: int | None = QOS_DEPTH,
    *,
    reliability: str = QOS_RELIABILITY,
    latched: bool = False,
) -> QoSProfile:
    """Return the profile of the contract's topics: reliable, keep last `depth`, or all if None.

    A reader that keeps all takes no more while it is full; senders then send once more what they
    still have. One that keeps the last ones loses those of a quiet sender to a flood of another's.
    A reader with `reliability` "best_effort" also hears publishers that offer no more. What is
    `latched` is kept for readers who come later.
    """
    return QoSProfile(
        depth=depth or 0,
        history=HistoryPolicy.KEEP_ALL if depth is None else HistoryPolicy.KEEP_LAST,
        reliability=ReliabilityPolicy[reliability.upper()],
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )
