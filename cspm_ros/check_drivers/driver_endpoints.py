"""Whether publishers and subscriptions, as discovery announces them, fit the contract's nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cspm_msgs_py.topics import BRAKE, CLOCK, Topic
from cspm_ros.check_drivers.driver_observation import Finding


@dataclass(frozen=True)
class Endpoint:
    """A publisher or a subscription.

    Attributes:
        node: the node that has it, with its namespace.
        ros_type: of its messages.
        reliable: whether it offers, or requests, reliable transport.
        transient_local: whether it keeps messages for, or requests those from before, its time.
    """

    node: str
    ros_type: str
    reliable: bool = True
    transient_local: bool = False


def check_publishers(topic: Topic, publishers: Sequence[Endpoint]) -> list[Finding]:
    """Judge the quality of service of a measured topic's publishers."""
    fitting = [each for each in publishers if each.ros_type == topic.ros_type]
    unheard = [each for each in fitting if not each.reliable]
    if unheard:
        text = f"best effort (from {_nodes(unheard)}), expected reliable: no controller hears it"
        return [Finding(topic.name, "qos", False, text)]
    return [Finding(topic.name, "qos", True, f"reliable, from {_nodes(fitting)}")] * bool(fitting)


def check_torque_command(
    topic: Topic, publishers: Sequence[Endpoint], subscriptions: Sequence[Endpoint]
) -> list[Finding]:
    """Judge who hears the torque command, and who gives it.

    Args:
        topic: the torque command.
        publishers: of it.
        subscriptions: to it, of all but this project's recorder.
    """
    findings = _misfits(topic, subscriptions)
    hearers = [each for each in subscriptions if _hears(topic, each)]
    if hearers:
        findings.append(Finding(topic.name, "hearers", True, f"heard by {_nodes(hearers)}"))
    elif not findings:
        text = f"nobody hears it, expected: the drives ({topic.ros_type})"
        findings.append(Finding(topic.name, "hearers", False, text))
    if len(publishers) > 1:
        text = f"{len(publishers)} publishers ({_nodes(publishers)}), expected at most 1"
        return [*findings, Finding(topic.name, "publishers", False, text)]
    text = f"given by {_nodes(publishers)}" if publishers else "nobody gives it now"
    return [*findings, Finding(topic.name, "publishers", True, text)]


def check_brake(subscriptions: Sequence[Endpoint], *, needed: bool) -> list[Finding]:
    """Judge who hears the brake command; `needed` says whether the safe state relies on it."""
    findings = _misfits(BRAKE, subscriptions)
    hearers = [each for each in subscriptions if _hears(BRAKE, each)]
    if hearers:
        return [*findings, Finding(BRAKE.name, "hearers", True, f"heard by {_nodes(hearers)}")]
    text = "nobody hears it, but the scenario's safe state is brake"
    if not needed:
        text = "nobody hears it; the safe state hold needs no brakes"
    return findings or [Finding(BRAKE.name, "hearers", not needed, text)]


def check_clock(ticks: int, publishers: Sequence[Endpoint], *, wanted: bool) -> list[Finding]:
    """Judge `/clock`, of which `ticks` messages came, against whether stamps are to follow it."""
    if not wanted:
        text = f"given by {_nodes(publishers)}: do the stamps follow it? then check with --sim-time"
        return [Finding(CLOCK.name, "ticks", None, text)] * bool(publishers)
    if ticks:
        return [Finding(CLOCK.name, "ticks", True, f"{ticks} messages, from {_nodes(publishers)}")]
    text = "no messages, expected with --sim-time; stamps are compared with this computer's clock"
    return [Finding(CLOCK.name, "ticks", False, text)]


def _misfits(topic: Topic, subscriptions: Sequence[Endpoint]) -> list[Finding]:
    findings = []
    for each in subscriptions:
        if each.ros_type != topic.ros_type:
            text = f"{each.node} expects {each.ros_type}, sent is {topic.ros_type}"
            findings.append(Finding(topic.name, "type", False, text))
        elif each.transient_local:
            text = f"{each.node} requests transient local, expected volatile: it hears nothing"
            findings.append(Finding(topic.name, "qos", False, text))
    return findings


def _hears(topic: Topic, subscription: Endpoint) -> bool:
    return subscription.ros_type == topic.ros_type and not subscription.transient_local


def _nodes(endpoints: Sequence[Endpoint]) -> str:
    return ", ".join(sorted({each.node for each in endpoints})) or "nobody"
