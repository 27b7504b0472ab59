"""All that looks wrong in the topics of a recording."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_checks.acceleration import acceleration_suspicions
from cspm_checks.channel import Channel
from cspm_checks.clocks import overlap_suspicions
from cspm_checks.hum import hum_suspicions
from cspm_checks.machine.attitude import attitude_suspicions
from cspm_checks.machine.machine_suspicions import machine_suspicions
from cspm_checks.machine.misfit import winding
from cspm_checks.machine.pose_lateness import comparable, pose_lateness
from cspm_checks.machine.poses import poses_of
from cspm_checks.outlier_suspicions import outlier_suspicions
from cspm_checks.pace import pace_of
from cspm_checks.relations import relation_suspicions
from cspm_checks.series import Log, TopicColumns, series_of
from cspm_checks.stretches import joined, stretches
from cspm_checks.stuck import frozen_suspicions, held_frames
from cspm_checks.suspicion import Suspicion
from cspm_checks.time_suspicions import held_suspicions, time_suspicions
from cspm_checks.value_suspicions import quaternion_suspicions, value_suspicions
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.topics import POSE

Array = NDArray[np.float64]
_TENSION, _POSES = "/cables/tension", ("/bar/pose", "/winch_frame/pose", "/target/pose")
_HELD_SAMPLE = 100_000
_UNJUDGED = (
    "whether poses are late against the winches cannot be said: too short, too little motion,"
    " or lengths that the test-bed's geometry does not explain"
)


class Look(NamedTuple):
    """What was found.

    Attributes:
        suspicions: what looks wrong.
        unjudged: what could not be judged, and why.
    """

    suspicions: list[Suspicion]
    unjudged: list[str]


def look_at(log: Log, testbed: Testbed, origin_ns: int, factors: Mapping[str, float]) -> Look:
    """Return all that looks wrong in the topics of a recording, and what could not be judged.

    Args:
        log: the topics.
        testbed: the machine.
        origin_ns: the instant from which times count [ns].
        factors: SI per number of the source, by topic and field; 1 where there is none.
    """
    alone, together, present = [], [], Counter[str]()
    judged = not comparable(log, testbed)
    for part in stretches(log):
        present.update(part.keys())
        alone.append(
            [one for each in part.values() for one in _fields(each, testbed, origin_ns, factors)]
        )
        seen = winding(part, testbed, origin_ns) if comparable(part, testbed) else None
        poses = None if seen is None else pose_lateness(seen)
        judged = judged or poses is not None
        together.append(
            relation_suspicions(part, testbed, poses, origin_ns)
            + machine_suspicions(part, testbed, seen, origin_ns)
        )
    of_machine = joined(together, present)
    misread = {one.where for one in of_machine if one.kind == "axes"}
    # Poses that are read wrongly may seem to jump.
    of_fields = [
        one for one in joined(alone, present) if one.kind != "attitude" or one.where not in misread
    ]
    found: list[Suspicion] = []
    for name, columns in log.items():
        found += _of_topic(columns, testbed, origin_ns)
        found += [one for one in of_fields if one.where.partition(" ")[0] == name]
    found += overlap_suspicions(log)
    return Look(found + of_machine, [] if judged else [_UNJUDGED])


def _of_topic(columns: TopicColumns, testbed: Testbed, origin_ns: int) -> list[Suspicion]:
    """Return what looks wrong in a topic as a whole."""
    name = columns.topic.name
    sensor = testbed.sensors.get(name)
    pace = pace_of(columns.stamp_ns, origin_ns)
    found = time_suspicions(name, columns.stamp_ns, pace, sensor.rate if sensor else None)
    head = columns.rows(slice(_HELD_SAMPLE))
    found += _held(columns, head)
    if "qw" in columns.topic.fields:
        quaternions = head[:, POSE.index("qx") : POSE.index("qw") + 1]
        found += quaternion_suspicions(name, quaternions)
    return found


def _held(columns: TopicColumns, head: Array) -> list[Suspicion]:
    """Return whether the topic, or else a part of a JointState, was filled up to its rate."""
    name, parts = columns.topic.name, columns.topic.parts
    found = held_suspicions(name, head)
    if found or len(parts) < 2:
        return found
    joints = len(columns.topic.joint_names)
    for i, part in enumerate(parts):
        found += held_suspicions(f"{name} {part}", head[:, i * joints : (i + 1) * joints])
    return found


def _frozen(columns: TopicColumns, origin_ns: int) -> list[Suspicion]:
    """Return where load cells, each for itself, or a pose stand still."""
    name = columns.topic.name
    seconds = np.asarray((columns.stamp_ns - origin_ns) * 1e-9, dtype=np.float64)
    if name == _TENSION:
        series = [(f"{name} {one}", columns.values(one)[:, None]) for one in columns.measured]
    else:
        series = [(name, columns.rows(slice(None)))]
    found = [one for where, rows in series for one in frozen_suspicions(where, rows, seconds)]
    return found + (held_frames(*series[0], seconds) if name in _POSES else [])


def _fields(
    columns: TopicColumns, testbed: Testbed, origin_ns: int, factors: Mapping[str, float]
) -> list[Suspicion]:
    """Return what looks wrong in the numbers of a topic."""
    topic = columns.topic
    found = _frozen(columns, origin_ns) if topic.name in (_TENSION, *_POSES) else []
    if topic.name in _POSES:
        found += attitude_suspicions(topic.name, poses_of(columns, origin_ns))
    for field in columns.measured:
        channel = Channel(topic, field, factors.get(f"{topic.name} {field}", 1.0))
        values = columns.values(field)
        found += value_suspicions(channel, values, testbed)
        found += acceleration_suspicions(channel, series_of(columns, field, origin_ns), testbed)
        found += outlier_suspicions(channel, values, columns.stamp_ns, origin_ns)
        if field.startswith("effort/"):
            found += hum_suspicions(channel, series_of(columns, field, origin_ns))
    return found
