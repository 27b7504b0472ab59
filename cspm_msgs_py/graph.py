"""Which node sends and which node reads each topic of a scenario."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from cspm_msgs_py.schedule import (
    FORCE_CONTROLLER,
    MOTION_CONTROLLER,
    PLANT,
    TARGET_TRACKER,
    TENSION_DISTRIBUTION,
    TORQUE_COMMAND,
    WAVE_TRAJECTORY,
    Schedule,
)
from cspm_msgs_py.stepping.lockstep import RECORDER_WINDOW, WINDOW
from cspm_msgs_py.topics import DIAGNOSTICS

RECORDER = "recorder"
PLAYER = "player"
# Draws for others' viewers, beside any run.
VIEWER = "viewer"
# Of every closed loop; where the target is measured its tracker stands beside them.
STAGES = (WAVE_TRAJECTORY, MOTION_CONTROLLER, TENSION_DISTRIBUTION, FORCE_CONTROLLER)
NODES = (PLANT, *STAGES, TARGET_TRACKER, RECORDER, PLAYER, VIEWER)


@dataclass(frozen=True)
class Edges:
    """One topic's ends: names of the nodes that send it, and of those that read it."""

    senders: tuple[str, ...]
    readers: tuple[str, ...]


def graph_of(schedule: Schedule, nodes: Sequence[str]) -> dict[str, Edges]:
    """Return sender and readers of every topic among `nodes`, by topic in contract order.

    A player among them takes the place of the plant and of the nodes that are absent, and reads
    what those that are present send.
    """
    present = set(nodes)
    source = PLAYER if PLAYER in present else PLANT
    # A player plays what drivers sent as well; the plant does not speak for them.
    foreign = schedule.foreign if source == PLANT else ()
    senders = {name: source for name in schedule.topics if name not in foreign}
    readers: dict[str, list[str]] = {name: [] for name in schedule.topics}
    for node, plan in schedule.nodes.items():
        if source == PLANT or node in present:
            senders.update(dict.fromkeys(plan.outputs, node))
            for topic in plan.outputs:
                readers[topic].append(PLAYER)
        for topic in (*plan.inputs, *plan.held):
            if not (inside(schedule, node, nodes) and senders.get(topic) == PLANT):
                readers[topic].append(node)
    if TORQUE_COMMAND in readers and not inside(schedule, FORCE_CONTROLLER, nodes):
        readers[TORQUE_COMMAND].append(PLANT)
    found = {
        topic: Edges(
            tuple({senders[topic]} & present) if topic in senders else (),
            tuple(node for node in (*readers[topic], RECORDER) if node in present),
        )
        for topic in schedule.topics
    }
    reporting = tuple(node for node in (PLANT, PLAYER, *schedule.nodes) if node in present)
    found[DIAGNOSTICS.name] = Edges(reporting, tuple({RECORDER} & present))
    return found


def inside(schedule: Schedule, node: str, nodes: Collection[str]) -> bool:
    """Return whether a node is part of the plant in a run with these `nodes`."""
    return node in schedule.hosted and {PLANT, node} <= set(nodes)


def members_of(schedule: Schedule, *, external: bool = False) -> tuple[str, ...]:
    """Return the nodes of a run; where drivers are `external` they are the plant and its parts."""
    left_out = (PLANT, *schedule.hosted) if external else ()
    return tuple(name for name in (PLANT, *schedule.nodes, RECORDER) if name not in left_out)


def window_of(node: str) -> int:
    """Return how many steps the plant may be ahead of a node's last acknowledgement."""
    return RECORDER_WINDOW if node == RECORDER else WINDOW


def followers(schedule: Schedule, nodes: Sequence[str], window: int) -> tuple[str, ...]:
    """Return the nodes whose progress the plant must wait for beside the torque command.

    A torque proves that the nodes which it comes from, in a closed loop those before the force
    controller as well, have read what they computed it from. What came since, or before the first,
    is unread at worst; a node is waited for where that may be more than `window` messages of a
    topic.
    """
    unread, proven = 0, set()
    reference = TARGET_TRACKER if TARGET_TRACKER in schedule.nodes else WAVE_TRAJECTORY
    chain = (FORCE_CONTROLLER, TENSION_DISTRIBUTION, MOTION_CONTROLLER, reference)
    for node in chain if MOTION_CONTROLLER in schedule.nodes else chain[:1]:
        plan = schedule.nodes.get(node)
        if plan is not None:
            unread += plan.divider
            most = max(unread, schedule.topics[TORQUE_COMMAND].first + 1)
            finest = min(schedule.topics[name].divider for name in (*plan.inputs, *plan.held))
            proven |= {node} if most <= window * finest else set()
    ordered = (*schedule.nodes, RECORDER)
    return tuple(node for node in ordered if node in set(nodes) - proven)
