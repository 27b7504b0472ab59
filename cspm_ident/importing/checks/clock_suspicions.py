"""What looks wrong between the clocks of an import."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

from cspm_ident.importing.checks.pace import Pace
from cspm_ident.importing.checks.suspicion import Suspicion
from cspm_ident.importing.topic_messages import TopicMessages
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.message import NANOSECONDS

ROUNDED = 0.01
"""Of a step: then rounding of times is seen in every derivative."""


def message_suspicions(
    messages: TopicMessages, pace: Pace, unmeasured: list[str]
) -> list[Suspicion]:
    """Return how the messages of a topic were made of other than what they should be.

    Args:
        messages: the topic.
        pace: of its stamps.
        unmeasured: its fields that nobody measured.
    """
    name, found = messages.topic.name, []
    unset = max((one.times.unset for one in messages.series.values() if one.times), default=0)
    if unset:
        text = f"{unset} stamps were never set (0) and are repaired from the time of the log"
        found.append(Suspicion(name, "unset", text, {"count": float(unset)}))
    rounded = max((one.times.rounded_s for one in messages.series.values() if one.times), default=0)
    step = pace.step_s[1] if pace.step_s else 0.0
    if rounded > ROUNDED * step > 0.0:
        text = f"times were stored in single precision, rounded to {rounded:.3g} s"
        found.append(Suspicion(name, "single", text, {"rounded": rounded}))
    for part, count in messages.late_parts.items():
        text = f"{part} is missing in the first {count} messages, which are kept"
        found.append(Suspicion(name, "late_part", text, {"count": float(count)}))
    if unmeasured:
        text = f"nothing measures {', '.join(unmeasured)}: recorded as NaN"
        found.append(Suspicion(name, "unmeasured", text))
    if (near := messages.tolerance) is not None:
        text = f"stamps of one message differ by up to {near.largest_s:.6g} s, within the tolerance"
        text += f" of {near.allowed_s:.6g} s; the message has that of {near.stamped_by}"
        numbers = {"largest": near.largest_s, "tolerance": near.allowed_s}
        found.append(Suspicion(name, "paired", text, numbers))
    return found


def overlap_suspicions(messages: Mapping[str, TopicMessages]) -> list[Suspicion]:
    """Return between which topics, in order of time, lies a time when none was recorded."""
    found = []
    for (end, earlier), (start, later) in _breaks(messages):
        apart = (start - end) / NANOSECONDS
        text = f"begins {apart:.6g} s after the end of {earlier}: two clocks?"
        found.append(Suspicion(later, "overlap", text, {"apart": apart}))
    return found


def refuse_two_clocks(messages: Mapping[str, TopicMessages], where: str) -> None:
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
    messages: Mapping[str, TopicMessages],
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
