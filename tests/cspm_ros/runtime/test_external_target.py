"""A bar that follows a target whose pose somebody else's driver sends, on the wall clock."""

import time

import numpy as np
import pytest
from realtime_graph import Evidence, Graph, Witness, slow_bundle, warm_processes
from ros_graph import load_ros

from cspm_msgs_py.schedule import BAR_REFERENCE, FORCE_CONTROLLER, TARGET_POSE, TARGET_TRACKER
from cspm_msgs_py.wire import WireWriter
from cspm_ros.runtime.exit_watchdog import IN_ORDER

load_ros()
pytestmark = [pytest.mark.slow, pytest.mark.realtime]

RISE, START_S = 0.02, 1.0


class Driver:
    """Sends the target's pose at rest, and from a second on raised by 2 cm."""

    def __init__(self, bundle, witness):
        topic = bundle.testbed.testbed.topics[TARGET_POSE]
        self._encode, self._send = WireWriter(topic).encode, witness.publisher(topic)
        self._row = np.array([*bundle.scenario.target.mean_pose[:3], 0.0, 0.0, 0.0, 1.0])
        self._period = 1.0 / bundle.scenario.rates.motion_capture
        self._witness = witness

    def switch_on(self):
        self._witness.session.every(self._period, self._tell)

    def rise(self):
        self._row[2] -= RISE

    def _tell(self):
        self._send(self._encode(time.time_ns(), self._row))


def test_the_run_waits_for_the_driver_and_follows_it(tmp_path):
    still = ("target.motion={type: still}", "winch_frame.motion={type: still}")
    bundle = slow_bundle("target.source=external", *still, scenario="calm_measured_target")
    with (
        Graph(warm_processes(), bundle, tmp_path, steps=1600) as graph,
        Witness(graph.domain, [bundle.testbed.testbed.topics[BAR_REFERENCE]]) as witness,
    ):
        driver = Driver(bundle, witness)
        graph.start()
        witness.session.spin_until(lambda: False, 5.0)
        assert witness.counts[BAR_REFERENCE] == 0
        driver.switch_on()
        witness.until_running(FORCE_CONTROLLER)
        witness.until_more(BAR_REFERENCE, 100)
        driver.rise()
        witness.until_said(TARGET_TRACKER, lambda status: status.level == 0, "ok")
        witness.until(lambda: not any(p.is_alive() for p in graph.processes.values()), "the end")
        assert set(graph.join().values()) <= IN_ORDER
    evidence = Evidence(graph.folder)
    heave = evidence.rows[BAR_REFERENCE].rows[:, 2]
    offset = bundle.scenario.bar_offset[2]
    rest = bundle.scenario.target.mean_pose[2] + offset
    assert heave[0] == pytest.approx(rest, abs=1e-9)
    assert heave[-1] == pytest.approx(rest - RISE, abs=1e-3)
    assert evidence.rows["/truth/bar/pose"].rows[-1, 2] == pytest.approx(rest - RISE, abs=8e-3)
    assert "/target/reference" not in evidence.rows
    assert not evidence.alarms(FORCE_CONTROLLER)
