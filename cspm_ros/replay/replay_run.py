"""A replay from start to end: to whoever listens, or in step with nodes of this process."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from cspm_msgs_py.bag import BagStream, open_bag
from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.graph import PLAYER, RECORDER
from cspm_msgs_py.ros.contract_node import ContractNode
from cspm_msgs_py.ros.session import FAREWELL_S, Session
from cspm_msgs_py.schedule import schedule_of
from cspm_ros.replay.bag_selection import Selection
from cspm_ros.replay.lockstep_player_node import LockstepPlayerNode
from cspm_ros.replay.player import UNLIMITED, Player, check_rate
from cspm_ros.replay.player_node import PlayerNode
from cspm_ros.replay.reproduction import Reproduction
from cspm_ros.runtime.lockstep_nodes import LockstepRun
from cspm_ros.runtime.node_parameters import NodeParameters
from cspm_ros.runtime.stall_watchdog import LOOK_EVERY_S, PATIENCE_S, Patience, Waiting, Watch
from cspm_run.bundle import Bundle
from cspm_run.recorded_bundle import recorded_bundle
from cspm_run.recorded_run import new_recording

REPLAY = "replay"
# Readers report what they have at least every three seconds.
_ACKNOWLEDGED_S = 4.0
_LOOK_OFTEN_S = 0.05
Look = Callable[[Player], None]


@dataclass(frozen=True)
class Replayed:
    """What a replay amounted to.

    Attributes:
        messages: number of the bag's messages that were taken up.
        played_s: bag time played [s].
        interrupted: whether a signal ended it.
        unplayable: topics that could not be played, and why.
        reproductions: by topic, how nodes in step reproduced what was recorded.
    """

    messages: int
    played_s: float
    interrupted: bool
    unplayable: dict[str, str]
    reproductions: dict[str, Reproduction]

    @property
    def identical(self) -> bool:
        """Whether everything that nodes sent is what was recorded, bit for bit."""
        return all(each.identical for each in self.reproductions.values())


def replay(
    bag: BagStream,
    selection: Selection,
    rate: float = 1.0,
    look: Look = lambda _: None,
    *,
    paused: bool = False,
    domain_id: int | None = None,
    notify: Callable[[str], None] = lambda _: None,
) -> Replayed:
    """Play a bag to whoever listens.

    Args:
        bag: what to play.
        selection: which part of it.
        rate: bag time per wall time.
        look: called some 20 times a second with the player.
        paused: whether to begin paused.
        domain_id: instead of `ROS_DOMAIN_ID`.
        notify: gets a line about what is missing in the bag, and each topic that cannot be played.

    Raises:
        InputError: the bag does not have what is to be played, or is damaged.
    """
    for fault in bag.faults:
        notify(fault)
    with Session(domain_id=domain_id) as session:
        node = PlayerNode(session.node(PLAYER), bag, selection, _in_time(rate), paused=paused)
        return _play_in_time(session, node, look, notify)


def replay_through(
    path: Path,
    through: Collection[str],
    rate: float = UNLIMITED,
    look: Look = lambda _: None,
    *,
    paused: bool = False,
    duration_s: float | None = None,
    overrides: Sequence[str] = (),
    folder: Path | None = None,
    domain_id: int | None = None,
    patience_s: float = PATIENCE_S,
) -> Replayed:
    """Feed nodes in this process with a recording, in step, and compare what they send with it.

    Args:
        path: the recording of a run in lockstep.
        through: names of the nodes.
        rate: recorded time per wall time; 0 as fast as the nodes are.
        look: called some 20 times a second with the player.
        paused: whether to begin paused.
        duration_s: recorded time to play [s]; None all of it.
        overrides: values put over the recorded scenario's, `key.path=value`.
        folder: where to record what the nodes make of it; None records nothing.
        domain_id: instead of `ROS_DOMAIN_ID`.
        patience_s: give up when nothing moves for so long [s], once the replay is under way.

    Raises:
        InputError: no recording of a run in lockstep, or no such nodes.
        CspmError: nothing moved for `patience_s`, or for longer while it started.
    """
    began = time.perf_counter()
    bundle = recorded_bundle(path, overrides)
    live = _checked_nodes(bundle, through)
    run = LockstepRun(bundle, (PLAYER, *live, *([RECORDER] if folder else [])))
    with ExitStack() as stack:
        bag = stack.enter_context(open_bag(path))
        session = stack.enter_context(Session(domain_id=domain_id))
        node = LockstepPlayerNode(
            session.node(PLAYER), bag, run, check_rate(rate), paused=paused, duration_s=duration_s
        )
        others: list[Waiting] = [run.stage(session.node(name)) for name in live]
        if folder is not None:
            writer = stack.enter_context(new_recording(bundle, folder, REPLAY))
            recorder = run.recorder(session.node(RECORDER), writer)
            stack.callback(recorder.close)
            others.append(recorder)
        patience = Patience(patience_s, time.perf_counter() - began)
        return _play_in_step(session, node, others, look, patience)


def nodes_of(path: Path) -> tuple[str, ...]:
    """Return the nodes beside the plant that a recording's scenario has.

    Raises:
        InputError: no recording that says what was run.
    """
    bundle = recorded_bundle(path)
    return tuple(schedule_of(bundle.scenario, bundle.testbed.testbed).nodes)


def run_player(
    session: Session, node: ContractNode, parameters: NodeParameters, began: float
) -> None:
    """Run the player's node as its parameters say, until all is played or a signal comes.

    `began` is when the program did, on `time.perf_counter` [s].

    Raises:
        InputError: parameters that cannot be used, or a damaged bag.
        CspmError: in lockstep nothing moved, or what came back is not what was recorded.
    """
    if not parameters.bag:
        raise InputError("parameter bag: empty, allowed: a bag's folder or file")
    path, rate, paused = Path(parameters.bag), parameters.rate, parameters.paused
    with open_bag(path, own_types=True) as bag:
        if parameters.lockstep:
            _run_in_step(session, node, bag, parameters, began)
            return
        selection = Selection(parameters.topics, parameters.left_out, parameters.start)
        player = PlayerNode(node, bag, selection, _in_time(rate), paused=paused)
        _play_in_time(session, player, lambda _: None, node.warn)


def _in_time(rate: float) -> float:
    if rate == UNLIMITED:
        raise InputError("rate 0: allowed with nodes in step, which report how far they are")
    return check_rate(rate)


def _checked_nodes(bundle: Bundle, through: Collection[str]) -> tuple[str, ...]:
    allowed = tuple(schedule_of(bundle.scenario, bundle.testbed.testbed).nodes)
    unknown = [name for name in through if name not in allowed]
    if unknown or not through:
        raise InputError(
            f"through {', '.join(unknown) or 'no node'}: allowed: {', '.join(allowed) or 'none'}"
            f" (scenario {bundle.scenario.name})"
        )
    return tuple(name for name in allowed if name in through)


def _run_in_step(
    session: Session,
    node: ContractNode,
    bag: BagStream,
    parameters: NodeParameters,
    began: float,
) -> None:
    bundle = parameters.bundle()
    schedule = schedule_of(bundle.scenario, bundle.testbed.testbed)
    others = parameters.nodes or (*schedule.nodes,)
    live = _checked_nodes(bundle, [name for name in others if name not in (PLAYER, RECORDER)])
    members = (PLAYER, *live, *([RECORDER] if RECORDER in others else []))
    player = LockstepPlayerNode(
        node,
        bag,
        LockstepRun(bundle, members),
        check_rate(parameters.rate),
        paused=parameters.paused,
    )
    patience = Patience(parameters.patience, time.perf_counter() - began)
    found = _play_in_step(session, player, [], lambda _: None, patience)
    different = [str(each) for each in found.reproductions.values() if not each.identical]
    if different:
        raise CspmError("; ".join(different))


def _play_in_time(
    session: Session, node: PlayerNode, look: Look, notify: Callable[[str], None]
) -> Replayed:
    for name, why in node.unplayable.items():
        notify(f"{name} is not played: {why}")
    player = node.controls.player
    session.every(_LOOK_OFTEN_S, lambda: look(player))
    session.spin_until(lambda: session.stopped or player.finished)
    if not session.stopped and not player.ended_early:
        session.spin_until(lambda: session.stopped or not node.unacknowledged(), _ACKNOWLEDGED_S)
    look(player)
    if node.controls.failure is not None:
        raise node.controls.failure
    return _replayed(session, player, node.span_ns, node.unplayable, {})


def _play_in_step(
    session: Session,
    node: LockstepPlayerNode,
    others: list[Waiting],
    look: Look,
    patience: Patience,
) -> Replayed:
    watch = Watch([node, *others], patience, session.warn)
    player = node.controls.player

    def watched() -> None:
        if session.stopped:
            node.stop()
        if node.waits_for_time:
            watch.rest()
        watch.look()

    session.every(LOOK_EVERY_S, watched)
    session.every(_LOOK_OFTEN_S, lambda: look(player))
    session.spin_until(lambda: node.finished or session.stopped or watch.stuck is not None)
    if session.stopped:
        node.stop()
        session.spin_until(lambda: node.finished, FAREWELL_S)
    look(player)
    if node.controls.failure is not None:
        raise node.controls.failure
    if watch.stuck is not None:
        raise CspmError(watch.stuck)
    return _replayed(session, player, node.span_ns, {}, node.reproductions)


def _replayed(
    session: Session,
    player: Player,
    span_ns: tuple[int, int],
    unplayable: dict[str, str],
    reproductions: dict[str, Reproduction],
) -> Replayed:
    played = (player.position_ns - span_ns[0]) * 1e-9
    return Replayed(player.messages, played, session.stopped, unplayable, reproductions)
