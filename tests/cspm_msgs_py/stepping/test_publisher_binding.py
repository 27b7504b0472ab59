"""Whose messages of a topic count: those of the one publisher that a run is bound to."""

import pytest

from cspm_msgs_py.stepping.publisher_binding import NOT_YET_NAMED, SILENT_NS, PublisherBinding

A, B, C = b"a" * 16, b"b" * 16, b"c" * 16
TOPIC = "/bar/pose"


class Graph:
    """Publishers that come and go."""

    def __init__(self, **nodes):
        self.nodes = {name.encode() * 16: node for name, node in nodes.items()}

    def __call__(self):
        return dict(self.nodes)


def binding(graph, *senders):
    return PublisherBinding(TOPIC, senders, graph)


def test_it_binds_to_the_only_publisher_whoever_that_is():
    made = binding(Graph(a="camera"))
    assert made.missing() == ""
    assert made.bound == A
    assert made.fault(A, 0) is None
    assert made.fault(B, 0) == (
        f"{TOPIC}: a second publisher, of an unknown node, allowed: that of camera alone"
    )


def test_a_stranger_is_named_once_its_name_is_known():
    graph = Graph(a="camera", b=NOT_YET_NAMED)
    made = binding(graph, "camera")
    assert made.fault(A, 0) is None
    assert "of an unknown node, allowed" in made.fault(B, 0)
    graph.nodes[B] = "shouter"
    assert "of shouter, allowed" in made.fault(B, 0)


def test_without_a_publisher_or_with_two_it_is_bound_to_none():
    graph = Graph()
    made = binding(graph)
    assert made.missing() == f"a publisher of {TOPIC}"
    graph.nodes = {A: "camera", B: "other"}
    assert made.missing() == f"one publisher of {TOPIC} instead of 2 (camera, other)"
    assert made.bound is None
    assert made.fault(A, 0) == (
        f"{TOPIC}: not bound to a publisher, waits for one publisher of {TOPIC} instead of 2"
        " (camera, other)"
    )
    graph.nodes = {B: "other"}
    assert made.fault(B, 0) is None
    assert made.bound == B


def test_a_node_of_the_run_is_known_by_its_name_whoever_else_is_there():
    graph = Graph(a="stranger")
    made = binding(graph, "plant")
    assert made.missing() == f"a publisher of {TOPIC} by plant"
    graph.nodes[B] = "plant"
    assert made.missing() == ""
    assert made.fault(B, 0) is None
    assert made.fault(A, 0) == (
        f"{TOPIC}: a second publisher, of stranger, allowed: that of plant alone"
    )


def test_two_nodes_of_the_name_are_one_too_many():
    assert "instead of 2 (plant, plant)" in binding(Graph(a="plant", b="plant"), "plant").missing()


@pytest.mark.parametrize(
    ("safe", "silent_ns", "name", "taken"),
    [
        (True, SILENT_NS + 1, "plant", True),
        (False, SILENT_NS + 1, "plant", False),
        (True, SILENT_NS, "plant", False),
        (True, SILENT_NS + 1, "stranger", False),
    ],
)
def test_in_the_safe_state_another_may_take_the_place_of_one_that_is_silent(
    safe, silent_ns, name, taken
):
    graph = Graph(a="plant")
    made = binding(graph, "plant")
    assert made.fault(A, 1_000) is None
    graph.nodes[C] = name
    fault = made.fault(C, 1_000 + silent_ns, safe=safe)
    assert (fault is None) == taken
    assert (made.bound == C) == taken
    assert (made.fault(A, 1_001 + silent_ns, safe=safe) is None) != taken


def test_where_identities_are_unknown_one_publisher_is_believed_and_two_are_not():
    graph = Graph(a="camera")
    made = binding(graph)
    assert made.missing() == ""
    assert made.fault(None, 0) is None
    graph.nodes[B] = "other"
    assert made.fault(None, 0) == (
        f"{TOPIC}: waits for one publisher of {TOPIC} instead of 2 (camera, other)"
    )


@pytest.mark.parametrize("early", [{}, {A: NOT_YET_NAMED}])
def test_a_sender_is_no_stranger_before_its_name_is_there(early):
    graph = Graph()
    graph.nodes = dict(early)
    made = binding(graph, "plant")
    assert "not bound" in made.fault(A, 0)
    assert made.fault_if_known(A, 0, begun=True) is None
    graph.nodes = {A: "plant"}
    assert made.fault_if_known(A, 0, begun=True) is None
    assert made.bound == A
    # From then on a sender without a name is one.
    assert made.fault_if_known(B, 0, begun=True) == (
        f"{TOPIC}: a second publisher, of an unknown node, allowed: that of plant alone"
    )


def test_a_named_stranger_is_one_from_the_start_of_the_run_on():
    made = binding(Graph(a="stranger"), "plant")
    assert made.fault_if_known(A, 0, begun=False) is None
    assert made.fault_if_known(A, 0, begun=True) == (
        f"{TOPIC}: not bound to a publisher, waits for a publisher of {TOPIC} by plant"
    )


def test_who_is_bound_may_have_left():
    graph = Graph(a="camera")
    made = binding(graph)
    assert not made.left
    assert made.fault(A, 0) is None
    assert not made.left
    graph.nodes = {B: "other"}
    assert made.left
