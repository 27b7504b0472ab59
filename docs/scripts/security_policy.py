"""The policy of SROS2 for the graph: what each node may send, read and offer, and no more.

Run `python docs/scripts/security_policy.py` after a change of topics or services. It starts the
graph in lockstep and in real time, asks ROS 2 what each node has, and writes
`launch/security/policy.xml`, which `ros2 security generate_artifacts` turns into enclaves.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias
from xml.etree import ElementTree as ET

from cspm_msgs_py.graph import NODES, PLAYER, VIEWER
from cspm_msgs_py.ros.session import Session

POLICY = Path(__file__).resolve().parents[2] / "launch" / "security" / "policy.xml"
DOMAIN = 94
_VERSION = "0.2.0"
# Slow and patient: only names are wanted.
_RATES = (
    "rates={plant: 200, winches: 200, load_cells: 200, motion_capture: 100, wave_trajectory: 100,"
    " motion_controller: 100, tension_distribution: 100, force_controller: 200}"
)
_SETTINGS = (_RATES, "safety.stale_after=2", "safety.watchdog=2", "safety.lateness=2")
# Simulated [s]. In lockstep a second takes a fifth of one, and nodes need some to find each other.
_DURATIONS = {"graph": 30, "realtime": 8}
# What a rule allows, by what ROS 2 calls it: the element, its entries, and the attribute.
_RULES = {
    "publishers": ("topics", "topic", "publish"),
    "subscribers": ("topics", "topic", "subscribe"),
    "services": ("services", "service", "reply"),
    "clients": ("services", "service", "request"),
}
Endpoints: TypeAlias = dict[str, dict[str, set[str]]]
"""Names of topics and services by node and by the keys of `_RULES`."""


def endpoints(mode: str, domain: int = DOMAIN) -> Endpoints:
    """Return what the nodes of a run have while it lasts, and the viewer beside it."""
    found: Endpoints = defaultdict(lambda: defaultdict(set))
    environment = os.environ | {"ROS_DOMAIN_ID": str(domain)}
    with tempfile.TemporaryDirectory() as place, Session(domain_id=domain) as session:
        settings = [word for each in _SETTINGS for word in ("--set", each)]
        settings += ["--set", f"duration={_DURATIONS[mode]}"]
        run = ["run", "rest", "--mode", mode, "--quiet", "--out", f"{place}/run", *settings]
        # A secured graph is not rehearsed.
        run += ["--anyway"] if mode == "realtime" else []
        view = ["node", VIEWER, "--ros-args", "-p", "scenario:=rest"]
        cspm = [sys.executable, "-m", "cspm"]
        node = session.node("policy_writer").node
        with subprocess.Popen([*cspm, *view], env=environment) as viewer:
            running = subprocess.Popen([*cspm, *run], env=environment)
            session.every(0.05, lambda: _look(node, found))
            session.spin_until(lambda: running.poll() is not None or session.stopped)
            viewer.send_signal(2)
    return found


def _look(node: Any, found: Endpoints) -> None:  # noqa: ANN401 - rclpy's node
    """Add what is there now."""
    asked: dict[str, Callable[[str, str], list[tuple[str, list[str]]]]] = {
        "publishers": node.get_publisher_names_and_types_by_node,
        "subscribers": node.get_subscriber_names_and_types_by_node,
        "services": node.get_service_names_and_types_by_node,
        "clients": node.get_client_names_and_types_by_node,
    }
    for name, namespace in node.get_node_names_and_namespaces():
        if name in NODES:
            for kind, ask in asked.items():
                found[name][kind] |= {each for each, _ in ask(name, namespace)}


def policy(found: Endpoints) -> str:
    """Return the policy: an enclave `/cspm/NODE` for each node."""
    root = ET.Element("policy", version=_VERSION)
    enclaves = ET.SubElement(root, "enclaves")
    for name in [each for each in NODES if each in found]:
        enclave = ET.SubElement(enclaves, "enclave", path=f"/cspm/{name}")
        profile = ET.SubElement(ET.SubElement(enclave, "profiles"), "profile", ns="/", node=name)
        for kind, (group, entry, verb) in _RULES.items():
            if found[name][kind]:
                rule = ET.SubElement(profile, group, {verb: "ALLOW"})
                for each in sorted(found[name][kind]):
                    ET.SubElement(rule, entry).text = each
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def allowed(text: str) -> Endpoints:
    """Return what a policy allows; the reverse of `policy`."""
    found: Endpoints = defaultdict(lambda: defaultdict(set))
    for profile in ET.fromstring(text).iter("profile"):
        for kind, (group, entry, verb) in _RULES.items():
            for rule in profile.findall(group):
                if rule.get(verb) == "ALLOW":
                    names = [each.text or "" for each in rule.findall(entry)]
                    found[profile.attrib["node"]][kind] |= set(names)
    return found


def merged(*parts: Endpoints) -> Endpoints:
    """Return what any of several runs had."""
    found: Endpoints = defaultdict(lambda: defaultdict(set))
    for part in parts:
        for name, kinds in part.items():
            for kind, names in kinds.items():
                found[name][kind] |= names
    return found


def main() -> None:
    """Write the policy of both ways to run. A player is started by hand, and has none."""
    assert PLAYER in NODES
    POLICY.parent.mkdir(exist_ok=True)
    POLICY.write_text(policy(merged(endpoints("graph"), endpoints("realtime"))))


if __name__ == "__main__":
    main()
