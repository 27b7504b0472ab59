"""All that looks wrong in an import."""

from __future__ import annotations

import numpy as np

from cspm_checks.look import Look, look_at
from cspm_checks.pace import pace_of
from cspm_checks.suspicion import Suspicion
from cspm_ident.importing.gathering import Gathered
from cspm_ident.importing.import_plan import PlannedTopic
from cspm_ident.importing.message_suspicions import mended_suspicions, message_suspicions
from cspm_ident.importing.unwrapping import Unwrapper
from cspm_msgs_py.testbed import Testbed

_SAFE_STEP = 0.25


def suspicions_of(gathered: Gathered, testbed: Testbed, origin_ns: int) -> Look:
    """Return all that looks wrong, and what could not be judged.

    Args:
        gathered: what was imported.
        testbed: the machine.
        origin_ns: the instant from which times count [ns].
    """
    log = {each.topic.name: gathered.messages[each.topic.name] for each in gathered.topics}
    factors = {
        f"{each.topic.name} {field.name}": field.conversion.factor
        for each in gathered.topics
        for field in each.fields
        if field.conversion
    }
    made = [one for each in gathered.topics for one in _of_making(each, gathered, origin_ns)]
    found = look_at(log, testbed, origin_ns, factors)
    return Look(made + found.suspicions, found.unjudged)


def _of_making(planned: PlannedTopic, gathered: Gathered, origin_ns: int) -> list[Suspicion]:
    """Return how messages were made, and what became of counters and of what was mended."""
    name = planned.topic.name
    messages = gathered.messages[name]
    unmeasured = [field.name for field in planned.fields if field.is_unmeasured]
    found = message_suspicions(messages, pace_of(messages.stamp_ns, origin_ns), unmeasured)
    for field, unwrapped in gathered.unwrapped[name].items():
        found += _unwrap_suspicions(f"{name} {field}", unwrapped)
    for field, mended in gathered.mended[name].items():
        if (times := messages.series[field].times) is not None:
            seconds = np.asarray((times.stamp_ns - origin_ns) * 1e-9, dtype=np.float64)
            found += mended_suspicions(f"{name} {field}", mended, seconds)
    return found


def _unwrap_suspicions(where: str, found: Unwrapper) -> list[Suspicion]:
    if found.largest_step <= _SAFE_STEP:
        return []
    text = f"a step of {found.largest_step:.2f} of the counter's range: which way round is a guess"
    return [Suspicion(where, "wrap", text, {"step": found.largest_step})]
