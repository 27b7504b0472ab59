"""The plant node's parameter `fault`: setting it puts a fault into the run."""

from __future__ import annotations

from collections.abc import Sequence

from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario_keys.faults import KINDS, Fault
from cspm_msgs_py.yaml_file import parse_yaml, validate
from cspm_sim.faults import Faults

NAME = "fault"
_TEXT = (
    "put a fault into the run, in YAML, such as {fault: sensor_frozen, on: /bar/pose, lasts: 0.5}"
)


class FaultPort:
    """Takes faults from whoever sets the parameter, by `cspm inject` or `ros2 param set`."""

    def __init__(self, node: Node, faults: Faults) -> None:
        """Declare the parameter."""
        self._faults = faults
        allowed = f"fault: {', '.join(KINDS)}"
        descriptor = ParameterDescriptor(description=_TEXT, additional_constraints=allowed)
        node.declare_parameter(NAME, "", descriptor, ignore_override=True)
        node.add_on_set_parameters_callback(self._set)

    def _set(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        try:
            for each in parameters:
                if each.name == NAME:
                    content = parse_yaml(str(each.value), NAME)
                    self._faults.put(validate(Fault, content, NAME), NAME)
        except InputError as err:
            return SetParametersResult(successful=False, reason=" ".join(str(err).split()))
        return SetParametersResult(successful=True)
