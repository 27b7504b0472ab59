"""Quality of service of every topic, from the contract's table."""

from __future__ import annotations

from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy

from cspm_msgs_py.topics import QOS_DEPTH, QOS_RELIABILITY


def contract_qos(depth: int = QOS_DEPTH, *, reliability: str = QOS_RELIABILITY) -> QoSProfile:
    """Return the profile of the contract's topics: reliable, keep last `depth`.

    A reader with `reliability` "best_effort" also hears publishers that offer no more.
    """
    return QoSProfile(
        depth=depth,
        history=HistoryPolicy.KEEP_LAST,
        reliability=ReliabilityPolicy[reliability.upper()],
    )
