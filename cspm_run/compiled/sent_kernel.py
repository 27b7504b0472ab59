"""Which rows of a block were sent, gathered topic by topic in compiled code."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.uint8]
Words = NDArray[np.int64]

# Columns of `topics`: the job that sends it, its first column and its width.
SENDER, FIRST, WIDTH, COLUMNS = range(4)


@njit(cache=True, nogil=True, _nrt=False)
def gather(
    rows: Array,
    done: Flags,
    by_python: Flags,
    topics: Words,
    steps: int,
    counts: Words,
    found: Words,
    numbers: Array,
) -> None:
    """Gather the messages of the first steps of a block.

    Args:
        rows: signals, (1 + room, width); the first row is that of the step before.
        done: which jobs compiled code did, (room, jobs).
        by_python: which topics Python sent, (room, topics).
        topics: a row per topic, see `SENDER`.
        steps: how many steps count.
        counts: out, messages of each topic, (topics,).
        found: out, their steps in the block, topic after topic, (topics · room,).
        numbers: out, their rows, one after another, of as many numbers as the rows have.
    """
    message = number = 0
    for topic in range(len(topics)):
        sender, first, width = topics[topic, SENDER], topics[topic, FIRST], topics[topic, WIDTH]
        before = message
        for step in range(steps):
            if done[step, sender] or by_python[step, topic]:
                for i in range(width):
                    numbers[number + i] = rows[1 + step, first + i]
                found[message] = step
                number += width
                message += 1
        counts[topic] = message - before
