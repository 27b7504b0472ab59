"""Times of reception on the ROS clock, where messages on `/clock` run it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

LEAST_TICKS = 2


def on_ros_clock(
    samples: Sequence[tuple[int, bytes]], ticks: Sequence[tuple[int, int]]
) -> list[tuple[int, bytes]]:
    """Return messages with their time of reception on the ROS clock instead of the wall's.

    Between two ticks time passes evenly; what came before the first or after the last is left out.

    Args:
        samples: wall time of reception [ns], and the message's bytes.
        ticks: wall time of reception [ns], and the time that the clock showed [ns]; at least
            `LEAST_TICKS` of them, in order of reception.
    """
    walls, times = np.array(ticks, dtype=np.int64).T
    inside = [sample for sample in samples if walls[0] <= sample[0] <= walls[-1]]
    received = np.array([wall for wall, _ in inside], dtype=np.int64)
    # Differences, since a float64 resolves today's nanoseconds to 256 only.
    passed = np.interp(received - walls[0], walls - walls[0], times - times[0])
    on_clock = times[0] + np.round(passed).astype(np.int64)
    return [(ns, payload) for ns, (_, payload) in zip(on_clock.tolist(), inside, strict=True)]
