"""A long import in stretches of time, so that checks of it take bounded memory."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import ceil, inf

import numpy as np

from cspm_checks.pace import STRETCH
from cspm_checks.series import Log, TopicColumns
from cspm_checks.suspicion import Suspicion

LASTING = {
    "velocity",
    "unrelated",
    "power",
    "torque",
    "late",
    "constant",
    "empty",
    "coarse",
    "resolution",
    "smoothed",
    "exchanged",
    "factor",
    "axes",
    "kinematics",
    "hum",
}
"""Kinds that are of the whole recording; a stretch alone may be at rest, or move too little."""


def stretches(messages: Log) -> Iterator[dict[str, TopicColumns]]:
    """Yield the messages of all topics, a stretch of time each; topics without any are left out.

    Args:
        messages: by topic.
    """
    longest = max(messages.values(), key=lambda one: len(one.stamp_ns)).stamp_ns
    count = ceil(len(longest) / STRETCH)
    limits = longest[np.linspace(0, len(longest), count + 1).astype(int)[1:-1]]
    # Where stamps are out of order, each message is in one stretch all the same.
    cuts = {
        name: [
            0,
            *np.maximum.accumulate(np.searchsorted(one.stamp_ns, limits)),
            len(one.stamp_ns),
        ]
        for name, one in messages.items()
    }
    for k in range(count):
        yield {
            name: one.only(slice(cuts[name][k], cuts[name][k + 1]))
            for name, one in messages.items()
            if cuts[name][k + 1] > cuts[name][k]
        }
        for one in messages.values():
            one.release()


def joined(found: Sequence[Sequence[Suspicion]], present: Mapping[str, int]) -> list[Suspicion]:
    """Return the suspicions of stretches, each place and kind once.

    What is of the whole recording has to show in more than half of the stretches.

    Args:
        found: by stretch.
        present: by topic, in how many stretches it has messages.
    """
    if len(found) == 1:
        return list(found[0])
    seen: dict[tuple[str, str, bool], list[list[Suspicion]]] = {}
    for part in found:
        here: dict[tuple[str, str, bool], list[Suspicion]] = {}
        for one in part:
            here.setdefault((one.where, one.kind, _is_lasting(one)), []).append(one)
        for key, some in here.items():
            seen.setdefault(key, []).append(some)
    out = []
    for (where, _, lasting), each in seen.items():
        total = present[where.partition(" ")[0]]
        if not lasting or len(each) > total / 2:
            text = f"; likewise in {len(each)} of {total} stretches of {STRETCH} messages"
            out += [replace(one, text=one.text + text) for one in each[0]]
    return out


def _is_lasting(one: Suspicion) -> bool:
    """Return whether a suspicion is of the whole recording, as that of what never comes near."""
    numbers = one.numbers
    return one.kind in LASTING or numbers.get("largest", inf) < numbers.get("limit", 0.0)
