"""Commands that meet a ROS 2 graph: node, replay, check-drivers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cspm.cli.app import RUN_FAILED, Json, app
from cspm.cli.shared_options import COMMAND
from cspm_msgs_py.errors import InputError

_Machine = Annotated[
    str, typer.Argument(metavar="TESTBED", help="A machine of the library, or its file.")
]
_NewFile = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="A new file; without it to standard output."),
]


@app.command(
    add_help_option=False,
    context_settings={"allow_extra_args": True, "ignore_unknown_options": True},
    epilog="""Examples:

cspm node plant --ros-args -p scenario:=calm

cspm node recorder --ros-args -p scenario:=calm -p folder:=calm_run""",
)
def node(context: typer.Context) -> None:
    """Run one node of the ROS 2 graph. Such as plant, wave_trajectory or motion_controller.

    Everything it needs to know are ROS 2 parameters; `--ros-args --params-file FILE` reads them.
    `cspm node plant --help` prints this as well.
    """
    name, *rest = context.args or ["--help"]
    if {"--help", "-h"} & {name, *rest}:
        typer.echo(context.get_help())
        raise typer.Exit(0)
    COMMAND.set(f"{context.command_path} {name}")
    from cspm.cli.node_program import run_program

    raise typer.Exit(run_program(name, rest))


@app.command(
    epilog="""Examples:

cspm replay recordings/calm-20260131-120000 --rate 0.5

cspm replay lab.db3 --topics /bar/pose --topics /cables/tension --remap /bar/pose=/mocap/pose

cspm replay recordings/calm-20260131-120000 --through force_controller

Keys in a terminal: space pauses, s or → plays one instant, + and - change the rate, q ends.

Exit code: 0 played, and identical where nodes were fed; 1 different or interrupted; 2 unusable
input."""
)
def replay(
    bag: Annotated[
        Path,
        typer.Argument(
            metavar="REC",
            help="A rosbag2 folder, an .mcap or .db3 file, or a ROS 1 .bag.",
        ),
    ],
    rate: Annotated[
        float | None,
        typer.Option(
            metavar="NUMBER",
            help="Times real time, 1 unless given; with --through otherwise 0, which is as fast as"
            " the nodes are.",
        ),
    ] = None,
    topics: Annotated[
        list[str] | None,
        typer.Option(
            "--topics",
            metavar="TOPIC",
            help="Play only this topic, and the clock; may be repeated.",
        ),
    ] = None,
    left_out: Annotated[
        list[str] | None,
        typer.Option("--except", metavar="TOPIC", help="Do not play this topic; may be repeated."),
    ] = None,
    start: Annotated[
        float, typer.Option(metavar="SECONDS", help="Begin so many seconds into the bag.")
    ] = 0.0,
    duration: Annotated[
        float | None, typer.Option(metavar="SECONDS", help="Play so many seconds of the bag.")
    ] = None,
    paused: Annotated[bool, typer.Option("--paused", help="Begin paused.")] = False,
    remap: Annotated[
        list[str] | None,
        typer.Option(metavar="OLD=NEW", help="Play a topic under another name; may be repeated."),
    ] = None,
    through: Annotated[
        str | None,
        typer.Option(
            metavar="NODES",
            help="Feed these nodes in step and compare what they send with the recording, bit for"
            " bit: all, or names with commas, such as motion_controller,force_controller.",
        ),
    ] = None,
    overrides: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="With --through: replace a value of the recorded scenario; may be repeated.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER", help="With --through: a new folder to record the outcome in."
        ),
    ] = None,
    json: Json = None,
) -> None:
    """Play a recording to the ROS 2 graph. With /clock, or through nodes to compare commands.

    The services /player/pause (std_srvs/SetBool) and /player/step (std_srvs/Trigger) steer it too.
    """
    from cspm.commands.replay_command import replay_command
    from cspm.replaying import ReplayRequest
    from cspm_ros.replay.bag_selection import Selection

    names = dict(_pair(text) for text in remap or ())
    selection = Selection(topics or (), left_out or (), start, duration, names)
    nodes = through.split(",") if through is not None else ()
    request = ReplayRequest(bag, selection, rate, paused, nodes, overrides or (), out)
    raise typer.Exit(0 if replay_command(request, json) else RUN_FAILED)


def _pair(text: str) -> tuple[str, str]:
    old, separator, new = text.partition("=")
    if not separator:
        raise InputError(f"--remap {text}: allowed: OLD=NEW, such as /bar/pose=/mocap/pose")
    return old, new


@app.command(
    epilog="""Examples:

cspm check-drivers --scenario calm

cspm check-drivers --testbed lab.yaml --for 20 --json drivers.json

cspm check-drivers --testbed lab.yaml --pull all

Exit code: 0 nothing wrong, 1 an error or interrupted, 2 unusable input."""
)
def check_drivers(
    testbed: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The machine's test-bed file; usual rates."),
    ] = None,
    scenario: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Instead: a scenario's name or file, for its test-bed, rates and safe state.",
        ),
    ] = None,
    seconds: Annotated[
        float,
        typer.Option("--for", metavar="SECONDS", help="How long to listen, and to pull."),
    ] = 5.0,
    pull: Annotated[
        str | None,
        typer.Option(
            metavar="CABLES",
            help="Afterwards the guided pull test, which finds swapped cables and inverted signs:"
            " all, or names with commas. Needs a terminal.",
        ),
    ] = None,
    sim_time: Annotated[
        bool, typer.Option("--sim-time", help="The stamps follow /clock, not the wall clock.")
    ] = False,
    overrides: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="Replace a value of the scenario, such as rates.winches=500; may be repeated.",
        ),
    ] = None,
    json: Json = None,
) -> None:
    """Listen to drivers, and judge them. Say what fits neither machine nor contract.

    Per topic: type, quality of service, names, rate, jitter, stamps, units, signs; and whether the
    topics agree with each other and with the machine's geometry. A bar that moves shows more.
    """
    from cspm.commands.check_drivers_command import check_drivers_command
    from cspm.drivers import machine_of

    machine = machine_of(scenario, testbed, overrides or ())
    fine = check_drivers_command(machine, seconds, sim_time=sim_time, pull=pull, json=json)
    raise typer.Exit(0 if fine else RUN_FAILED)


@app.command(
    epilog="""Examples:

cspm inject sensor_frozen --on /bar/pose --for 0.5

cspm inject winch_weak --on surge_2 --amount 0.5

cspm inject cable_cut --on hoist_1

cspm inject node_killed --on force_controller

Exit code: 0 the run has it, 1 no answer, 2 unusable input, 130 interrupted."""
)
def inject(
    fault: Annotated[
        str,
        typer.Argument(
            metavar="FAULT",
            help="sensor_frozen, sensor_noisy, sensor_biased, sensor_late, sensor_dropped,"
            " winch_weak, cable_cut, brake or node_killed.",
        ),
    ],
    on: Annotated[
        str,
        typer.Option(metavar="NAME", help="What fails: a measured topic, a cable, or a node."),
    ] = "",
    amount: Annotated[
        float | None,
        typer.Option(
            metavar="NUMBER",
            help="Noise or bias in the sensor's unit, lateness in s, or the share of torque left.",
        ),
    ] = None,
    lasts: Annotated[
        float | None,
        typer.Option("--for", metavar="SECONDS", help="How long; without it to the run's end."),
    ] = None,
    json: Json = None,
) -> None:
    """Let a part fail in a real-time run. It is under way, and you see what the rest does.

    Faults are recorded in /diagnostics. A scenario's `faults:` has them at given times, in every
    mode.
    """
    from cspm.commands.inject_command import inject_command

    inject_command(fault, on, amount, lasts, json)


@app.command(
    epilog="""Examples:

cspm urdf thesis > thesis.urdf

cspm urdf lab.yaml --out lab.urdf

Exit code: 0 done, 2 unusable input, 130 interrupted."""
)
def urdf(
    testbed: _Machine,
    out: _NewFile = None,
) -> None:
    """Write a machine as URDF. For robot_state_publisher, RViz, Foxglove and ros2_control.

    Its joints are the winches, named as in /winches/state. Bar, target and winch frame are joints
    of the type floating: their poses come on topics, not from angles.
    """
    from cspm.commands.urdf_command import urdf_command

    urdf_command(testbed, out)


@app.command(
    epilog="""Examples:

cspm mjcf fitted/fitted_testbed.yaml --out joints.xml

Then, in a model of MuJoCo: <include file="joints.xml"/>, and <joint class="NAME" …/>."""
)
def mjcf(
    testbed: _Machine,
    out: _NewFile = None,
    json: Json = None,
) -> None:
    """Write winches as joints of MuJoCo. Armature, damping and friction loss, as identified.

    A default class for each, which your model includes. What MuJoCo's joints do not have, such as
    friction that grows with load, is named in comments.
    """
    from cspm.commands.urdf_command import mjcf_command

    mjcf_command(testbed, out, json)
