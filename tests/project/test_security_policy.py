"""The policy that is shipped: what the graph needs, and nothing beyond it."""

from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from ros_graph import load_ros, new_domain
from run_samples import bundle_of

load_ros()

from cspm_msgs_py.graph import RECORDER, graph_of  # noqa: E402
from cspm_msgs_py.schedule import PLANT, schedule_of  # noqa: E402
from cspm_msgs_py.topics import DIAGNOSTICS, SCENE  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "docs" / "scripts" / "security_policy.py"
POLICY = ROOT / "launch" / "security" / "policy.xml"


@pytest.fixture(scope="module")
def script(loaded):
    return loaded(SCRIPT)


@pytest.fixture(scope="module")
def shipped(script):
    return script.allowed(POLICY.read_text())


@pytest.fixture(scope="module")
def edges():
    bundle = bundle_of("rest")
    schedule = schedule_of(bundle.scenario, bundle.testbed.testbed)
    return graph_of(schedule, (PLANT, *schedule.nodes, RECORDER))


def test_senders_and_readers_of_the_schedule_may_do_so(shipped, edges):
    """The schedule is the independent road to what the script saw."""
    for topic, edge in edges.items():
        for sender in edge.senders:
            assert topic in shipped[sender]["publishers"], (topic, sender)
        for reader in edge.readers:
            assert topic in shipped[reader]["subscribers"], (topic, reader)


def test_nobody_else_may_send_what_the_run_obeys(shipped, edges):
    for topic, edge in edges.items():
        if topic != DIAGNOSTICS.name:
            senders = {node for node in shipped if topic in shipped[node]["publishers"]}
            assert senders == set(edge.senders), topic
    assert "*" not in POLICY.read_text()


def test_the_viewer_sends_to_viewers_alone(shipped):
    own = {name for name in shipped["viewer"]["publishers"] if name not in SCENE}
    assert own <= {"/rosout", "/parameter_events"}


def test_what_real_time_has_besides_is_allowed_too(shipped):
    assert "/bar/goal" in shipped["wave_trajectory"]["subscribers"]
    offered = {"plant": ("reset", "start", "stop"), "wave_trajectory": ("home",)}
    for node, services in offered.items():
        for service in services:
            assert f"/{node}/{service}" in shipped[node]["services"]


def test_each_node_has_an_enclave_of_its_own():
    enclaves = list(ET.parse(POLICY).getroot().iter("enclave"))
    nodes = [enclave.find("profiles/profile").get("node") for enclave in enclaves]
    assert [enclave.get("path") for enclave in enclaves] == [f"/cspm/{node}" for node in nodes]
    assert len(set(nodes)) == len(nodes)


def test_a_policy_is_read_as_it_is_written(script, shipped):
    again = script.allowed(script.policy(shipped))
    for node in {*again, *shipped}:
        kinds = {*again[node], *shipped[node]}
        assert all(again[node][kind] == shipped[node][kind] for kind in kinds)


@pytest.mark.slow
def test_a_live_graph_has_no_more_than_it_may(script, shipped):
    found = script.endpoints("graph", new_domain())
    assert {PLANT, RECORDER, "force_controller"} <= set(found)
    for node, kinds in found.items():
        for kind, names in kinds.items():
            assert names <= shipped[node][kind], (node, kind)
