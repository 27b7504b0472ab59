"""Listens to a machine's drivers: what discovery announces of them, and every message they send."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.graph import RECORDER
from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.intake import Intake
from cspm_msgs_py.ros.local_name import local
from cspm_msgs_py.ros.session import Session
from cspm_msgs_py.schedule import TORQUE_COMMAND
from cspm_msgs_py.sensor_spec import MEASURED
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.topics import BRAKE, CLOCK, Topic
from cspm_msgs_py.wire import WireReader
from cspm_ros.check_drivers.driver_clock import LEAST_TICKS, on_ros_clock
from cspm_ros.check_drivers.driver_endpoints import (
    Endpoint,
    check_brake,
    check_clock,
    check_publishers,
    check_torque_command,
)
from cspm_ros.check_drivers.driver_observation import Finding, Observation
from cspm_ros.check_drivers.graph_endpoints import endpoint_of
from cspm_ros.runtime.discovery import Discovery

NODE = "check_drivers"
_TAKE_EVERY_S = 0.005
_LOOK_EVERY_S = 0.1


class DriverListener:
    """Hears the measured topics with whatever quality of service their publishers offer.

    The nodes of a run hear reliable publishers only. Here one that offers no more than best effort
    is heard as well, so that it can be distinguished from one that is silent.
    """

    def __init__(self, session: Session, testbed: Testbed, *, sim_time: bool = False) -> None:
        """Join the graph as a node of `session`.

        Args:
            session: spins the node.
            testbed: the machine.
            sim_time: whether messages are received on the clock that `/clock` runs.
        """
        self._session, self._testbed, self._sim_time = session, testbed, sim_time
        self._node = session.node(NODE)
        self._wanted = {
            name: testbed.topics[name]
            for name in (CLOCK.name, *MEASURED)
            if name in testbed.topics and (sim_time or name != CLOCK.name)
        }
        self._ears: dict[str, _Ear] = {}
        session.every(_LOOK_EVERY_S, self._look)
        session.every(_TAKE_EVERY_S, self._take)

    def find(self, progress: Callable[[], None] = lambda: None) -> bool:
        """Wait, some seconds at most, until all sensors' topics have a publisher.

        Returns:
            whether any topic is there to be heard.
        """
        discovery = Discovery()
        expected = [name for name in self._wanted if name in self._testbed.sensors]

        def found() -> bool:
            progress()
            counts = [(1, len(self._publishers(name))) for name in expected]
            return self._session.stopped or discovery.complete(counts, time.monotonic())

        self._session.spin_until(found)
        return any(self._publishers(name) for name in self._wanted)

    def wait_for(self, done: Callable[[], bool]) -> bool:
        """Wait; return whether it is done, False after a signal."""
        self._session.spin_until(lambda: done() or self._session.stopped)
        return not self._session.stopped

    def listen(self, seconds: float, progress: Callable[[float], None] = lambda _: None) -> bool:
        """Forget what came so far and hear all that comes for some seconds.

        Args:
            seconds: how long.
            progress: called some 50 times a second with the time that has passed [s].

        Returns:
            whether it was for so long, False after a signal.
        """
        self._take()
        for ear in self._ears.values():
            ear.forget()
        began = time.monotonic()

        def over() -> bool:
            passed = time.monotonic() - began
            progress(min(passed, seconds))
            return passed >= seconds or self._session.stopped

        self._session.spin_until(over)
        self._take()
        return not self._session.stopped

    def observations(self) -> list[Observation]:
        """Return what was heard, and which other topics there are, in case one is misnamed."""
        ticks = self._ticks()
        present = {name for name, _ in self._node.node.get_topic_names_and_types()}
        found = []
        for name in sorted(present | set(self._ears)):
            publishers = self._publishers(name)
            samples = self._ears[name].samples if name in self._ears else []
            if publishers or samples:
                types = ", ".join(sorted({each.ros_type for each in publishers}))
                on_clock = on_ros_clock(samples, ticks) if ticks else samples
                found.append(Observation(name, types, len(publishers), on_clock))
        return found

    def findings(self, *, commanded: bool, braked: bool) -> list[Finding]:
        """Judge what is not in the messages: quality of service, losses, clock, who hears commands.

        Args:
            commanded: whether the scenario commands torques.
            braked: whether its safe state relies on brakes.
        """
        found = check_clock(len(self._ticks()), self._publishers(CLOCK.name), wanted=self._sim_time)
        for name, topic in self._wanted.items():
            if name != CLOCK.name:
                found += check_publishers(topic, self._publishers(name))
                found += self._ears[name].check_losses() if name in self._ears else []
        if commanded:
            topic = self._testbed.topics[TORQUE_COMMAND]
            found += check_torque_command(
                topic, self._publishers(topic.name), self._subscriptions(topic.name)
            )
        return found + check_brake(self._subscriptions(BRAKE.name), needed=braked)

    def _ticks(self) -> list[tuple[int, int]]:
        """Return wall and published times [ns] of `/clock`, empty if they are too few."""
        ear, decode = self._ears.get(CLOCK.name), WireReader(CLOCK).decode
        ticks = []
        for wall_ns, payload in ear.samples if ear else []:
            with suppress(InputError):
                ticks.append((wall_ns, decode(payload)[0]))
        return ticks if len(ticks) >= LEAST_TICKS else []

    def _look(self) -> None:
        """Subscribe to what is new, and anew to what has changed."""
        for name, topic in self._wanted.items():
            fitting = [each for each in self._publishers(name) if each.ros_type == topic.ros_type]
            if not fitting:
                continue
            if name not in self._ears:
                self._ears[name] = _Ear(self._node, topic)
            self._ears[name].attend(reliable=all(each.reliable for each in fitting))

    def _take(self) -> None:
        for ear in self._ears.values():
            ear.take()

    def _publishers(self, name: str) -> list[Endpoint]:
        return [
            endpoint_of(info) for info in self._node.node.get_publishers_info_by_topic(local(name))
        ]

    def _subscriptions(self, name: str) -> list[Endpoint]:
        found = self._node.node.get_subscriptions_info_by_topic(local(name))
        return [each for each in map(endpoint_of, found) if each.node != RECORDER]


class _Ear:
    """What was heard of one topic.

    Attributes:
        samples: wall time of reception [ns] and bytes of each message since it last forgot.
    """

    def __init__(self, node: ContractNode, topic: Topic) -> None:
        self._node, self._topic = node, topic
        self._intake: Intake | None = None
        self._reliable = True
        self._lost_before = 0
        self.samples: list[tuple[int, bytes]] = []

    @property
    def _lost(self) -> int:
        return self._intake.lost[self._topic.name] if self._intake is not None else 0

    def attend(self, *, reliable: bool) -> None:
        """Subscribe, or subscribe anew if the last time was otherwise."""
        if self._intake is not None:
            if self._reliable == reliable:
                return
            self._intake.close()
        self._intake, self._reliable = Intake(self._node.node), reliable
        self._lost_before = 0
        self._intake.subscribe(
            self._topic,
            ros_class(self._topic.ros_type),
            lambda payload, received_ns, _: self.samples.append((received_ns, payload)),
            reliability="reliable" if reliable else "best_effort",
        )

    def take(self) -> None:
        """Hear what has come."""
        if self._intake is not None:
            self._intake.take()

    def forget(self) -> None:
        """Begin again."""
        self.samples = []
        self._lost_before = self._lost

    def check_losses(self) -> list[Finding]:
        """Judge the numbers that the middleware gives a publisher's messages."""
        lost = self._lost - self._lost_before
        if not self.samples:
            return []
        if not lost:
            return [Finding(self._topic.name, "losses", True, "none lost on the way")]
        text = f"{lost} messages lost on the way here: the network or this computer is too slow"
        return [Finding(self._topic.name, "losses", None, text)]
