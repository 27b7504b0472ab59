"""The player's node: a bag's messages on their topics, in time."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np
from rclpy.duration import Duration

from cspm_msgs_py.bag import BagStream
from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.local_name import local
from cspm_msgs_py.ros.qos import contract_qos
from cspm_msgs_py.ros_types import typestore
from cspm_msgs_py.topics import CLOCK, SCENE, SENDER_DEPTH
from cspm_msgs_py.wire import WireWriter
from cspm_ros.replay.bag_selection import Selection, check_clock, is_topic_name
from cspm_ros.replay.player import Instant, Player, instants
from cspm_ros.runtime.discovery import Discovery
from cspm_ros.schema_types.schema_class import message_class_of

PLAY_EVERY_S = 0.001
_LOOK_EVERY_S = 0.05
_NOTHING = np.zeros(0)


class Controls:
    """A player in a node, which others pause and step.

    Services `~/pause` (std_srvs/SetBool) and `~/step` (std_srvs/Trigger).

    Attributes:
        player: what plays.
        failure: why it ended early, in one line, if it did.
    """

    def __init__(self, node: ContractNode, player: Player) -> None:
        self.player = player
        self.failure: CspmError | None = None
        pause, step = (ros_class(f"std_srvs/srv/{kind}") for kind in ("SetBool", "Trigger"))
        node.node.create_service(pause, "~/pause", self._pause)
        node.node.create_service(step, "~/step", self._step)

    def advance(self) -> None:
        """Play what is due."""
        try:
            self.player.advance(time.monotonic())
        except CspmError as err:
            self.failure = err
            self.player.end()

    def _pause(self, request: Any, response: Any) -> Any:  # noqa: ANN401 - rosidl's classes
        if request.data:
            self.player.pause(time.monotonic())
        else:
            self.player.resume(time.monotonic())
        state = "paused" if request.data else "playing"
        response.success, response.message = True, f"{state} at {self._position()}"
        return response

    def _step(self, _: Any, response: Any) -> Any:  # noqa: ANN401 - rosidl's classes
        response.success = self.player.step(time.monotonic())
        response.message = self._position() if response.success else "the bag is played"
        return response

    def _position(self) -> str:
        return f"{self.player.position_ns * 1e-9:.9f} s"


class PlayerNode:
    """Plays a bag to whoever listens.

    Attributes:
        controls: the player and its services.
        unplayable: the topics that were to be played and cannot be, with the reason.
        span_ns: first and last log time to be played [ns].
    """

    def __init__(
        self,
        node: ContractNode,
        bag: BagStream,
        selection: Selection,
        rate: float,
        *,
        paused: bool = False,
    ) -> None:
        """Connect the player.

        Args:
            node: the ROS node.
            bag: what to play.
            selection: which part of it.
            rate: bag time per wall time.
            paused: whether to begin paused.

        Raises:
            InputError: the bag does not have what is to be played, or is damaged.
        """
        self._node = node
        self.span_ns = start_ns, end_ns = selection.span_ns(bag)
        names, self.unplayable = _sorted_out(bag, selection)
        types = {name: (bag.topics[name].ros_type, bag.store(name)) for name in names}
        self._clock_topic = CLOCK.name if _lacks_clock(bag, names, selection) else None
        if self._clock_topic:
            check_clock(bag)
            types[CLOCK.name] = CLOCK.ros_type, typestore()
        self._publishers = {
            name: node.node.create_publisher(
                message_class_of(ros_type, store),
                local(names.get(name) or selection.remap.get(name, name)),
                contract_qos(SENDER_DEPTH, latched=name in SCENE and SCENE[name].latched),
            )
            for name, (ros_type, store) in types.items()
        }
        self._publish = {n: made.handle.publish_raw for n, made in self._publishers.items()}
        self._encode_clock = WireWriter(CLOCK).encode
        found = instants(bag.messages(names, start_ns), end_ns)
        player = Player(found, self._play, start_ns, rate, paused=paused)
        self.controls = Controls(node, player)
        node.every(PLAY_EVERY_S, self.controls.advance)
        self._discovery = Discovery()
        self._timer = node.every(_LOOK_EVERY_S, self._begin)

    def unacknowledged(self) -> list[str]:
        """Return the topics of which a reader has not acknowledged every message yet."""
        now = Duration(seconds=0)
        return [n for n, made in self._publishers.items() if not made.wait_for_all_acked(now)]

    def _begin(self) -> None:
        """Begin once all readers that are there are connected."""
        count = self._node.node.count_subscribers
        found = {
            name: (count(made.topic_name), made.get_subscription_count())
            for name, made in self._publishers.items()
        }
        if not self._discovery.complete(list(found.values()), time.monotonic()):
            return
        self._timer.cancel()
        unfit = [name for name, (known, connected) in found.items() if connected < known]
        if unfit:
            self._node.warn(
                f"not all readers of {', '.join(unfit)} are connected: is their quality of service"
                " one for reliable, volatile messages?"
            )
        self.controls.player.begin(time.monotonic())

    def _play(self, instant: Instant) -> None:
        publish = self._publish
        if self._clock_topic:
            publish[self._clock_topic](self._encode_clock(instant.log_ns, _NOTHING))
        for _, topic, payload in instant.messages:
            publish[topic](payload)


def _lacks_clock(bag: BagStream, names: Mapping[str, str], selection: Selection) -> bool:
    """Return whether a clock is wanted that the bag does not have."""
    found = any(bag.topics[name].count and CLOCK.name in (name, new) for name, new in names.items())
    return not found and CLOCK.name not in selection.left_out


def _sorted_out(bag: BagStream, selection: Selection) -> tuple[dict[str, str], dict[str, str]]:
    """Return the new names of the topics that can be played, and why the other wanted ones cannot.

    Raises:
        InputError: see `Selection.names`; or none can be played.
    """
    found, unplayable = {}, selection.unplayable(bag)
    for name, new in selection.names(bag).items():
        if not is_topic_name(new):
            unplayable[name] = "ROS 2 can have no topic of this name, allowed: one renamed"
            continue
        try:
            message_class_of(bag.topics[name].ros_type, bag.store(name))
        except InputError as err:
            unplayable[name] = str(err)
        else:
            found[name] = new
    if not found:
        first, why = next(iter(unplayable.items()), ("nothing", "all is left out"))
        raise InputError(f"{bag.path}: no topic of it can be played, {first}: {why}")
    return found, unplayable
