"""A node's settings as ROS 2 parameters."""

from __future__ import annotations

import math
from dataclasses import Field, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.exceptions import InvalidParameterTypeException
from rclpy.node import Node

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.graph import PLAYER, RECORDER
from cspm_msgs_py.recording.run_record import SIM
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.schedule import PLANT, Schedule
from cspm_msgs_py.testbed import load_testbed
from cspm_msgs_py.yaml_file import dump_yaml
from cspm_ros.runtime.stall_watchdog import LEAST_PATIENCE_S, PATIENCE_S
from cspm_run.assembly import resolve
from cspm_run.bundle import Bundle, make_bundle
from cspm_run.library import find_scenario
from cspm_run.plants import PLANTS
from cspm_run.recorded_bundle import recorded_bundle

LOCKSTEP, REALTIME = "lockstep", "realtime"
# The mode of a run in lockstep with a process per node.
PROCESSES = "processes"
# Slow enough for a bar that goes as far as the thesis's machine reaches.
GOAL_S = 10.0


def _value(
    default: object, text: str, *choices: str, least: float | None = None, most: float = math.inf
) -> Any:  # noqa: ANN401 - a dataclass field
    limits = {"least": least, "most": most}
    return field(default=default, metadata={"text": text, "choices": choices, **limits})


@dataclass(frozen=True)
class NodeParameters:
    """One node's parameters; empty text and zero stand for the scenario's own."""

    scenario: str = _value("worst_case", "a scenario's name, or a scenario file")
    overrides: tuple[str, ...] = _value((), "values put over the scenario's, key.path=value")
    pace: str = _value(LOCKSTEP, "what paces the run: the schedule or the wall", LOCKSTEP, REALTIME)
    plant: str = _value(SIM, "whose equations the plant node simulates", *PLANTS)
    nodes: tuple[str, ...] = _value((), "the nodes of this run; empty: all, and the recorder")
    own_nodes: tuple[str, ...] = _value((), "lockstep: those of the nodes that are your programs")
    steps: int = _value(0, "end after so many plant steps; 0: the scenario's duration", least=0)
    folder: str = _value("", "recorder: a new folder for the recording")
    mode: str = _value("", "recorder: the mode named in the recording; empty: as paced")
    report: str = _value("", "plant or leader: a file that it keeps up to date with how far it is")
    patience: float = _value(
        PATIENCE_S,
        "give up when nothing moves for so long, once the run is under way [s]",
        least=LEAST_PATIENCE_S,
    )
    start_on_call: bool = _value(
        False, "real time, leader: begin only once somebody calls its service ~/start"
    )
    priority: int = _value(
        0, "real time: SCHED_FIFO priority, with locked memory; 0: ordinary", least=0, most=99
    )
    goal_duration: float = _value(
        GOAL_S, "real time, wave_trajectory: how long the bar takes to a goal [s]", least=0.1
    )
    goal_sender: str = _value(
        "", "real time, wave_trajectory: the node whose goals count; empty: the first to publish"
    )
    until_stdin_closes: bool = _value(False, "stop when standard input is closed")
    bag: str = _value("", "player: what to play; others: a recording that names the scenario")
    rate: float = _value(1.0, "player: bag time per wall time; 0, in lockstep: as nodes can")
    topics: tuple[str, ...] = _value((), "player: only these topics, and the clock")
    left_out: tuple[str, ...] = _value((), "player: all topics but these")
    start: float = _value(0.0, "player: where in the bag to begin [s]")
    paused: bool = _value(False, "player: whether to begin paused")
    lockstep: bool = _value(False, "player: take the plant's place in a run in lockstep")

    @property
    def recorded_mode(self) -> str:
        """The mode that a recording of this run names."""
        return self.mode or (REALTIME if self.pace == REALTIME else PROCESSES)

    @property
    def recording_folder(self) -> Path:
        """The folder that a recorder fills; unless given, one named after the scenario."""
        return Path(self.folder or f"recordings/{self.bundle().scenario.name}")

    def bundle(self) -> Bundle:
        """Return the run's description, resolved.

        Raises:
            InputError: no such scenario or recording, or one that cannot be used.
        """
        if self.bag:
            return recorded_bundle(Path(self.bag), self.overrides)
        path = find_scenario(self.scenario)
        scenario = load_scenario(path, self.overrides)
        testbed = load_testbed(path.parent / scenario.testbed)
        resolved = resolve(scenario, testbed.testbed, path.parent)
        bundle = make_bundle(resolved, testbed, path.parent)
        return replace(bundle, plant=self.plant)

    def members(self, schedule: Schedule) -> tuple[str, ...]:
        """Return the nodes of this run.

        Raises:
            InputError: a name that is no node of this scenario.
        """
        leader = PLAYER if PLAYER in self.nodes else PLANT
        possible = (leader, *schedule.nodes, RECORDER)
        unknown = [name for name in self.nodes if name not in possible]
        if unknown:
            raise InputError(f"nodes: {', '.join(unknown)}, allowed: {', '.join(possible)}")
        return tuple(name for name in possible if name in self.nodes) if self.nodes else possible

    def own_of(self, schedule: Schedule) -> tuple[str, ...]:
        """Return the nodes of this run that are programs of the user's.

        Raises:
            InputError: one is no controller of this run.
        """
        possible = [name for name in schedule.nodes if name in self.members(schedule)]
        unknown = [name for name in self.own_nodes if name not in possible]
        if unknown:
            raise InputError(f"own_nodes: {', '.join(unknown)}, allowed: {', '.join(possible)}")
        return self.own_nodes


def read_parameters(node: Node) -> NodeParameters:
    """Declare the parameters on a node and return their values.

    Raises:
        InputError: a parameter has another type, or a value that is not allowed.
    """
    found = {}
    for each in fields(NodeParameters):
        found[each.name] = value = _declare(node, each)
        choices, least, most = (each.metadata[key] for key in ("choices", "least", "most"))
        outside = choices and value not in choices
        if outside or (least is not None and not (least <= value <= most and value < math.inf)):
            raise InputError(f"parameter {each.name}: {value}, allowed: {_allowed(each)}")
    return NodeParameters(**found)


def _allowed(each: Field[Any]) -> str:
    """Return a parameter's choices or range in words, empty if it has neither."""
    choices, least, most = (each.metadata[key] for key in ("choices", "least", "most"))
    if choices or least is None:
        return ", ".join(choices)
    return f"{least} or more" if most == math.inf else f"{least} to {most}"


def _declare(node: Node, each: Field[Any]) -> Any:  # noqa: ANN401 - of the field's type
    """Declare a parameter and return its value."""
    default, text = each.default, each.metadata["text"]
    # ROS 2 knows no type of an empty list, and takes no whole number for another.
    several, real = isinstance(default, tuple), isinstance(default, float)
    # In words: of a range broken at the start, ROS 2 would say neither where nor what is allowed.
    constraints = f"allowed: {allowed}" if (allowed := _allowed(each)) else ""
    descriptor = ParameterDescriptor(
        description=text, additional_constraints=constraints, read_only=True, dynamic_typing=real
    )
    try:
        declared = node.declare_parameter(each.name, [""] if several else default, descriptor)
    except InvalidParameterTypeException:
        value = None
    else:
        value = declared.value
        if several:
            return tuple(item for item in value or () if item)
        if real and isinstance(value, int) and not isinstance(value, bool):
            return float(value)
    if type(value) is not type(default):
        shown = ["…"] if several else default
        raise InputError(
            f"parameter {each.name}: of the wrong type, allowed: like {shown!r} ({text})"
        )
    return value


def write_parameters(path: Path, parameters: NodeParameters) -> None:
    """Write a ROS 2 parameter file with these parameters for all nodes."""
    parameters_by_name = {
        each.name: list(value) if isinstance(value, tuple) else value
        for each in fields(NodeParameters)
        if (value := getattr(parameters, each.name)) != each.default
    }
    path.write_text(dump_yaml({"/**": {"ros__parameters": parameters_by_name}}), encoding="utf-8")
