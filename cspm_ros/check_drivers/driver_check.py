"""Whether drivers speak the contract, judged from what was heard on their topics for some seconds.

Pure: the messages come in, findings go out. A finding's `ok` is None where the messages cannot
decide, or where something is odd that only a person at the machine can judge.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import Rates
from cspm_msgs_py.schedule import RATE_OF_SENSOR
from cspm_msgs_py.sensor_spec import MEASURED
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.topics import Topic
from cspm_msgs_py.wire import WireReader
from cspm_ros.check_drivers.driver_change import check_change, check_finite
from cspm_ros.check_drivers.driver_machine import check_machine
from cspm_ros.check_drivers.driver_observation import Finding, Heard, Observation, hear
from cspm_ros.check_drivers.driver_rest import constant_at_rest, said_at_rest
from cspm_ros.check_drivers.driver_timing import check_timing
from cspm_ros.check_drivers.driver_values import check_units

# What makes a topic's numbers useless for judging other topics.
_SPOILING = ("units", "quaternion")
# Reports why nodes would refuse a message.
_EXPLAINING = ("message", "names", "parts", "finite", "quaternion")
_MOST_HINTS = 3


def check_drivers(
    testbed: Testbed, rates: Rates, observations: Sequence[Observation]
) -> list[Finding]:
    """Judge all measured topics of a machine, each by itself and against the others.

    Args:
        testbed: the machine. Topics of its sensors must be there, other measured ones may.
        rates: the rates that the scenario expects.
        observations: what was heard, of every topic that was seen.

    Raises:
        InputError: an effect of the test-bed is unknown or has wrong parameters.
    """
    seen = {observation.topic_name: observation for observation in observations}
    findings: list[Finding] = []
    heard: dict[str, Heard] = {}
    for name in MEASURED:
        if name not in testbed.topics or not (name in testbed.sensors or name in seen):
            continue
        topic = testbed.topics[name]
        observation = seen.get(name, Observation(name, "", 0))
        rate_hz = getattr(rates, RATE_OF_SENSOR[name])
        found, comparable = _check(topic, rate_hz, observation, testbed)
        findings += [_with_hint(topic, finding, observations, testbed) for finding in found]
        heard |= {name: comparable} if comparable else {}
    resting = constant_at_rest(testbed, heard)
    faulty = {f.topic for f in findings if _spoils(f, resting)}
    findings = [said_at_rest(finding, resting) for finding in findings]
    return findings + check_machine(testbed, heard, faulty)


def _spoils(finding: Finding, resting: frozenset[str]) -> bool:
    """Return whether a topic with this finding cannot serve to judge another."""
    if finding.check == "changes":
        return finding.ok is None and finding.topic not in resting
    return finding.check in _SPOILING and finding.ok is False


def _check(
    topic: Topic, rate_hz: float, observation: Observation, testbed: Testbed
) -> tuple[list[Finding], Heard | None]:
    """Judge one topic; return also what can be compared with others, None if nothing can."""
    findings = _presence(topic, observation)
    if any(f.ok is False and f.check != "publishers" for f in findings):
        return findings, None
    found, more = hear(topic, observation)
    sensor = testbed.sensors.get(topic.name)
    findings += more + check_timing(rate_hz, sensor.delay if sensor else 0.0, found)
    comparable = None
    if len(found.values) > 1:
        findings.append(check_finite(found))
        if findings[-1].ok:
            findings += check_change(found, testbed) + check_units(found, testbed)
            comparable = found.in_order()
    if not any(f.check in _EXPLAINING and f.ok is False for f in findings):
        findings += _refused(topic, observation)
    return findings, comparable


def _refused(topic: Topic, observation: Observation) -> list[Finding]:
    """Return what the nodes would refuse for reasons that no other check has found."""
    reader = WireReader(topic)
    reasons: Counter[str] = Counter()
    for _, payload in observation.samples:
        try:
            reader.decode(payload)
        except InputError as err:
            reasons[str(err).removeprefix(f"{topic.name}: ")] += 1
    if not reasons:
        return []
    count, (reason, _) = sum(reasons.values()), reasons.most_common(1)[0]
    text = f"{count} of {len(observation.samples)} messages would be refused: {reason}"
    return [Finding(topic.name, "message", False, text)]


def _presence(topic: Topic, observation: Observation) -> list[Finding]:
    name, count = topic.name, observation.publishers
    if count == 0 and not observation.samples:
        return [Finding(name, "present", False, f"nobody publishes it, expected {topic.ros_type}")]
    findings = []
    if observation.ros_type and observation.ros_type != topic.ros_type:
        text = f"type {observation.ros_type}, expected {topic.ros_type}"
        findings.append(Finding(name, "type", False, text))
    elif not observation.samples:
        text = "a publisher, but no message; is its driver running, its QoS reliable?"
        findings.append(Finding(name, "present", False, text))
    else:
        findings.append(Finding(name, "present", True, f"{len(observation.samples)} messages"))
    if count > 1:
        text = f"{count} publishers, expected 1: their messages mix"
        findings.append(Finding(name, "publishers", False, text))
    return findings


def _with_hint(
    topic: Topic, finding: Finding, observations: Sequence[Observation], testbed: Testbed
) -> Finding:
    """Name topics of the wanted type that nothing in the contract uses."""
    others = [
        observation.topic_name
        for observation in observations
        if observation.ros_type == topic.ros_type and observation.topic_name not in testbed.topics
    ]
    if finding.check != "present" or finding.ok is not False or not others:
        return finding
    text = f"{finding.text}; of that type there is {', '.join(others[:_MOST_HINTS])}: remap it?"
    return Finding(finding.topic, finding.check, finding.ok, text)
