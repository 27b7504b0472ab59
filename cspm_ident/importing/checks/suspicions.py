"""All that looks wrong in an import."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from cspm_ident.importing.checks.acceleration import acceleration_suspicions
from cspm_ident.importing.checks.clock_suspicions import message_suspicions, overlap_suspicions
from cspm_ident.importing.checks.outlier_suspicions import (
    mended_suspicions,
    outlier_suspicions,
)
from cspm_ident.importing.checks.pace import pace_of
from cspm_ident.importing.checks.pose_lateness import comparable, pose_lateness
from cspm_ident.importing.checks.relations import relation_suspicions
from cspm_ident.importing.checks.series import series_of
from cspm_ident.importing.checks.stretches import joined, stretches
from cspm_ident.importing.checks.stuck import frozen_suspicions
from cspm_ident.importing.checks.suspicion import Suspicion
from cspm_ident.importing.checks.time_suspicions import held_suspicions, time_suspicions
from cspm_ident.importing.checks.value_suspicions import quaternion_suspicions, value_suspicions
from cspm_ident.importing.gathering import Gathered
from cspm_ident.importing.import_plan import PlannedTopic
from cspm_ident.importing.topic_messages import TopicMessages
from cspm_ident.importing.unwrapping import Unwrapper
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.topics import POSE

Array = NDArray[np.float64]
_SAFE_STEP = 0.25
_TENSION, _POSES = "/cables/tension", ("/bar/pose", "/winch_frame/pose", "/target/pose")
_HELD_SAMPLE = 100_000


_UNJUDGED = (
    "whether poses are late against the winches cannot be said: too short, too little motion,"
    " or lengths that the test-bed's geometry does not explain"
)


def suspicions_of(
    gathered: Gathered, testbed: Testbed, origin_ns: int
) -> tuple[list[Suspicion], list[str]]:
    """Return all that looks wrong, and what could not be judged.

    Args:
        gathered: what was imported.
        testbed: the machine.
        origin_ns: the instant from which times count [ns].
    """
    alone, together, present = [], [], Counter[str]()
    compared = comparable(gathered.messages, testbed)
    judged = not compared
    for messages in stretches(gathered.messages):
        present.update(messages.keys())
        topics = [planned for planned in gathered.topics if planned.topic.name in messages]
        alone.append(
            [one for each in topics for one in _of_stretch(each, messages, testbed, origin_ns)]
        )
        poses = (
            pose_lateness(messages, testbed, origin_ns) if comparable(messages, testbed) else None
        )
        judged = judged or poses is not None
        together.append(relation_suspicions(messages, testbed, poses))
    of_fields = joined(alone, present)
    found: list[Suspicion] = []
    for planned in gathered.topics:
        found += _of_topic(planned, gathered, testbed, origin_ns)
        name = planned.topic.name
        found += [one for one in of_fields if one.where.partition(" ")[0] == name]
    found += overlap_suspicions(gathered.messages)
    return found + joined(together, present), [] if judged else [_UNJUDGED]


def _of_topic(
    planned: PlannedTopic, gathered: Gathered, testbed: Testbed, origin_ns: int
) -> list[Suspicion]:
    """Return what looks wrong in a topic as a whole, and what became of its counters."""
    name = planned.topic.name
    messages, sensor = gathered.messages[name], testbed.sensors.get(name)
    unmeasured = [field.name for field in planned.fields if field.is_unmeasured]
    pace = pace_of(messages.stamp_ns, origin_ns)
    found = message_suspicions(messages, pace, unmeasured)
    found += time_suspicions(name, pace, sensor.rate if sensor else None)
    head = messages.rows(slice(_HELD_SAMPLE))
    found += _held(planned, head)
    if "qw" in planned.topic.fields:
        quaternions = head[:, POSE.index("qx") : POSE.index("qw") + 1]
        found += quaternion_suspicions(name, quaternions)
    for field, unwrapped in gathered.unwrapped[name].items():
        found += _unwrap_suspicions(f"{name} {field}", unwrapped)
    for field, mended in gathered.mended[name].items():
        if (times := messages.series[field].times) is not None:
            seconds = np.asarray((times.stamp_ns - origin_ns) * 1e-9, dtype=np.float64)
            found += mended_suspicions(f"{name} {field}", mended, seconds)
    return found


def _held(planned: PlannedTopic, head: Array) -> list[Suspicion]:
    """Return whether the topic, or else a part of a JointState, was filled up to its rate."""
    name, parts = planned.topic.name, planned.topic.parts
    found = held_suspicions(name, head)
    if found or len(parts) < 2:
        return found
    joints = len(planned.topic.joint_names)
    for i, part in enumerate(parts):
        found += held_suspicions(f"{name} {part}", head[:, i * joints : (i + 1) * joints])
    return found


def _frozen(planned: PlannedTopic, messages: TopicMessages, origin_ns: int) -> list[Suspicion]:
    """Return where load cells, each for itself, or a pose stand still."""
    name = planned.topic.name
    seconds = np.asarray((messages.stamp_ns - origin_ns) * 1e-9, dtype=np.float64)
    if name == _TENSION:
        fields = [field.name for field in planned.fields if not field.is_unmeasured]
        columns = [(f"{name} {field}", messages.values(field)[:, None]) for field in fields]
    else:
        columns = [(name, messages.rows(slice(None)))]
    return [one for where, rows in columns for one in frozen_suspicions(where, rows, seconds)]


def _of_stretch(
    planned: PlannedTopic,
    stretch: Mapping[str, TopicMessages],
    testbed: Testbed,
    origin_ns: int,
) -> list[Suspicion]:
    """Return what looks wrong in the numbers of a topic."""
    name = planned.topic.name
    messages = stretch[name]
    found = _frozen(planned, messages, origin_ns) if name in (_TENSION, *_POSES) else []
    for field in planned.fields:
        if field.conversion is None:
            continue
        values, quantity = messages.values(field.name), field.conversion.quantity
        found += value_suspicions(planned.topic, field.name, quantity, values, testbed)
        series = series_of(messages, field.name, origin_ns)
        found += acceleration_suspicions(planned.topic, field.name, quantity, series, testbed)
        where = f"{name} {field.name}"
        found += outlier_suspicions(where, field, values, messages.stamp_ns, origin_ns)
    return found


def _unwrap_suspicions(where: str, found: Unwrapper) -> list[Suspicion]:
    if found.largest_step <= _SAFE_STEP:
        return []
    text = f"a step of {found.largest_step:.2f} of the counter's range: which way round is a guess"
    return [Suspicion(where, "wrap", text, {"step": found.largest_step})]
