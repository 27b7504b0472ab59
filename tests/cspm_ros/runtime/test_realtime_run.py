"""Runs in real time from start to end, as a user starts them, over the real middleware."""

import json
import os
import signal
import subprocess
import sys
from contextlib import ExitStack

import numpy as np
import pytest
from error_lines import said
from realtime_graph import (
    APART,
    GUARDS,
    PATIENCE_S,
    TOGETHER,
    Command,
    Evidence,
    Graph,
    Witness,
    slow_bundle,
    topics_of,
    under_way,
    warm_processes,
)
from ros_graph import load_ros
from run_samples import bundle_of

from cspm_control.controllers.torque_profile import TorqueGenerator
from cspm_msgs_py.graph import RECORDER
from cspm_msgs_py.recording import Recording, overview
from cspm_msgs_py.schedule import FORCE_CONTROLLER, PLANT, TENSION, TORQUE_COMMAND
from cspm_ros.runtime.exit_watchdog import IN_ORDER
from cspm_run.recorded_timing import timing_of

load_ros()
pytestmark = [pytest.mark.slow, pytest.mark.realtime]

MS = 1_000_000
WAITS = ("stale_after", "watchdog", "lateness")


@pytest.mark.parametrize("processes", [TOGETHER, APART])
def test_a_run_keeps_the_bar_where_it_is_and_says_how_late_it_was(tmp_path, processes):
    bundle = slow_bundle("duration=3.0")
    with Command(tmp_path, bundle, processes) as command:
        code, out, err = command.done()
    assert (code, err) == (0, ""), out
    assert "real time: totals of the run" in out
    for word in ("tension_distribution", "deadlines", "late, ms", "lost"):
        assert word in out
    summary = json.loads((command.folder / "summary.json").read_text())
    assert summary["mode"] == "realtime"
    assert summary["duration_s"] == pytest.approx(3.0, abs=0.5)
    reported = summary["realtime"]
    assert reported["recorder"] == {"lost": 0, "refused": 0}
    assert set(reported) == {*bundle_nodes(bundle), PLANT, "recorder"}
    for name in (PLANT, FORCE_CONTROLLER):
        assert reported[name]["deadlines_missed"] >= 0
        assert reported[name]["refused"] == 0
    # Near its reference, however late commands were.
    assert max(error["max"] for error in list(summary["errors"].values())[:3]) < 0.01
    found = overview(command.folder)
    assert found.complete
    counts = {topic.name: topic.count for topic in found.topics}
    assert counts["/truth/bar/pose"] == 600
    assert counts["/bar/pose"] == 300
    assert counts["/clock"] == 0 if "/clock" in counts else True
    evidence = Evidence(command.folder)
    for topic, rows in evidence.rows.items():
        # Stamped by the wall, in order, and logged when they came.
        assert (np.diff(rows.stamp_ns) > 0).all(), topic
        assert (rows.log_ns >= rows.stamp_ns - MS).all(), topic
    assert (np.diff(evidence.stamps("/truth/bar/pose")) == 5 * MS).all()
    with Recording(command.folder) as recording:
        assert recording.metadata["cspm"]["mode"] == "realtime"


def bundle_nodes(bundle):
    from cspm_msgs_py.schedule import schedule_of

    return schedule_of(bundle.scenario, bundle.testbed.testbed).nodes


@pytest.mark.parametrize("processes", [TOGETHER, APART])
def test_interrupting_ends_the_run_early_with_a_complete_recording(tmp_path, processes):
    bundle = slow_bundle("duration=600.0")
    with (
        Command(tmp_path, bundle, processes) as command,
        Witness(command.domain, topics_of(bundle, TENSION)) as witness,
    ):
        under_way(witness)
        nodes = command.nodes()
        assert bool(nodes) == (processes == APART)
        # By the wall clock a recorder that gives way would lose messages.
        policies = {os.sched_getscheduler(node.pid) for node in nodes.values()}
        assert os.SCHED_BATCH not in policies
        command.process.send_signal(signal.SIGINT)
        code, out, err = command.done()
    assert (code, err) == (1, "")
    assert "interrupted after " in out
    assert "the recording is complete so far" in out
    assert overview(command.folder).complete
    assert len(Evidence(command.folder).stamps(TENSION)) >= 100


def test_a_dead_node_is_named_and_what_the_others_did_is_recorded(tmp_path):
    bundle = slow_bundle("duration=600.0")
    with (
        Command(tmp_path, bundle, APART) as command,
        Witness(command.domain, topics_of(bundle, TENSION)) as witness,
    ):
        under_way(witness)
        command.nodes()[FORCE_CONTROLLER].kill()
        code, out, err = command.done()
    assert code == 1
    assert said(err).startswith("force_controller ended by signal SIGKILL before the run did")
    assert err.count("\n") == 1
    assert overview(command.folder).complete
    evidence = Evidence(command.folder)
    ((_, reason),) = evidence.alarms("plant/watchdog")
    # The state that the last command answers is as old as the command, and a little older.
    silent = f"no {TORQUE_COMMAND} for ", f"machine too busy: {TORQUE_COMMAND} of "
    assert reason.startswith(silent)
    assert "recording" in out


@pytest.fixture(scope="module")
def warm():
    return warm_processes()


def test_deadlines_missed_are_counted_reported_and_recorded(warm, tmp_path):
    """A node that stood still for a while missed what was due then."""
    bundle = slow_bundle(*(f"safety.{key}=5" for key in WAITS))
    with (
        Graph(warm, bundle, tmp_path) as graph,
        Witness(graph.domain, topics_of(bundle, TENSION)) as witness,
    ):
        graph.start()
        under_way(witness)

        def missed(name):
            reported = witness.until_said(name, lambda _: True, "a status")
            return int(reported.values["deadlines_missed"])

        before = {name: missed(name) for name in (PLANT, FORCE_CONTROLLER)}
        graph.send(FORCE_CONTROLLER, signal.SIGSTOP)
        witness.until_more(TENSION, 50)
        graph.send(FORCE_CONTROLLER, signal.SIGCONT)
        witness.until_more(TENSION, 50)
        after = {name: missed(name) for name in before}
        witness.until_running(*GUARDS)
        assert set(graph.end().values()) <= IN_ORDER
    for name, count in before.items():
        assert after[name] - count >= 45, name
    reported = timing_of(graph.folder)
    for name, count in after.items():
        assert reported[name]["deadlines_missed"] >= count
    assert reported[FORCE_CONTROLLER]["worst_latency_ms"] > 5.0


def test_on_a_busy_processor_deadlines_are_missed_and_reported(warm, tmp_path):
    """At 1 kHz, with more to do than the processor can."""
    bundle = bundle_of("rest", *(f"safety.{key}=10" for key in WAITS))
    burners = [
        subprocess.Popen([sys.executable, "-c", "while True: pass"])
        for _ in range(3 * (os.cpu_count() or 1))
    ]

    def relieve():
        for burner in burners:
            burner.kill()
            burner.wait()

    def late(witness, node):
        missed = "deadlines_missed"
        witness.until_said(node, lambda s: int(s.values[missed]) > 0, missed, 2 * PATIENCE_S)

    with (
        ExitStack() as stack,
        Graph(warm, bundle, tmp_path, first=False) as graph,
        Witness(graph.domain) as witness,
    ):
        stack.callback(relieve)
        graph.start()
        late(witness, PLANT)
        late(witness, FORCE_CONTROLLER)
        # The recorder is as busy as they are, and has what they say after it.
        relieve()
        for node in (PLANT, FORCE_CONTROLLER):
            late(witness, node)
        # A bar that nobody held for seconds may end the run by itself.
        witness.latest.pop(RECORDER, None)
        plant = graph.processes[PLANT]
        witness.until(lambda: RECORDER in witness.latest or not plant.is_alive(), RECORDER)
        graph.end()
    reported = timing_of(graph.folder)
    assert reported[PLANT]["deadlines_missed"] > 0
    assert reported[FORCE_CONTROLLER]["deadlines_missed"] > 0
    assert reported[FORCE_CONTROLLER]["worst_latency_ms"] > 1.0


def test_prescribed_torques_follow_the_time_since_the_start(warm, tmp_path):
    """Of a rig of one winch, whose torques are a matter of the clock alone."""
    rates = "rates={plant: 200, winches: 200, load_cells: 200, wave_trajectory: 200,"
    rates += " force_controller: 200, motion_capture: 100}"
    bundle = bundle_of("one_winch", rates, "safety.stale_after=0.5", "safety.watchdog=0.5")
    with Graph(warm, bundle, tmp_path, steps=400) as graph:
        graph.start()
        assert set(graph.join().values()) <= IN_ORDER
    evidence = Evidence(graph.folder)
    start = evidence.stamps("/truth/winches/state")[0]
    generator = TorqueGenerator(bundle.scenario.control.torque, bundle.testbed.testbed.cable_names)
    stamps, torques = evidence.torques()
    assert len(stamps) > 200
    for stamp, torque in zip(stamps, torques, strict=True):
        np.testing.assert_array_equal(torque, generator.step(int(stamp - start)))
    applied = np.split(evidence.rows["/truth/winches/state"].rows, 3, axis=1)[2]
    assert np.ptp(applied) > 0.1
    assert not evidence.alarms(FORCE_CONTROLLER)


def test_nobody_runs_a_node_that_the_scenario_does_not_have(warm, tmp_path):
    bundle = bundle_of("one_winch")
    with Graph(warm, bundle, tmp_path) as graph:
        graph.start("wave_trajectory", nodes=())
        assert graph.join() == {"wave_trajectory": 2}
        assert graph.log("wave_trajectory").read_text() == (
            "cspm node wave_trajectory: scenario one_winch has none, allowed: plant,"
            " force_controller, recorder\n"
        )
