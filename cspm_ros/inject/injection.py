"""Putting a fault into a run: through the plant's parameter, or by the end of a node's process."""

from __future__ import annotations

import os
import signal
import socket
from pathlib import Path
from typing import Any

from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.client import Client

from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.graph import NODES
from cspm_msgs_py.ros.local_name import local
from cspm_msgs_py.ros.session import Session
from cspm_msgs_py.scenario_keys.faults import Fault
from cspm_msgs_py.schedule import PLANT
from cspm_msgs_py.yaml_file import dump_yaml
from cspm_ros.inject.fault_port import NAME

PROCESS = "process"
"""The parameter by which each node in a process of its own says host and number of it."""
# Nodes that are late in everything are late to answer.
_FINDING_S, _ANSWER_S, _ATTEMPTS = 10.0, 1.0, 10


def process_name() -> str:
    """Return host and number of this process."""
    return f"{socket.gethostname()}:{os.getpid()}"


def inject(fault: Fault, *, domain_id: int | None = None) -> None:
    """Put a fault into the run in real time in this domain.

    Args:
        fault: what fails, from now on.
        domain_id: instead of `ROS_DOMAIN_ID`.

    Raises:
        InputError: no plant takes faults there, or this machine cannot have this one.
    """
    said = {
        key: value for key, value in fault.model_dump().items() if key in fault.model_fields_set
    }
    value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=dump_yaml(said))
    request = SetParameters.Request(parameters=[Parameter(name=NAME, value=value)])
    with Session(domain_id=domain_id) as session:
        answer = _asked(session, PLANT, SetParameters, "set_parameters", request)
    (result,) = answer.results
    if not result.successful and "not declared" in result.reason:
        raise InputError(
            "the plant takes no faults from outside, allowed: a run in real time; in lockstep a"
            " scenario with faults:"
        )
    if not result.successful:
        raise InputError(str(result.reason).removeprefix(f"{NAME}: "))


def kill_node(name: str, *, domain_id: int | None = None) -> int:
    """End a node's process at once, as a crash does; return its number.

    Raises:
        InputError: no such node, one without a process of its own, or one on another host.
    """
    if name not in NODES:
        raise InputError(f"on {name or 'nothing'}, allowed: {', '.join(NODES)}")
    request = GetParameters.Request(names=[PROCESS])
    with Session(domain_id=domain_id) as session:
        answer = _asked(session, name, GetParameters, "get_parameters", request)
    found = answer.values[0].string_value if answer.values else ""
    host, _, number = found.rpartition(":")
    if not number.isdigit():
        raise InputError(
            f"{name} has no process of its own, allowed: nodes started by hand or by --mode"
            " processes"
        )
    if host != socket.gethostname():
        raise InputError(f"{name} runs on {host}, allowed: this host, {socket.gethostname()}")
    return _kill(name, int(number))


def _kill(name: str, number: int) -> int:
    """Kill a process that is one of ours, whatever a stranger says."""
    try:
        if "_rclpy" not in Path(f"/proc/{number}/maps").read_text():
            raise InputError(f"{name}: process {number} runs no ROS 2 node in Python")
        os.kill(number, signal.SIGKILL)
    except OSError as err:
        raise InputError(f"{name}: process {number} cannot be ended ({err.strerror})") from None
    return number


def _asked(session: Session, name: str, kind: Any, service: str, request: Any) -> Any:  # noqa: ANN401
    """Return a node's answer to a request of its parameters' services.

    Before it, empty ones are sent until one is answered: an answer to somebody whom the node does
    not know yet is lost, and the request itself must not be made twice.

    Raises:
        InputError: no such node.
        CspmError: it does not answer, or a signal came.
    """
    node = session.node("inject").node
    client = node.create_client(kind, local(f"/{name}/{service}"))
    if not session.spin_until(client.service_is_ready, _FINDING_S):
        domain = node.context.get_domain_id()
        raise InputError(
            f"no node {name} in ROS domain {domain}, allowed: while a run is under way"
        )
    for each, times in ((kind.Request(), _ATTEMPTS), (request, 1)):
        answer = _answered(session, client, each, times)
        if answer is None:
            raise CspmError(f"{name} does not answer within {_ATTEMPTS * _ANSWER_S:g} s")
    return answer


def _answered(session: Session, client: Client, request: Any, times: int) -> Any:  # noqa: ANN401
    """Return the answer to a request that is made so often at most, None if there is none."""
    for _ in range(times):
        future = client.call_async(request)
        if session.spin_until(future.done, _ANSWER_S * _ATTEMPTS / times):
            return future.result()
        client.remove_pending_request(future)
    return None
