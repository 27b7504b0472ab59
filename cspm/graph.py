"""What meets a ROS 2 graph: replaying bags, running a node, checking drivers.

    from cspm import graph

    graph.replay("calm_30", through="force_controller").identical
    graph.check_drivers(testbed="lab.yaml").ok

ROS 2 is loaded when a function needs it; without it `InputError` says what to install. The
environment chooses the graph, by `ROS_DOMAIN_ID`. It reaches no further than this computer unless
`ROS_AUTOMATIC_DISCOVERY_RANGE` says otherwise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from cspm.drivers import DriverReport as DriverReport
from cspm.drivers import listened, listener_to, machine_of
from cspm.progress import Progress, silent
from cspm.recorded import AnyRecording, path_of
from cspm.replaying import Replay as Replay
from cspm.replaying import ReplayRequest, opened, played
from cspm.scenario import AnyScenario
from cspm.summary_files import finish_recording
from cspm.testbed import AnyTestbed
from cspm_ros.replay.bag_selection import Selection
from cspm_ros.replay.player import Player
from cspm_ros.runtime.node_main import start_node

__all__ = ["DriverReport", "Replay", "check_drivers", "replay", "run_node"]


def replay(
    recording: AnyRecording,
    *,
    rate: float | None = None,
    start: float = 0.0,
    duration: float | None = None,
    topics: Sequence[str] = (),
    left_out: Sequence[str] = (),
    remap: Mapping[str, str] | None = None,
    through: str | Sequence[str] = (),
    overrides: Sequence[str] = (),
    out: str | Path | None = None,
    progress: Progress = silent,
) -> Replay:
    """Play a bag to the graph, or through nodes to compare what they send: `cspm replay`.

    Args:
        recording: a `Recording`, or the path of a bag, of others too; see `docs/how-to/replay.md`.
        rate: bag time per wall time, 0.001 to 1000; None for 1. Through nodes also 0, as fast as
            they compute, which None means there.
        start: seconds into the bag at which playing begins [s].
        duration: seconds of the bag to play [s]; None to its end.
        topics: only these, and the clock; none for all.
        left_out: all but these.
        remap: new names of topics, by the bag's.
        through: nodes of the recorded scenario, names or `all`: they are fed in this process, and
            what they send is compared with the recording.
        overrides: values that replace the recorded scenario's for those nodes, such as
            `control.force.gains.hoist_1.kp=0.5`.
        out: a new folder to record the output of those nodes in.
        progress: called some 20 times a second with the share that is done and what is being done.

    Raises:
        InputError: a bag or an option that cannot be used.
        CspmError: the replay through nodes stalled.

    Examples:
        >>> from cspm import graph
        >>> graph.replay("calm_30", through="all").identical  # doctest: +SKIP
        True
    """
    request = ReplayRequest(
        bag=path_of(recording),
        selection=Selection(topics, left_out, start, duration, remap or {}),
        rate=rate,
        through=through.split(",") if isinstance(through, str) else through,
        overrides=overrides,
        out=None if out is None else Path(out),
    )
    with opened(request) as bag:
        return played(bag, request, _shown(request.selection.span_ns(bag), progress))


def run_node(name: str, args: Sequence[str] = ()) -> None:
    """Run one node of the graph until its run ends or a signal comes: `cspm node`.

    Args:
        name: `plant`, `wave_trajectory`, `motion_controller`, `tension_distribution`,
            `force_controller`, `target_tracker`, `recorder`, `player` or `viewer`.
        args: what follows the name on the command line, such as `--ros-args`, `-p`,
            `scenario:=calm`; see `docs/how-to/run-on-ros.md`.

    Raises:
        InputError: no such node, no ROS, or arguments that cannot be used.
        CspmError: the run failed.
    """
    if (recorded := start_node(name, args)) is not None:
        finish_recording(recorded)


def check_drivers(
    scenario: AnyScenario | None = None,
    *,
    testbed: AnyTestbed | None = None,
    overrides: Sequence[str] = (),
    seconds: float = 5.0,
    sim_time: bool = False,
    progress: Progress = silent,
) -> DriverReport:
    """Listen to drivers and report what does not fit the machine: `cspm check-drivers`.

    Nothing is published or commanded. The guided pull test needs a person and a terminal, and is
    part of the command only.

    Args:
        scenario: for its test-bed, rates and safe state: a name, a file, or a `Scenario`.
        testbed: instead: a machine with the usual rates, as a name, a file, or a `Testbed`.
        overrides: values that replace the scenario's, such as `rates.winches=500`.
        seconds: how long to listen [s], 1 to 300.
        sim_time: whether stamps follow `/clock`, not the wall clock.
        progress: called some 50 times a second with the share that is done and what is being done.

    Raises:
        InputError: none or both of scenario and test-bed, an option that is not possible, or no
            ROS.

    Examples:
        >>> from cspm import graph
        >>> graph.check_drivers("calm", seconds=20).ok  # doctest: +SKIP
        True
    """
    machine = machine_of(scenario, testbed, overrides)
    with listener_to(machine, seconds, sim_time=sim_time) as listener:
        return listened(machine, listener, seconds, progress)


def _shown(span_ns: tuple[int, int], progress: Progress) -> Callable[[Player], None]:
    """Return what reports the share of a span that a player has played."""
    begin, end = span_ns

    def look(player: Player) -> None:
        share = (player.position_ns - begin) / max(end - begin, 1)
        progress(min(max(share, 0.0), 1.0), "replaying")

    return look
