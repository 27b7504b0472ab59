"""A process per node: the same messages as without ROS, and an orderly end of every kind."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest
from cspm_process import child, grown
from error_lines import said
from loops import WILD
from process_runs import processes, use_site
from ros_graph import (
    NODES,
    assert_same,
    content,
    difference,
    done,
    load_ros,
    new_domain,
    node_processes,
    words_of,
)
from run_samples import bundle_of

from cspm_msgs_py.errors import CspmError
from cspm_msgs_py.recording import Recording, overview
from cspm_msgs_py.recording.recover import recover
from cspm_run.recorded_run import run
from cspm_run.resim import resimulate

load_ros()

from cspm_ros.runtime.graph_run import run_graph  # noqa: E402

pytestmark = pytest.mark.compiled

# Reading the calm sea's waves takes longer than hanging at rest, and says no more here.
LONG = bundle_of("rest", "duration=3600")
LOST_S = 0.2
# Nobody waits for ever; on a machine with six times its load such a run takes four minutes.
LONGEST_S = 600.0


def gone(found, seconds=10.0):
    """Return whether processes end within a time."""
    return not psutil.wait_procs(found, seconds)[1]


class Witness:
    """Looks at a run now and then, and may act once it is far enough.

    Attributes:
        reported: the times simulated that it was reported [s].
        nodes: the nodes' processes by name, once they run.
    """

    def __init__(self, *acts, after=0.3):
        self.reported, self.nodes, self._acts, self._after = [], {}, list(acts), after

    def __call__(self, now):
        self.reported.append(now)
        if now >= self._after and self._acts:
            self.nodes = self.nodes or node_processes()
            self._acts.pop(0)(self.nodes)


@pytest.mark.parametrize(
    ("scenario", "steps"),
    [
        (("calm", "control.record_internals=true"), 400),
        pytest.param(("one_winch",), 300, marks=pytest.mark.slow),
    ],
)
def test_the_recording_is_the_one_of_a_run_in_process(tmp_path, scenario, steps):
    bundle, witness = bundle_of(*scenario), Witness(lambda nodes: None, after=0.0)
    kept = run(bundle, tmp_path / "inprocess", steps=steps)
    result = processes(bundle, tmp_path / "processes", witness, steps=steps)
    assert_same(tmp_path / "inprocess", tmp_path / "processes")
    assert content(tmp_path / "inprocess") == content(tmp_path / "processes")
    assert (result.messages, result.simulated) == (kept.messages, kept.simulated)
    assert (result.failure, result.interrupted, result.mode) == (None, False, "processes")
    assert witness.reported == sorted(witness.reported)
    with Recording(tmp_path / "processes") as recording:
        assert recording.complete
        assert recording.metadata["cspm"]["mode"] == "processes"
    assert gone(list(witness.nodes.values()))


# The recorder has nothing left to compute, but keeps the run, as on a machine that is full. Then
# the plant keeps Python's lock for ever, as the middleware does at times when two nodes leave at
# once.
_SLOW_AND_STUCK = """
import ctypes, sys, time
from cspm_msgs_py.ros.session import Session
from cspm_ros.runtime.lockstep_recorder import LockstepRecorder
end, leave = LockstepRecorder.end, Session.close
LockstepRecorder.end = lambda self, last_step: (time.sleep(3), end(self, last_step))
Session.close = lambda self: (ctypes.PyDLL(None).sleep(600) if "plant" in sys.argv else leave(self))
"""


@pytest.mark.slow
def test_neither_who_leaves_early_nor_who_cannot_leave_is_missed(tmp_path, monkeypatch):
    """The controllers leave in order before all is written; the plant has to be ended."""
    use_site(tmp_path, monkeypatch, _SLOW_AND_STUCK)
    result = processes(bundle_of("rest"), tmp_path / "run", steps=100)
    assert (result.failure, result.interrupted, result.simulated) == (None, False, 0.1)
    with Recording(tmp_path / "run") as recording:
        assert recording.complete


@pytest.mark.slow
def test_a_divergence_ends_the_run_and_keeps_its_recording(tmp_path):
    settings = [word for override in WILD for word in ("--set", override)]
    folder = tmp_path / "bag"
    code, _, err = done(
        "run", "rest", "--mode", "processes", "--out", folder, *settings, timeout=LONGEST_S
    )
    assert code == 1
    kept = run(bundle_of("rest", *WILD), tmp_path / "inprocess")
    begin, _, end = kept.failure.partition("; before it: ")
    assert said(err).startswith(f"diverged at {begin}; before it: ")
    assert err.count("\n") == 1
    assert end
    assert_same(tmp_path / "inprocess", folder)
    with Recording(folder) as recording:
        assert recording.complete


# Being ended


@contextmanager
def burners():
    """Keep every processor busy."""
    busy = [
        subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(os.cpu_count())
    ]
    try:
        yield
    finally:
        for each in busy:
            each.kill()
            each.wait()


@pytest.mark.slow
def test_a_busy_machine_changes_nothing(tmp_path):
    bundle = bundle_of("worst_case")
    run(bundle, tmp_path / "inprocess", steps=200)
    with burners():
        run_graph(bundle, tmp_path / "graph", steps=200, domain_id=new_domain())
        processes(bundle, tmp_path / "processes", steps=200)
    assert_same(tmp_path / "inprocess", tmp_path / "graph")
    assert_same(tmp_path / "inprocess", tmp_path / "processes")


def behind(nodes):
    """Return who of the nodes gives way to others."""
    policies = {name: os.sched_getscheduler(node.pid) for name, node in nodes.items()}
    return {name for name, policy in policies.items() if policy == os.SCHED_BATCH}


def launched(folder, mode):
    return child(
        "run",
        "rest",
        "--duration",
        "3600",
        "--mode",
        mode,
        "--out",
        folder,
        env=os.environ | {"ROS_DOMAIN_ID": str(new_domain())},
    )


@pytest.mark.parametrize(
    ("mode", "number"),
    [
        ("processes", signal.SIGINT),
        pytest.param("graph", signal.SIGTERM, marks=pytest.mark.slow),
    ],
)
def test_interrupting_the_command_leaves_a_complete_recording(tmp_path, mode, number):
    folder = tmp_path / "bag"
    process = launched(folder, mode)
    try:
        grown(process, folder, 100_000)
        nodes = node_processes(process.pid)
        assert set(nodes) == (set(NODES) if mode == "processes" else set())
        # Only the recorder gives way to others.
        wait_for(lambda: behind(nodes) == set(nodes) & {"recorder"}, process)
        process.send_signal(number)
        out, err = process.communicate(timeout=LONGEST_S)
    finally:
        process.kill()
    assert (process.returncode, err) == (1, "")
    assert "interrupted after " in out
    assert "the recording is complete so far" in out
    assert gone(list(nodes.values()))
    assert overview(folder).complete
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["mode"] == mode
    assert summary["messages"]["/clock"] == round(summary["duration_s"] * 1000)
    assert resimulate(folder, lambda now, total: None).difference is None


@pytest.mark.slow
@pytest.mark.parametrize("when", ["starting", "running"])
def test_the_nodes_end_with_a_launcher_that_is_killed(tmp_path, when):
    folder = tmp_path / "bag"
    process = launched(folder, "processes")
    try:
        if when == "running":
            grown(process, folder, 100_000)
        else:
            wait_for(lambda: len(node_processes(process.pid)) == len(NODES), process)
        nodes = node_processes(process.pid)
        assert set(nodes) == set(NODES)
        words = words_of(nodes["plant"])
        place = Path(words[words.index("--params-file") + 1]).parent
    finally:
        process.kill()
        process.communicate()
    try:
        assert gone(list(nodes.values()), 20.0)
        if when == "running":
            stopped = json.loads((place / "report.json").read_text())["simulated"]
            recover(folder)
            assert overview(folder).complete
            found = resimulate(folder, lambda now, total: None)
            assert found.difference is None
            with Recording(folder) as recording:
                assert recording.end_ns * 1e-9 >= stopped - LOST_S
    finally:
        # A later run clears what a killed one left, perhaps at this moment.
        shutil.rmtree(place, ignore_errors=True)


def wait_for(condition, process, seconds=LONGEST_S):
    end = time.monotonic() + seconds
    while not condition():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        try:
            process.wait(0.05)
        except subprocess.TimeoutExpired:
            continue


def assert_readable(folder, witness):
    """Hold a recording to be what a run in process records, to nearly where the run stopped."""
    recover(folder)
    assert overview(folder).complete
    assert resimulate(folder, lambda now, total: None).difference is None
    with Recording(folder) as recording:
        assert recording.end_ns * 1e-9 >= witness.reported[-1] - LOST_S


# One that is killed leads or records; a follower that ends is one that is asked to.
@pytest.mark.slow
@pytest.mark.parametrize("node", ["plant", "recorder"])
def test_a_node_that_is_killed_is_named(tmp_path, node):
    """Before, it stands still for a while, which changes nothing."""
    witness = Witness(
        lambda nodes: nodes[node].suspend(),
        lambda nodes: None,
        lambda nodes: nodes[node].resume(),
        lambda nodes: None,
        lambda nodes: nodes[node].kill(),
    )
    with pytest.raises(CspmError) as caught:
        processes(LONG, tmp_path / "bag", witness)
    assert str(caught.value) == (
        f"{node} ended by signal SIGKILL before the run did;"
        f" `cspm recover {tmp_path / 'bag'}` restores its index"
    )
    assert caught.value.exit_code == 1
    assert len(witness.nodes) == len(NODES)
    assert gone(list(witness.nodes.values()), 0.0)
    assert_readable(tmp_path / "bag", witness)


# One that is stopped is waited for by all others, or by the plant, as a recorder would be.
@pytest.mark.slow
@pytest.mark.parametrize("node", ["plant", "motion_controller"])
def test_a_node_that_is_stopped_is_named(tmp_path, node):
    # Every node has looked at the run more than once by then, and is beyond its first steps.
    witness = Witness(lambda nodes: nodes[node].suspend(), after=0.8)
    with pytest.raises(CspmError) as caught:
        processes(LONG, tmp_path / "bag", witness, patience_s=4.0)
    others = "|".join(set(NODES) - {node})
    assert re.match(
        rf"no answer from {node}; ({others}) ended with exit code 1 before the run did:"
        rf" cspm node \1: nothing moved for 4 s: \1 waits for \S.*$",
        str(caught.value),
    )
    assert gone(list(witness.nodes.values()), 0.0)
    assert_readable(tmp_path / "bag", witness)


@pytest.mark.slow
def test_a_node_that_is_asked_to_end_is_named(tmp_path):
    witness = Witness(lambda nodes: nodes["motion_controller"].terminate())
    with pytest.raises(CspmError) as caught:
        processes(LONG, tmp_path / "bag", witness)
    assert str(caught.value) == (
        "motion_controller ended with exit code 0 before the run did;"
        f" `cspm recover {tmp_path / 'bag'}` restores its index"
    )
    assert_readable(tmp_path / "bag", witness)


# What the nodes cannot do


def test_what_a_node_cannot_do_is_reported_as_its_last_words(tmp_path):
    (tmp_path / "bag").mkdir()
    with pytest.raises(CspmError) as caught:
        processes(bundle_of("one_winch"), tmp_path / "bag", steps=10)
    assert str(caught.value) == (
        "recorder ended with exit code 2 before the run did: cspm node recorder:"
        f" {tmp_path}/bag: already exists, allowed: a new folder"
    )
    assert list((tmp_path / "bag").iterdir()) == []


@pytest.mark.slow
def test_nodes_of_slow_controllers_may_stand_still_for_a_while(tmp_path):
    """What is sent to them meanwhile is more than their queues hold."""
    rates = ("motion_controller=20", "tension_distribution=20", "motion_capture=1000")
    bundle = bundle_of("rest", *[f"rates.{rate}" for rate in (*rates, "wave_trajectory=50")])
    slow = ("motion_controller", "wave_trajectory", "tension_distribution")
    acts = [
        act
        for node in slow
        for act in (lambda n, node=node: n[node].suspend(), lambda n, node=node: n[node].resume())
    ]
    processes(bundle, tmp_path / "bag", Witness(*acts, after=0.05), steps=1000)
    run(bundle, tmp_path / "inprocess", steps=1000)
    assert_same(tmp_path / "inprocess", tmp_path / "bag")
    assert difference(tmp_path / "bag", tmp_path / "inprocess") is None
