"""Rows of numbers as messages on the wire."""

import numpy as np

from cspm_msgs_py.topics import POSE, contract_topics

COUNT = 5
TOPICS = {
    name: topic
    for name, topic in contract_topics(["a", "bb", "c"], has_bar=True, has_winch_frame=True).items()
    if name != "/diagnostics"
}


def rows_of(topic, seed=0):
    """Return rows that are valid for a topic, shape (COUNT, width)."""
    rows = np.random.default_rng(seed).normal(size=(COUNT, topic.width))
    if topic.fields[: len(POSE)] == POSE:
        rows[:, 3:7] /= np.linalg.norm(rows[:, 3:7], axis=1)[:, None]
    return rows
