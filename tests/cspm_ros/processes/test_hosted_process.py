"""Nodes that a host forks: their ends, and the host's own."""

import os
import signal
import time

import psutil
import pytest
from ros_graph import load_ros, words_of

load_ros()

from cspm_msgs_py.schedule import PLANT  # noqa: E402 - after ROS is known to be there
from cspm_ros.processes.hosted_process import HOST_LOG, NodeHost  # noqa: E402

LONG_S = 120.0


@pytest.fixture
def parameters(tmp_path):
    """Let a plant wait for its controllers for ever."""
    path = tmp_path / "parameters.yaml"
    path.write_text("/**:\n  ros__parameters: {scenario: rest, patience: 600.0}\n")
    return path


def started(node, host):
    """Wait until a node has its process."""
    while node.pid is None and node.poll() is None:
        host.read(LONG_S)
    return psutil.Process(node.pid)


def wait_until(holds):
    """Wait for a condition; fail where it does not come."""
    end = time.monotonic() + LONG_S
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_a_node_that_refuses_ends_with_its_exit_code_and_says_why(parameters, tmp_path):
    host = NodeHost(("pump",), parameters, tmp_path)
    try:
        assert host.nodes["pump"].wait(LONG_S)
    finally:
        host.close()
    assert host.nodes["pump"].returncode == 2
    assert "cspm node pump: allowed: plant," in (tmp_path / "pump.log").read_text()


def test_a_node_ends_by_its_own_signal(parameters, tmp_path):
    host = NodeHost((PLANT,), parameters, tmp_path)
    node = host.nodes[PLANT]
    try:
        process = started(node, host)
        wanted = ["cspm_ros.runtime.node_main", PLANT]
        wait_until(lambda: words_of(process)[2:4] == wanted)
        assert os.getsid(node.pid) == node.pid
        assert not node.wait(0.01)
        node.send_signal(signal.SIGKILL)
        assert node.wait(LONG_S)
    finally:
        host.close()
    assert node.returncode == -signal.SIGKILL


def test_nodes_that_have_not_started_end_with_their_host(parameters, tmp_path):
    host = NodeHost((PLANT,), parameters, tmp_path)
    host.nodes[PLANT].send_signal(signal.SIGINT)
    try:
        assert host.nodes[PLANT].wait(LONG_S)
    finally:
        host.close()
    assert host.nodes[PLANT].returncode == -signal.SIGTERM
    assert (tmp_path / HOST_LOG).read_text() == ""


def test_a_host_that_is_killed_leaves_no_node_behind(parameters, tmp_path):
    host = NodeHost((PLANT,), parameters, tmp_path)
    try:
        process = started(host.nodes[PLANT], host)
        os.kill(process.ppid(), signal.SIGKILL)
        assert host.nodes[PLANT].wait(LONG_S)
        process.wait(LONG_S)
    finally:
        host.close()
    assert host.nodes[PLANT].returncode == -signal.SIGKILL


def test_closed_standard_input_ends_the_nodes(parameters, tmp_path):
    parameters.write_text(parameters.read_text().replace("}", ", until_stdin_closes: true}"))
    host = NodeHost((PLANT,), parameters, tmp_path)
    process = started(host.nodes[PLANT], host)
    host.close()
    process.wait(LONG_S)
