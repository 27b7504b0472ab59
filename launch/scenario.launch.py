"""Start the nodes of one scenario, each in a process; all of them end when the plant does.

ros2 launch cspm scenario.launch.py scenario:=calm pace:=realtime record:=/tmp/calm
ros2 launch cspm scenario.launch.py scenario:=calm duration:=10 overrides:="seed=2 sensors=ideal"
ros2 launch cspm scenario.launch.py scenario:=calm_measured_target target:=measured
"""

import shlex
from datetime import datetime
from pathlib import Path
from typing import Any

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

EXTERNAL = "external"
PRESCRIBED = "prescribed"
TRACKER = "target_tracker"
VIEWER = "viewer"
OTHERS = (
    "wave_trajectory",
    "motion_controller",
    "tension_distribution",
    "force_controller",
    "recorder",
)


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and, from their values, the nodes."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "scenario", default_value="worst_case", description="a name or a file"
            ),
            DeclareLaunchArgument(
                "pace", default_value="lockstep", choices=["lockstep", "realtime"]
            ),
            DeclareLaunchArgument(
                "plant", default_value="sim", choices=["sim", "mujoco", EXTERNAL]
            ),
            DeclareLaunchArgument(
                "target",
                default_value=PRESCRIBED,
                choices=[PRESCRIBED, "measured", EXTERNAL],
                description="as the scenario's target.source; its tracker is a node of its own",
            ),
            DeclareLaunchArgument(
                "record",
                default_value="",
                description="a new folder; empty for recordings/SCENARIO-DATE-TIME",
            ),
            DeclareLaunchArgument(
                "patience",
                default_value="30.0",
                description="lockstep: give up when nothing moves for so long, s",
            ),
            DeclareLaunchArgument(
                "duration", default_value="", description="of the run, s; empty: the scenario's"
            ),
            DeclareLaunchArgument(
                "overrides",
                default_value="",
                description="values put over the scenario's, key.path=value, with spaces between",
            ),
            DeclareLaunchArgument(
                "viewer",
                default_value="false",
                choices=["true", "false"],
                description="send frames and markers to RViz and Foxglove as well",
            ),
            OpaqueFunction(function=nodes),
        ]
    )


def nodes(context: LaunchContext) -> list[Node]:
    """Return the nodes that the arguments ask for; an external plant is not ours to start."""
    scenario, pace, plant, target, record, patience = (
        LaunchConfiguration(name).perform(context)
        for name in ("scenario", "pace", "plant", "target", "record", "patience")
    )
    others = OTHERS if target == PRESCRIBED else (TRACKER, *OTHERS)
    if LaunchConfiguration("viewer").perform(context) == "true":
        others = (*others, VIEWER)
    dated = f"recordings/{Path(scenario).stem}-{datetime.now():%Y%m%d-%H%M%S}"
    # Launch reads texts as YAML, so that the nodes get a number.
    parameters: dict[str, Any] = {
        "scenario": scenario,
        "pace": pace,
        "folder": record or dated,
        "patience": patience,
    }
    duration, overrides = (
        LaunchConfiguration(name).perform(context) for name in ("duration", "overrides")
    )
    # Of an empty list ROS 2 knows no type.
    if changed := overrides_of(duration, overrides):
        parameters["overrides"] = changed
    if plant == EXTERNAL:
        return [node(name, parameters) for name in others]
    parameters["plant"] = plant
    plant_node = node("plant", parameters, on_exit=Shutdown(reason="the plant has ended"))
    return [plant_node, *(node(name, parameters) for name in others)]


def overrides_of(duration: str, overrides: str) -> list[str]:
    """Return the nodes' overrides: those given, quoted as in a shell, and the duration [s]."""
    return shlex.split(overrides) + [f"duration={duration}"] * bool(duration)


def node(name: str, parameters: dict[str, Any], **options: Shutdown) -> Node:
    """Return a node of this package in a process of its own."""
    return Node(
        package="cspm", executable=name, parameters=[parameters], output="screen", **options
    )
