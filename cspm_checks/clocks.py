"""Topics that have no instant in common: two clocks."""

from __future__ import annotations

from itertools import pairwise

from cspm_checks.series import Log
from cspm_checks.suspicion import Suspicion
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.message import NANOSECONDS


def overlap_suspicions(messages: Log) -> list[Suspicion]:
    """Return between which topics, in order of time, lies a time when none was recorded."""
    found = []
    for (end, earlier), (start, later) in _breaks(messages):
        apart = (start - end) / NANOSECONDS
        text = f"begins {apart:.6g} s after the end of {earlier}: two clocks?"
        found.append(Suspicion(later, "overlap", text, {"apart": apart}))
    return found


def refuse_two_clocks(messages: Log, where: str) -> None:
    """Refuse topics that lie farther apart than the longest of them lasts.

    Raises:
        InputError: naming both, and what brings them together.
    """
    longest = max(int(one.stamp_ns.max() - one.stamp_ns.min()) for one in messages.values())
    for (end, earlier), (start, later) in _breaks(messages):
        if start - end > longest:
            raise InputError(
                f"{where}: {later} begins {(start - end) / NANOSECONDS:.6g} s after the end of"
                f" {earlier}, and neither lasts that long: two clocks, allowed: topics that"
                " overlap; `stamp: log` in a bag, or `offset` or `points` of one clock"
            )


def _breaks(
    messages: Log,
) -> list[tuple[tuple[int, str], tuple[int, str]]]:
    """Return end and start, each with its topic, of what no topic bridges."""
    spans = sorted(
        (int(one.stamp_ns.min()), int(one.stamp_ns.max()), name) for name, one in messages.items()
    )
    found, (_, end, last) = [], spans[0]
    for _, (start, until, name) in pairwise(spans):
        if start > end:
            found.append(((end, last), (start, name)))
        end, last = max((end, last), (until, name))
    return found
