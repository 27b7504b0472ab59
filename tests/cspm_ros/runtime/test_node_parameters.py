"""Parameters say in their descriptions what is allowed, and refuse the rest in the same words."""

import pytest

pytest.importorskip("rclpy")
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter

from cspm_msgs_py.errors import InputError
from cspm_ros.runtime.node_parameters import NodeParameters, read_parameters
from cspm_ros.runtime.stall_watchdog import LEAST_PATIENCE_S


@pytest.fixture
def node_with():
    """Make nodes that are started with parameters."""
    context = Context()
    context.init(args=[])
    nodes = []

    def make(**values):
        given = [Parameter(name, value=value) for name, value in values.items()]
        nodes.append(Node("settings", context=context, parameter_overrides=given))
        return nodes[-1]

    yield make
    for node in nodes:
        node.destroy_node()
    context.shutdown()


@pytest.mark.parametrize(
    ("name", "constraints"),
    [
        ("pace", "allowed: lockstep, realtime"),
        ("steps", "allowed: 0 or more"),
        ("priority", "allowed: 0 to 99"),
        ("patience", f"allowed: {LEAST_PATIENCE_S} or more"),
        ("folder", ""),
    ],
)
def test_a_parameter_describes_what_is_allowed(node_with, name, constraints):
    node = node_with()
    assert read_parameters(node) == NodeParameters()
    described = node.describe_parameter(name)
    assert described.additional_constraints == constraints
    assert described.description


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("pace", "fast", "lockstep, realtime"),
        ("steps", -1, "0 or more"),
        ("patience", 0.0, f"{LEAST_PATIENCE_S} or more"),
        ("patience", float("inf"), f"{LEAST_PATIENCE_S} or more"),
    ],
)
def test_a_value_that_is_not_allowed_is_refused(node_with, name, value, allowed):
    with pytest.raises(InputError) as refused:
        read_parameters(node_with(**{name: value}))
    assert str(refused.value) == f"parameter {name}: {value}, allowed: {allowed}"


def test_a_value_at_the_edge_is_taken(node_with):
    taken = read_parameters(node_with(pace="realtime", steps=0, patience=LEAST_PATIENCE_S))
    assert (taken.pace, taken.steps, taken.patience) == ("realtime", 0, LEAST_PATIENCE_S)
