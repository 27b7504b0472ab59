"""One process's part in a ROS 2 graph: context, executor and an orderly end."""

from __future__ import annotations

import gc
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

import rclpy
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException
from rclpy.experimental import EventsExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.logging import LoggingSeverity, set_logger_level
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from typing_extensions import Self

from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.interruption import interruptible
from cspm_msgs_py.ros.contract_node import ContractNode
from cspm_msgs_py.ros.wake_up import WakeUp, make_wake_up
from cspm_msgs_py.ros.wall_timers import WallTimers

DISCOVERY_RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
MIDDLEWARE_PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"
_LOOK_EVERY_S = 0.02
_LONG_S = 1e6
# A node that was ordered to stop leaves in less than a second, whoever does not answer it.
FAREWELL_S = 0.5
# In a polled session: how often the executor has its turn, and how long it sleeps when all is quiet
# where no message can wake it.
_TURN_S, _IDLE_S = 0.01, 0.0002
# New objects between two collections of garbage, of which nodes make next to none.
_OBJECTS = 10_000


class Session:
    """Nodes of one process, spun by one thread. As a context it takes SIGINT and SIGTERM.

    The events executor is the only one of rclpy that keeps up with 1 kHz. Its `spin` ignores
    signals and its `spin_once` costs as much again per message, so it spins for a future, which a
    timer completes.
    """

    def __init__(
        self,
        args: Sequence[str] = (),
        *,
        domain_id: int | None = None,
        polled: bool = False,
    ) -> None:
        """Join the graph.

        Args:
            args: command line, of which ROS takes what follows `--ros-args`.
            domain_id: instead of `ROS_DOMAIN_ID`.
            polled: take messages by looking for them in turn, for nodes that keep each other busy.

        Raises:
            InputError: ROS does not understand the command line.
        """
        # Strangers on the network must not reach winches: who wants more sets the variable.
        os.environ.setdefault(DISCOVERY_RANGE, "LOCALHOST")
        os.environ.setdefault(MIDDLEWARE_PROFILES, str(Path(__file__).with_name("fastdds.xml")))
        self.context = Context()
        _init(self.context, list(args), domain_id)
        self._executor = EventsExecutor(context=self.context)
        self._timers: WallTimers | None = None
        self._wake_up: WakeUp | None = None
        self._nodes: list[ContractNode] = []
        self._stack = ExitStack()
        self._interrupted: Callable[[], bool] = lambda: False
        self._left = False
        if polled:
            self.poll()

    def poll(self) -> None:
        """Take messages by looking for them in turn, also for nodes that have no subscription yet.

        A message ends the sleep between two looks.
        """
        self._timers, self._wake_up = WallTimers(), make_wake_up()
        for node in self._nodes:
            node.poll(self._timers, self._wake_up)

    def node(self, name: str) -> ContractNode:
        """Return a new node that this session spins."""
        made = ContractNode(name, self.context, self._timers, self._wake_up)
        self._nodes.append(made)
        self._executor.add_node(made.node)
        return made

    def every(self, seconds: float, call: Callable[[], None]) -> None:
        """Have `call` called at an interval of wall time."""
        self._nodes[0].every(seconds, call)

    def warn(self, text: str) -> None:
        """Write a line to the first node's log."""
        self._nodes[0].warn(text)

    def spin_until(self, done: Callable[[], bool], timeout_s: float | None = None) -> bool:
        """Run callbacks until `done` or the timeout; return whether it is done.

        `done` is looked at some 50 times a second, and before anything else. A signal sets
        `stopped` and ends nothing.

        Raises:
            CspmError: a node failed.
        """
        over = Future()

        def look() -> None:
            if done() or self._failure() is not None or not self.context.ok():
                over.set_result(None)

        timer = self._nodes[0].every(_LOOK_EVERY_S, look)
        try:
            with _little_garbage():
                self._spin(over, done, timeout_s)
        except ExternalShutdownException:
            self._left = True
        finally:
            self._nodes[0].forget(timer)
        if (failure := self._failure()) is not None:
            raise CspmError(failure)
        return done()

    def _spin(self, over: Future, done: Callable[[], bool], timeout_s: float | None) -> None:
        if self._timers is not None:
            self._poll_until(over.done, timeout_s, self._timers)
        elif not done():
            # Without a timeout rclpy 7.1 does not see that the future is complete.
            self._executor.spin_until_future_complete(over, timeout_sec=timeout_s or _LONG_S)

    def _failure(self) -> str | None:
        return next((node.failure for node in self._nodes if node.failure is not None), None)

    def _poll_until(
        self, done: Callable[[], bool], timeout_s: float | None, timers: WallTimers
    ) -> None:
        """Run timers and hand on messages node by node; services and start have their turn."""
        intakes = [node.intake for node in self._nodes if node.intake is not None]
        end = time.monotonic() + (timeout_s or _LONG_S)
        turn = 0.0
        while not done():
            moved, rest = False, timers.run()
            for intake in intakes:
                moved = intake.take_one() or moved
            now = time.monotonic()
            if now >= end:
                return
            if now >= turn:
                self._executor.spin_once(timeout_sec=0.0)
                turn = now + _TURN_S
            elif not moved and rest > 0.0:
                self._sleep(min(rest, turn - now))

    def _sleep(self, seconds: float) -> None:
        """Sleep for so long [s] at most, less if a message comes."""
        if self._wake_up is not None:
            self._wake_up.wait(seconds)
        else:
            time.sleep(min(seconds, _IDLE_S))

    def deliver(self, seconds: float) -> bool:
        """Wait until all that was sent has come to those who read it; return whether it has.

        Where packets are lost, a message that its sender does not outlive may never come.
        """
        deadline = time.monotonic() + seconds
        return all(each.deliver(deadline - time.monotonic()) for each in self._nodes)

    def close(self) -> None:
        """Leave the graph; a second call does nothing."""
        for node in self._nodes:
            if node.intake is not None:
                node.intake.close()
            node.closing.close()
            self._executor.remove_node(node.node)
            node.node.destroy_node()
        self._nodes = []
        if self._wake_up is not None:
            self._wake_up.close()
            self._wake_up = None
        self._executor.shutdown()
        self.context.try_shutdown()
        self._stack.close()

    def __enter__(self) -> Self:
        self._interrupted = self._stack.enter_context(interruptible())
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def stopped(self) -> bool:
        """Whether this process was asked to end."""
        return self._left or self._interrupted()

    def stop(self) -> None:
        """Request the end."""
        self._left = True


@contextmanager
def _little_garbage() -> Iterator[None]:
    """Have collections of garbage look seldom, and not at what lives as long as the run."""
    first, *later = gc.get_threshold()
    gc.freeze()
    gc.set_threshold(_OBJECTS, *later)
    try:
        yield
    finally:
        gc.set_threshold(first, *later)
        gc.unfreeze()


def _init(context: Context, args: list[str], domain_id: int | None) -> None:
    # What ROS says of a command line is part of the error.
    set_logger_level("rcl", LoggingSeverity.FATAL)
    try:
        rclpy.init(
            args=args,
            context=context,
            domain_id=domain_id,
            signal_handler_options=SignalHandlerOptions.NO,
        )
    except (rclpy_implementation.RCLError, rclpy_implementation.UnknownROSArgsError) as err:
        what, _, _ = str(err).removeprefix("failed to initialize rcl: ").partition(". Error: ")
        raise InputError(
            f"--ros-args: {what}, allowed: -p NAME:=VALUE, -r OLD:=NEW, --params-file FILE and"
            " what else ROS 2 takes"
        ) from None
    finally:
        set_logger_level("rcl", LoggingSeverity.UNSET)
