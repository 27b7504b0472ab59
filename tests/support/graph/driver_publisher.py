"""Drivers that send: a simulated lab's signals over real ROS topics, on the wall clock."""

import itertools
import threading
import time
from dataclasses import replace

import numpy as np
from driver_samples import TENSION
from rclpy.qos import QoSProfile, ReliabilityPolicy

from cspm_msgs_py.ros.contract_node import ros_class
from cspm_msgs_py.ros.session import Session
from cspm_msgs_py.schedule import TORQUE_COMMAND
from cspm_msgs_py.topics import BRAKE, CLOCK
from cspm_msgs_py.wire import WireWriter

RATE = 20
PERIOD_NS = 1_000_000_000 // RATE
# `cspm check-drivers` is set to drivers that are that slow.
SLOW = [f"--set=rates.{name}={RATE}" for name in ("winches", "load_cells", "motion_capture")]


def slowed(lab):
    """The same lab, but only as many messages as a loaded computer can send in time."""

    def slow(feed):
        period_ns = int(feed.stamps[1] - feed.stamps[0])
        return feed.only(slice(None, None, PERIOD_NS // period_ns))

    return replace(lab, feeds={name: slow(feed) for name, feed in lab.feeds.items()})


class Drivers:
    """Sends the rows of a lab's feeds one after another, stamped with the time of today.

    `best_effort` names topics sent so; `doubled` topics that have a second, silent publisher;
    `sim_start_ns` runs `/clock` and all stamps from there. `pulled` is added to the tensions of
    `cables`.
    """

    def __init__(self, lab, domain, *, best_effort=(), doubled=(), drive=True, sim_start_ns=None):
        self._session = Session(domain_id=domain)
        self._node = self._session.node("lab").node
        self._sim_start_ns = sim_start_ns
        self.cables = np.array(lab.testbed.cable_names)
        self.pulled = 0.0
        self._feeds = []
        for name, feed in lab.feeds.items():
            for _ in range(1 + (name in doubled)):
                send = self._publisher(feed.topic, name in best_effort)
            self._feeds.append((name, send, WireWriter(feed.topic).encode, feed.rows))
        if sim_start_ns is not None:
            self._clock = self._publisher(CLOCK, True), WireWriter(CLOCK).encode
        if drive:
            node = self._session.node("drive").node
            for topic in (lab.testbed.topics[TORQUE_COMMAND], BRAKE):
                node.create_subscription(ros_class(topic.ros_type), topic.name, id, 10)
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._send, daemon=True)

    def _publisher(self, topic, best_effort):
        qos = QoSProfile(depth=10)
        qos.reliability = ReliabilityPolicy["BEST_EFFORT" if best_effort else "RELIABLE"]
        made = self._node.create_publisher(ros_class(topic.ros_type), topic.name, qos)
        return made.publish

    def _send(self):
        began = time.time_ns()
        for i in itertools.count():
            due = i * PERIOD_NS
            if self._over.wait(max(0.0, (began + due - time.time_ns()) * 1e-9)):
                return
            stamp = due + (began if self._sim_start_ns is None else self._sim_start_ns)
            if self._sim_start_ns is not None:
                publish, encode = self._clock
                publish(encode(stamp, []))
            for name, send, encode, rows in self._feeds:
                row = rows[i % len(rows)] + (self.pulled if name == TENSION else 0.0)
                send(encode(stamp, row))

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._over.set()
        self._thread.join()
        self._session.close()
