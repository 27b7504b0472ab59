"""What an import did to the messages of a topic, and what it could not know."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_checks.outlier_suspicions import SHOWN_SIZES, at_instants
from cspm_checks.pace import Pace
from cspm_checks.suspicion import Suspicion
from cspm_ident.importing.mending import Mended
from cspm_ident.importing.topic_messages import TopicMessages

Array = NDArray[np.float64]
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
    unlike = max(
        (one.times.unlike_log_s for one in messages.series.values() if one.times), default=0
    )
    if unlike:
        text = f"stamps of the headers and times of the log disagree by up to {unlike:.3g} s"
        mend = {name: {"clock": {"stamp": "log"}}}
        found.append(Suspicion(name, "unlike_log", text, {"largest": unlike}, mend=mend))
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


def mended_suspicions(where: str, mended: Mended, seconds: Array) -> list[Suspicion]:
    """Return what was mended in a channel as asked; `seconds` are those of its rows, (n,)."""
    found = []
    if len(mended.masked):
        text = f"{len(mended.masked)} samples were masked"
        found.append(at_instants(where, "mended", text, seconds[mended.masked]))
    if len(mended.joined):
        sizes = ", ".join(f"{size:+.6g}" for size in mended.sizes[:SHOWN_SIZES])
        text = f"{len(mended.joined)} steps were taken out, {sizes}"
        found.append(at_instants(where, "mended", text, seconds[mended.joined]))
    return found
