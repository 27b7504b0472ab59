"""A ROS 2 node that speaks the contract: canonical bytes out, checked rows in."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable, Collection
from contextlib import ExitStack
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy

from cspm_msgs_py.diagnostics import Status, encode_diagnostics
from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.rate_limited_warnings import RateLimitedWarnings
from cspm_msgs_py.ros.domain_claim import DomainClaim
from cspm_msgs_py.ros.intake import Intake
from cspm_msgs_py.ros.local_name import local
from cspm_msgs_py.ros.qos import contract_qos
from cspm_msgs_py.ros.rcl.rcl_message import publish_address
from cspm_msgs_py.ros.rcl.row_sender import RowSender
from cspm_msgs_py.ros.rcl.tagged_taker import Tagged
from cspm_msgs_py.ros.wake_up import WakeUp
from cspm_msgs_py.ros.wall_timers import WallTimers
from cspm_msgs_py.stepping.steady_time import SteadyTime
from cspm_msgs_py.topics import DIAGNOSTICS, QOS_DEPTH, SENDER_DEPTH, Topic
from cspm_msgs_py.wire import WireReader

Array = NDArray[np.float64]
_SIM_TIME = "use_sim_time"


class ContractNode:
    """Publishes rows and receives them.

    Messages travel as bytes that we serialise ourselves: rclpy's objects would cost several times
    the time, and its serialiser leaves padding uninitialised.

    Attributes:
        node: rclpy's node.
        intake: where its messages are taken from, if no executor brings them.
        closing: what is closed with the node.
        hardware_id: the machine's name, for what the node reports.
        failure: why the session is to end, in one line, if `fail` was called.
    """

    def __init__(
        self,
        name: str,
        context: Context,
        timers: WallTimers | None = None,
        wake_up: WakeUp | None = None,
    ) -> None:
        """Make a node; with `timers` somebody runs these and empties its intake, no executor.

        What comes into that intake ends the sleep of `wake_up`.
        """
        self.node = Node(name, context=context)
        self.intake: Intake | None = None
        self._timers: WallTimers | None = None
        self._time: SteadyTime | None = None
        if timers is not None:
            self.poll(timers, wake_up)
        self._clock = self.node.get_clock().handle
        self._publishers: dict[str, tuple[Publisher, frozenset[str]]] = {}
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._complaints = RateLimitedWarnings(self.warn)
        self.closing, self._claimed = ExitStack(), False
        self.hardware_id = ""
        self.failure: str | None = None

    def poll(self, timers: WallTimers, wake_up: WakeUp | None) -> None:
        """Have somebody run timers and empty the intake; before anything is subscribed to."""
        self._timers, self.intake = timers, Intake(self.node, wake_up)

    @property
    def name(self) -> str:
        """The node's name."""
        return str(self.node.get_name())

    def publisher(
        self, topic: Topic, readers: Collection[str] = ()
    ) -> Callable[[int, int, Array], None]:
        """Return what publishes (log time [ns], which ROS has no use for, stamp [ns], row).

        `readers` are the nodes that `matched` is to see.
        """
        sender = RowSender(topic, self._publisher(topic, readers), publish_address())
        self.closing.callback(sender.close)

        def send(_: int, stamp_ns: int, row: Array) -> None:
            sender.send(stamp_ns, row)

        return send

    def raw_publisher(self, topic: Topic, readers: Collection[str] = ()) -> Callable[[bytes], None]:
        """Return what publishes a topic's CDR bytes."""
        # What `Publisher.publish` does with bytes, without its checks of each message.
        publish: Callable[[bytes], None] = self._publisher(topic, readers).handle.publish_raw
        return publish

    def _publisher(self, topic: Topic, readers: Collection[str]) -> Publisher:
        qos = contract_qos(SENDER_DEPTH)
        made = self.node.create_publisher(ros_class(topic.ros_type), local(topic.name), qos)
        self._publishers[topic.name] = (made, frozenset(readers))
        return made

    def status_publisher(self, readers: Collection[str] = ()) -> Callable[[int, Status], None]:
        """Return what publishes a status on `/diagnostics` (stamp [ns], status)."""
        publish = self.raw_publisher(DIAGNOSTICS, readers)

        def send(stamp_ns: int, status: Status) -> None:
            publish(encode_diagnostics(stamp_ns, [status], self.hardware_id))

        return send

    def subscribe(
        self, topic: Topic, take: Callable[[bytes], None], depth: int = QOS_DEPTH
    ) -> None:
        """Have `take` called with each message's CDR bytes; at most `depth` wait for it."""
        message_class = ros_class(topic.ros_type)
        if self.intake is None:
            qos = contract_qos(depth)
            self.node.create_subscription(message_class, local(topic.name), take, qos, raw=True)
            return
        self.intake.subscribe(
            topic,
            message_class,
            lambda payload, *_: take(payload),
            numbered=False,
            depth=depth,
        )

    def subscribe_objects(
        self,
        topic: str,
        message_class: type,
        take: Callable[[Any], None],
        depth: int | None = None,
    ) -> None:
        """Have `take` called with each message as rclpy's object; `depth` wait, or all if None."""
        if self.intake is None:
            self.node.create_subscription(message_class, local(topic), take, contract_qos(depth))
        else:
            self.intake.subscribe_objects(topic, message_class, take, depth)

    def subscribe_rows(
        self,
        topic: Topic,
        receive: Callable[[int, Array], None],
        refuse: Callable[[str], None],
        depth: int = QOS_DEPTH,
    ) -> None:
        """Have `receive` called with stamp [ns] and row, or `refuse` with what is wrong.

        An `InputError` that `receive` raises counts as something wrong with the message.
        """
        decode = WireReader(topic).decode

        def take(payload: bytes) -> None:
            try:
                receive(*decode(payload))
            except InputError as err:
                refuse(str(err))

        self.subscribe(topic, take, depth)

    def subscribe_numbered_rows(
        self,
        topic: Topic,
        receive: Callable[[int, Array, int | None], None],
        refuse: Callable[[str], None],
    ) -> None:
        """As `subscribe_rows`, with the number that its sender gave each message, None if unknown.

        Any other `CspmError` that `receive` raises is the node's failure. All messages wait, or
        strangers' would push out genuine ones.
        """
        decode = WireReader(topic).decode

        def take_row(stamp_ns: int, row: Array, number: int | None) -> None:
            try:
                receive(stamp_ns, row, number)
            except InputError as err:
                refuse(str(err))
            except CspmError as err:
                self.fail(str(err))

        def take(payload: bytes, _: int, number: int | None) -> None:
            try:
                decoded = decode(payload)
            except InputError as err:
                refuse(str(err))
            else:
                take_row(*decoded, number)

        message_class = ros_class(topic.ros_type)
        if self.intake is None:
            numbered, qos = _Numbered(take), contract_qos(None)
            self.node.create_subscription(message_class, local(topic.name), numbered, qos, raw=True)
        else:
            self.intake.subscribe_rows(topic, message_class, take_row, take)

    def subscribe_tagged(
        self, topic: Topic, take: Callable[[Tagged], None], depth: int = QOS_DEPTH
    ) -> None:
        """Have `take` called with each message and its publisher; for nodes in a polled session."""
        assert self.intake is not None
        self.intake.subscribe_tagged(topic, ros_class(topic.ros_type), take, depth=depth)

    def subscribe_tagged_rows(
        self,
        topic: Topic,
        receive: Callable[[int, Array, bytes | None], None],
        refuse: Callable[[str], None],
    ) -> None:
        """As `subscribe_rows`, with the identity of each message's publisher, None if unknown."""
        decode = WireReader(topic).decode

        def take(message: Tagged) -> None:
            try:
                receive(*decode(message.payload), message.gid)
            except InputError as err:
                refuse(str(err))

        self.subscribe_tagged(topic, take)

    def unmatched(self) -> list[str]:
        """Return `topic (reader)` for each reader that is not connected to our publisher yet."""
        missing = []
        for topic, (publisher, readers) in self._publishers.items():
            if not readers:
                continue
            missing += [f"{topic} ({name})" for name in self.unconnected(publisher, readers)]
        return missing

    def unconnected(self, publisher: Publisher, readers: Collection[str]) -> list[str]:
        """Return which of `readers`, by node, a publisher of this node does not reach yet.

        Others may listen as well; those who want another type or for stored messages are never
        reached.
        """
        found = [
            info
            for info in self.node.get_subscriptions_info_by_topic(publisher.topic_name)
            if info.topic_type == _ros_type(publisher.msg_type)
            and info.qos_profile.durability == DurabilityPolicy.VOLATILE
        ]
        absent = set(readers) - {info.node_name for info in found}
        if not absent and publisher.get_subscription_count() < len(found):
            return [f"{len(found)} readers"]
        return sorted(absent)

    def has_other_readers(self, topic: str) -> bool:
        """Return whether more than the run's own readers are connected to our publisher."""
        publisher, readers = self._publishers[topic]
        return bool(publisher.get_subscription_count() > len(readers))

    def deliver(self, seconds: float) -> bool:
        """Wait until all that was sent has come to those who read it; return whether it has."""
        end = time.monotonic() + seconds
        return all(
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, end - time.monotonic())))
            for publisher in self.node.publishers
        )

    def claim(self, run: str, topic: str) -> bool:
        """Claim the node's domain for a run of this name, until the node is closed.

        Runs whose start is announced on another `topic` are kept apart. A second call does nothing
        and returns false.

        Raises:
            InputError: another run has it.
        """
        if self._claimed:
            return False
        domain = int(self.node.context.get_domain_id())
        claim = DomainClaim(domain, self.node.resolve_topic_name(local(topic)), run)
        self.closing.callback(claim.close)
        self._claimed = True
        return True

    def every(self, seconds: float, call: Callable[[], None]) -> Any:  # noqa: ANN401 - rclpy's timer
        """Have `call` called at an interval of wall time; return the timer."""
        if self._timers is not None:
            return self._timers.add(seconds, call)
        return self.node.create_timer(seconds, call, clock=self._steady)

    def forget(self, timer: Any) -> None:  # noqa: ANN401 - rclpy's timer
        """Cancel a timer for good."""
        timer.cancel()
        if self._timers is None:
            self.node.destroy_timer(timer)

    def now_ns(self) -> int:
        """Return the time on the ROS clock [ns], simulated where `use_sim_time` is set.

        After `keep_time` it does not follow when that clock is set.
        """
        if self._time is not None:
            return self._time.now_ns(time.monotonic_ns())
        return self._ros_ns()

    def _ros_ns(self) -> int:
        with self._clock:
            return int(self._clock.get_now().nanoseconds)

    def keep_time(self) -> None:
        """Follow the ROS clock by a steady one from now on, and keep `use_sim_time` off.

        Raises:
            InputError: `use_sim_time` is set: then the run would have no time of its own.
        """
        if self.node.get_parameter(_SIM_TIME).value:
            raise InputError(f"parameter {_SIM_TIME}: true, allowed in real time: false")
        self.node.add_on_set_parameters_callback(_refuse_sim_time)
        self._time = SteadyTime(self._ros_ns(), time.monotonic_ns())

    def clock_fault(self) -> str | None:
        """Return in one line that the ROS clock was set since the last call, None if not."""
        if self._time is None:
            return None
        return self._time.look(self._ros_ns(), time.monotonic_ns())

    def accept_clock(self) -> None:
        """Take the ROS clock as it is now."""
        if self._time is not None:
            self._time.accept(self._ros_ns(), time.monotonic_ns())

    def complain(self, subject: str, text: str) -> None:
        """Log what is wrong with a topic's messages; a flood of them does not fill the log."""
        self._complaints.add(subject, text)

    def fail(self, text: str) -> None:
        """Have the session end with what is wrong; the first one counts.

        An exception in a callback would be printed by ROS as well, with its traceback.
        """
        self.failure = self.failure or text

    def warn(self, text: str) -> None:
        """Write a line to the node's log."""
        self.node.get_logger().warning(text)


class _Numbered:
    """What the executor calls with a message and its sender's number for it."""

    # By this rclpy sees that the information on the message is wanted.
    __signature__ = inspect.signature(lambda message, info: None)

    def __init__(self, take: Callable[[bytes, int, int | None], None]) -> None:
        self._take = take

    def __call__(self, message: Any, info: dict[str, int] | None = None) -> None:  # noqa: ANN401
        # The events executor of rclpy 7.1 passes both as one argument.
        payload, found = message if info is None else (message, info)
        self._take(payload, found["received_timestamp"], found["publication_sequence_number"])


def _refuse_sim_time(parameters: list[Parameter]) -> SetParametersResult:
    """Refuse to take the time from others in a run that goes by the wall."""
    wanted = any(each.name == _SIM_TIME and each.value for each in parameters)
    reason = f"{_SIM_TIME}: true, allowed in real time: false" if wanted else ""
    return SetParametersResult(successful=not wanted, reason=reason)


def _ros_type(message_class: type) -> str:
    package, kind, *_ = message_class.__module__.split(".")
    return f"{package}/{kind}/{message_class.__name__}"


def ros_class(ros_type: str) -> Any:  # noqa: ANN401 - rosidl's classes have no types
    """Return rclpy's class of `package/msg/Type`."""
    package, kind, name = ros_type.split("/")
    return getattr(import_module(f"{package}.{kind}"), name)
