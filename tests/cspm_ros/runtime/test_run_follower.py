"""How a run in real time is followed from outside: who died, who hangs, who does not end."""

import math
import signal
import subprocess

import pytest
from ros_graph import load_ros

load_ros()

from cspm_msgs_py.errors import CspmError  # noqa: E402
from cspm_msgs_py.graph import RECORDER  # noqa: E402
from cspm_msgs_py.schedule import FORCE_CONTROLLER, PLANT  # noqa: E402
from cspm_ros.processes.node_processes import NodeProcesses  # noqa: E402
from cspm_ros.runtime import process_run  # noqa: E402 - after ROS is known to be there
from cspm_ros.runtime import stall_watchdog as watch  # noqa: E402
from cspm_ros.runtime.process_run import _Follower  # noqa: E402
from cspm_ros.runtime.progress_file import Report  # noqa: E402
from cspm_ros.runtime.stall_watchdog import PATIENCE_S, Patience  # noqa: E402

NAMES = (PLANT, FORCE_CONTROLLER, RECORDER)


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """Let the follower look often, and lose its patience soon."""
    for name, seconds in {
        "_LOOK_EVERY_S": 0.005,
        "_AFTERMATH_S": 0.1,
        "_STUCK_S": 0.2,
        "LEAVING_S": 0.2,
        "SILENCE_S": 0.05,
    }.items():
        monkeypatch.setattr(process_run, name, seconds)
    monkeypatch.setattr(watch, "GRACE_S", 0.0)


class Processes:
    """Processes that are none: each look of the follower brings the next event of a plot."""

    def __init__(self, path, *plot, obedient=True):
        self.by_name = dict.fromkeys(NAMES)
        self._path, self._plot, self._obedient = path, list(plot), obedient
        self.codes, self.asked = {}, []
        self.looks = 0

    def ended(self):
        self.looks += 1
        assert self.looks < 2000, "the follower does not end"
        if self._plot:
            event = self._plot.pop(0)
            if isinstance(event, Report):
                event.write(self._path)
            else:
                self.codes |= event
        return dict(self.codes)

    def stop(self, name):
        self.asked.append(name)
        if self._obedient and name not in self.codes:
            Report(2.0, 2.0, finished=True).write(self._path)
            self._plot = []
            self.codes = dict.fromkeys(NAMES, 0) | self.codes

    def obituary(self, name, leaving_s=0.0):
        return f"{name} ended with {self.codes[name]}"

    def begin(self):
        pass

    def warnings(self):
        return []

    def wait(self, seconds):
        return set(self.codes) == set(NAMES)


def follow(
    path, processes, *, realtime=True, stop=lambda: False, leader=PLANT, patience=PATIENCE_S
):
    """Follow to the end; return the follower, its report, and what it reported and showed."""
    reported, shown = [], []
    follower = _Follower(processes, leader, path, realtime, Patience(patience))
    report = follower.follow(shown.append, reported.append, stop)
    return follower, report, reported, shown


def running(seconds):
    return Report(seconds, seconds)


ALL = dict.fromkeys(NAMES, 0)


def test_a_run_that_ends_in_order(tmp_path):
    path = tmp_path / "report.json"
    plot = [running(0.5), running(1.0), Report(1.5, 1.5, finished=True), ALL]
    processes = Processes(path, *plot)
    follower, report, reported, shown = follow(path, processes)
    assert (follower.failure, report.simulated, reported) == (None, 1.5, [])
    assert shown == [0.5, 1.0, 1.5]
    assert processes.asked == []


def test_what_the_start_waits_for_is_reported_when_it_changes(tmp_path):
    path = tmp_path / "report.json"
    waits = [Report(waiting=text) for text in ("waits for a, b", "waits for a, b", "waits for b")]
    processes = Processes(path, *waits, Report(), Report(1.0, 1.0, finished=True), ALL)
    _, _, reported, _ = follow(path, processes)
    assert reported == ["waits for a, b", "waits for b", ""]


@pytest.mark.parametrize("realtime", [True, False])
def test_who_dies_before_the_start_ends_it_at_once(tmp_path, realtime):
    path = tmp_path / "report.json"
    processes = Processes(path, Report(waiting="waits for recorder"), {RECORDER: 2})
    with pytest.raises(CspmError) as error:
        follow(path, processes, realtime=realtime)
    assert str(error.value) == "recorder ended with 2"


def test_a_leader_that_has_not_joined_is_waited_for_and_named(tmp_path):
    path = tmp_path / "report.json"
    processes = Processes(path, {}, {}, Report(1.0, 1.0, finished=True), ALL)
    _, _, reported, _ = follow(path, processes)
    assert reported == ["waits for plant"]


@pytest.mark.parametrize("realtime", [True, False])
@pytest.mark.parametrize(
    ("plot", "missing"),
    [([], "waits for plant"), ([Report(waiting="waits for recorder")], "waits for recorder")],
)
def test_a_start_that_never_completes_is_given_up(tmp_path, monkeypatch, realtime, plot, missing):
    monkeypatch.setattr(watch, "START_FACTOR", 0.1)
    path = tmp_path / "report.json"
    with pytest.raises(CspmError) as error:
        follow(path, Processes(path, *plot), realtime=realtime, patience=0.5)
    assert str(error.value).startswith(f"not all nodes joined within 0.1 s: {missing}; allowed: ")
    assert error.value.exit_code == 1


def test_a_dead_node_is_named_before_one_that_is_late(tmp_path, monkeypatch):
    monkeypatch.setattr(watch, "START_FACTOR", 0.0)
    path = tmp_path / "report.json"
    with pytest.raises(CspmError) as error:
        follow(path, Processes(path, {RECORDER: 3}))
    assert str(error.value) == "recorder ended with 3"


def test_in_lockstep_a_dead_node_ends_the_run_at_once(tmp_path):
    path = tmp_path / "report.json"
    processes = Processes(path, running(0.5), {FORCE_CONTROLLER: -9})
    with pytest.raises(CspmError, match="force_controller ended with -9"):
        follow(path, processes, realtime=False)


def test_in_real_time_the_others_show_what_they_do_when_one_died(tmp_path):
    path = tmp_path / "report.json"
    reports = [running(0.6 + 0.01 * k) for k in range(10)]
    processes = Processes(path, running(0.5), {FORCE_CONTROLLER: -9}, *reports)
    follower, report, _, shown = follow(path, processes)
    assert follower.failure == "force_controller ended with -9, at 0.5 s"
    # It was the leader that was asked to end the run, later.
    assert set(processes.asked) == {PLANT}
    assert shown[-1] > 0.6
    assert report.finished


def test_the_first_who_died_is_named(tmp_path):
    path = tmp_path / "report.json"
    processes = Processes(path, running(0.5), {FORCE_CONTROLLER: -9}, {RECORDER: -15})
    follower, *_ = follow(path, processes)
    assert follower.failure == "force_controller ended with -9, at 0.5 s"


def test_who_left_in_order_long_before_the_leader_is_named_too(tmp_path):
    path = tmp_path / "report.json"
    reports = [running(0.6 + 0.01 * k) for k in range(50)]
    processes = Processes(path, running(0.5), {RECORDER: 0}, *reports)
    follower, *_ = follow(path, processes)
    assert follower.failure.startswith("recorder ended with 0, at ")


@pytest.mark.parametrize("realtime", [True, False])
@pytest.mark.parametrize("code", [0, -signal.SIGALRM])
def test_who_left_in_order_once_no_step_follows_is_not_missed(tmp_path, realtime, code):
    path = tmp_path / "report.json"
    writing = [Report(1.0, 1.0 + 0.01 * k, ended=True) for k in range(50)]
    over = Report(1.0, 1.0, ended=True, finished=True)
    processes = Processes(path, *writing[:1], {FORCE_CONTROLLER: code}, *writing, over, ALL)
    follower, report, *_ = follow(path, processes, realtime=realtime)
    assert (follower.failure, report.finished) == (None, True)


def test_who_died_while_others_write_ends_the_run(tmp_path):
    path = tmp_path / "report.json"
    processes = Processes(path, Report(1.0, 1.0, ended=True), {RECORDER: -9})
    with pytest.raises(CspmError, match="recorder ended with -9"):
        follow(path, processes, realtime=False)


def test_in_lockstep_who_left_long_before_the_last_step_ends_the_run(tmp_path):
    path = tmp_path / "report.json"
    reports = [running(0.6 + 0.01 * k) for k in range(50)]
    processes = Processes(path, running(0.5), {FORCE_CONTROLLER: 0}, *reports)
    with pytest.raises(CspmError, match="force_controller ended with 0"):
        follow(path, processes, realtime=False)


@pytest.mark.parametrize("leader", [PLANT, RECORDER])
def test_a_leader_that_died_under_way_is_named_and_the_run_summed_up(tmp_path, leader):
    path = tmp_path / "report.json"
    processes = Processes(path, running(0.5), running(1.2), {leader: -9})
    follower, report, _, _ = follow(path, processes, leader=leader)
    assert follower.failure == f"{leader} ended with -9, at 1.2 s"
    assert report.simulated == 1.2
    assert not report.finished


def test_a_leader_that_was_stopped_is_given_up(tmp_path):
    path = tmp_path / "report.json"
    processes = Processes(path, running(0.5), running(1.2), obedient=False)
    follower, report, _, _ = follow(path, processes)
    assert follower.failure == "plant gave no sign of life for 0 s, at 1.2 s"
    assert report.simulated == 1.2


def test_before_the_start_a_leader_may_be_silent(tmp_path):
    """Somebody's drivers are switched on when they are."""
    path = tmp_path / "report.json"
    waits = [Report(waiting="waits for /bar/pose")] * 100
    processes = Processes(path, *waits, Report(1.0, 1.0, finished=True), ALL)
    follower, report, _, _ = follow(path, processes)
    assert (follower.failure, report.finished) == (None, True)
    assert processes.looks > 100


def test_a_stop_asks_the_leader(tmp_path):
    path = tmp_path / "report.json"
    reports = [running(0.5 + 0.01 * k) for k in range(20)]
    processes = Processes(path, *reports)
    follower, report, _, _ = follow(path, processes, stop=lambda: processes.looks > 10)
    assert set(processes.asked) == {PLANT}
    assert (follower.failure, report.finished) == (None, True)


@pytest.mark.parametrize("realtime", [True, False])
def test_a_leader_that_does_not_obey_a_stop_is_given_up(tmp_path, realtime):
    path = tmp_path / "report.json"
    processes = Processes(path, running(0.5), obedient=False)
    follower, *_ = follow(path, processes, realtime=realtime, stop=lambda: processes.looks > 5)
    assert follower.failure.startswith("plant gave no sign of life")
    assert set(processes.asked) <= {PLANT}


def test_who_does_not_end_with_the_run_is_named(tmp_path):
    path = tmp_path / "report.json"
    processes = Processes(path, running(0.5), Report(1.0, 1.0, finished=True), {PLANT: 0})
    follower, report, _, _ = follow(path, processes)
    assert follower.failure == "force_controller, recorder did not end with the run"
    assert report.finished


@pytest.mark.parametrize(
    ("took", "patience", "realtime", "wanted"),
    [
        (0.1, 20.0, True, 0.2),
        (60.0, 20.0, True, 60.0),
        (60.0, math.inf, True, 0.2),
        (60.0, 20.0, False, 600.0),
    ],
)
def test_nodes_may_take_as_long_to_leave_as_they_took_to_start(
    tmp_path, monkeypatch, took, patience, realtime, wanted
):
    """But not as long as somebody's drivers took to come; ten times that where one gives way."""
    monkeypatch.setattr(watch.StartWatch, "elapsed", took)
    path, allowed = tmp_path / "report.json", []
    starting = Report(waiting="waits for recorder")
    processes = Processes(path, starting, Report(1.0, 1.0, finished=True), ALL)
    processes.wait = lambda seconds: allowed.append(seconds) or True
    follow(path, processes, realtime=realtime, patience=patience)
    assert allowed == [wanted]


class Host:
    """Nodes that are no processes of a run."""

    def __init__(self, **nodes):
        self.nodes = nodes

    def close(self):
        pass


class Program:
    """A program in a node's place."""

    def __init__(self, *words):
        self._process = subprocess.Popen(words)
        self.pid = self._process.pid
        self.poll, self.send_signal = self._process.poll, self._process.send_signal

    def wait(self, seconds):
        return self._process.wait(seconds) is not None


def test_a_node_is_asked_to_end_once(tmp_path):
    """A second signal would end it without order."""
    sent = []

    class Child:
        def poll(self):
            return None

        def send_signal(self, number):
            sent.append(number)

    processes = NodeProcesses(Host(plant=Child()), tmp_path)
    for _ in range(3):
        processes.stop(PLANT)
    assert sent == [signal.SIGINT]


def test_no_answer_comes_from_who_is_stopped_and_not_from_who_is_slow(tmp_path):
    log = "cspm node x: nothing moved for 4 s: it waits\n"
    (tmp_path / f"{FORCE_CONTROLLER}.log").write_text(log)
    host = Host(
        plant=Program("sleep", "600"),
        force_controller=Program("false"),
        recorder=Program("sleep", "0.5"),
    )
    processes = NodeProcesses(host, tmp_path)
    host.nodes[PLANT].send_signal(signal.SIGSTOP)
    try:
        host.nodes[FORCE_CONTROLLER].wait(60.0)
        reported = processes.obituary(FORCE_CONTROLLER, 600.0)
    finally:
        host.nodes[PLANT].send_signal(signal.SIGKILL)
        processes.wait(60.0)
    assert reported == (
        "no answer from plant; force_controller ended with exit code 1 before the run did: cspm"
        " node x: nothing moved for 4 s: it waits"
    )
