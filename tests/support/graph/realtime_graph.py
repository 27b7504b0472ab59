"""Runs in real time whose nodes a test starts, stops and kills one by one, and their witness."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections import defaultdict
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from first_in_line import go_first
from ros_graph import new_domain, node_processes
from run_samples import bundle_of

from bench.performance.slow_machine import slow_overrides
from cspm_msgs_py.diagnostics import decode_diagnostics
from cspm_msgs_py.graph import RECORDER
from cspm_msgs_py.message import carries_row
from cspm_msgs_py.recording import Recording
from cspm_msgs_py.ros.contract_node import ros_class
from cspm_msgs_py.ros.qos import contract_qos
from cspm_msgs_py.ros.session import Session
from cspm_msgs_py.schedule import (
    FORCE_CONTROLLER,
    PLANT,
    TENSION,
    TORQUE_COMMAND,
    schedule_of,
)
from cspm_msgs_py.topics import BRAKE, DIAGNOSTICS, EMERGENCY_STOP
from cspm_ros.runtime.node_parameters import REALTIME, NodeParameters, write_parameters
from cspm_run.bundle import SCENARIO

APART, TOGETHER = "--process-per-node", "--one-process"
CSPM = [sys.executable, "-c", "from cspm.cli.main import main; main()"]
WATCHDOG = "plant/watchdog"
GUARDS = (FORCE_CONTROLLER, WATCHDOG)
# A start takes its time where others use the processor.
START_S = 300.0
# What the run's leader says is none of the hardware's business, nor the other way round.
OWN_RUN = {f"/run/{name}": f"/hardware/{name}" for name in ("start", "end", "progress")}

SUPPORT = Path(__file__).resolve().parents[1]
FOLDERS = (str(SUPPORT / "graph"), str(SUPPORT))
# Long enough for a machine that has much else to do.
PATIENCE_S = 120.0
STALE_AFTER = 0.5


def slow_bundle(*overrides, scenario="rest"):
    """Return a scenario of the thesis's machine at 200 Hz, patient with a busy computer.

    Such a computer lets the bar go astray by more than three times its tracking error.
    """
    waits = (f"safety.{key}={STALE_AFTER}" for key in ("stale_after", "watchdog", "lateness"))
    wait = (*waits, "safety.following_error=0.5")
    return bundle_of(scenario, *slow_overrides(), *wait, *overrides)


def warm_processes():
    """Return what makes processes that are forked from a warm one."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["realtime_child"])
    before = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = os.pathsep.join([*FOLDERS, *([before] if before else [])])
    try:
        multiprocessing.forkserver.ensure_running()
    finally:
        if before is None:
            del os.environ["PYTHONPATH"]
        else:
            os.environ["PYTHONPATH"] = before
    return context


class Graph:
    """A run's processes; as a context it ends them all."""

    def __init__(self, context, bundle, place, *, members=None, steps=0, domain=None, first=True):
        self.place, self.bundle = Path(place), bundle
        self.domain = domain or new_domain()
        schedule = schedule_of(bundle.scenario, bundle.testbed.testbed)
        self.names = (PLANT, *schedule.nodes, RECORDER) if members is None else members
        self.folder = self.place / "recording"
        self.parameters = NodeParameters(
            scenario=str(self.place / SCENARIO),
            pace=REALTIME,
            plant=bundle.plant,
            nodes=self.names,
            steps=steps or 1_000_000,
            folder=str(self.folder),
            mode=REALTIME,
            report=str(self.place / "report.json"),
        )
        self._context, self._first = context, first
        self.processes = {}
        for name, content in bundle.attachments().items():
            (self.place / name).write_bytes(content)

    def start(self, *names, remaps=None, **changes):
        """Start nodes, all of the run if none is named, with topics renamed as `remaps` says."""
        from realtime_child import run

        for name in names or self.names:
            path = self.place / f"{name}.yaml"
            write_parameters(path, replace(self.parameters, **changes))
            words = ["--params-file", str(path)]
            for old, new in (remaps or {}).items():
                words += ["-r", f"{old}:={new}"]
            arguments = (name, words, self.domain, str(self.log(name)), self._first)
            process = self._context.Process(target=run, args=arguments, daemon=True)
            process.start()
            self.processes[name] = process

    def log(self, name):
        return self.place / f"{name}.log"

    def send(self, name, number):
        """Send a node a signal."""
        os.kill(self.processes[name].pid, number)

    def end(self, leader=PLANT):
        """End the run in order; return the exit codes of those that had not ended before."""
        left = {n: p for n, p in self.processes.items() if p.is_alive()}
        if leader in left:
            self.send(leader, signal.SIGINT)
        return self.join(left)

    def join(self, left=None):
        """Wait for nodes to end; return their exit codes."""
        codes = {}
        for name, process in (left or self.processes).items():
            process.join(PATIENCE_S)
            codes[name] = process.exitcode
        return codes

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for process in self.processes.values():
            if process.is_alive():
                process.kill()
        for process in self.processes.values():
            process.join(PATIENCE_S)
            process.close()


# What a busy computer does to a run that is in order.
LATE = (" stale: ", "no /winches/torque_command for ", "machine too busy: ")


class Witness:
    """A foreign node on a run's domain: it hears diagnostics and counts messages, and may speak."""

    def __init__(self, domain, topics=()):
        self._stack = ExitStack()
        self.session = self._stack.enter_context(Session(domain_id=domain))
        self.node = self.session.node("witness")
        self.latest, self.stamps_ns, self._clients = {}, {}, {}
        self.counts = defaultdict(int)
        self.node.subscribe(DIAGNOSTICS, self._note)
        for topic in topics:
            self.node.subscribe(topic, lambda _, name=topic.name: self._count(name))
        self._stop = self.node.node.create_publisher(
            ros_class(EMERGENCY_STOP.ros_type), EMERGENCY_STOP.name, contract_qos()
        )

    def _note(self, payload):
        diagnostics = decode_diagnostics(payload)
        for status in diagnostics.statuses:
            self.latest[status.name] = status
            self.stamps_ns[status.name] = diagnostics.stamp_ns

    def _count(self, name):
        self.counts[name] += 1

    def until(self, condition, what, seconds=PATIENCE_S):
        """Listen until a condition holds."""
        if not self.session.spin_until(condition, seconds):
            reported = {name: (s.message, dict(s.values)) for name, s in self.latest.items()}
            raise AssertionError(f"waited {seconds:g} s for {what}; diagnostics: {reported}")

    def until_said(self, name, condition, what, seconds=PATIENCE_S):
        """Listen until what a part says of itself from now on meets a condition; return it."""
        self.latest.pop(name, None)
        self.until(
            lambda: name in self.latest and condition(self.latest[name]), f"{name}: {what}", seconds
        )
        return self.latest[name]

    def until_said_after(self, name, time_ns, condition, what):
        """Listen until what a part says after a time [ns] meets a condition; return it."""
        return self.until_said(
            name, lambda said: self.stamps_ns[name] > time_ns and condition(said), what
        )

    def until_state(self, name, state):
        """Listen until a guard says that it is in a state; return what it says."""
        return self.until_said(name, lambda s: s.values.get("state") == state, state)

    def until_running(self, *guards, passing=LATE):
        """Listen until the run is under way and all is well.

        A busy computer may keep a node waiting for half a second at the start, and what a fault
        leaves behind may be reported after a reset. The safe state is then left as a user would
        leave it.
        """

        def settled(said):
            return passed(said) or (said.level < 2 and said.values.get("state") == "running")

        def passed(said):
            return any(each in said.values.get("reason", "") for each in passing)

        for name in guards:
            while passed(self.until_said(name, settled, "running")):
                self.until_reset(name.partition("/")[0])

    def until_more(self, topic, count):
        """Listen until so many more messages of a topic came."""
        wanted = self.counts[topic] + count
        self.until(lambda: self.counts[topic] >= wanted, f"{count} more of {topic}")

    def emergency_stop(self, pressed):
        """Press or release the emergency stop."""
        self.until(lambda: self._stop.get_subscription_count() > 0, "a reader of the stop")
        self._stop.publish(ros_class(EMERGENCY_STOP.ros_type)(data=pressed))

    def repeat_stop(self, seconds):
        """Say at an interval that the emergency stop is released; return the timer."""
        released = ros_class(EMERGENCY_STOP.ros_type)(data=False)
        return self.node.every(seconds, lambda: self._stop.publish(released))

    def reset(self, node):
        """Call a node's service `reset`; return success and message."""
        kind = ros_class("std_srvs/srv/Trigger")
        if node not in self._clients:
            self._clients[node] = self.node.node.create_client(kind, f"/{node}/reset")
        client = self._clients[node]
        self.until(client.service_is_ready, f"/{node}/reset")
        for _ in range(10):
            answer = client.call_async(kind.Request())
            # Who answers may not know yet who asked; then the answer is lost.
            if self.session.spin_until(answer.done, 0.1 * PATIENCE_S):
                return answer.result().success, answer.result().message
            client.remove_pending_request(answer)
        raise AssertionError(f"no answer of /{node}/reset")

    def until_reset(self, node):
        """Call a node's service `reset` until it is not refused any more."""
        deadline = time.monotonic() + PATIENCE_S
        while not (answer := self.reset(node))[0]:
            assert time.monotonic() < deadline, answer
            self.until_said(FORCE_CONTROLLER, lambda _: True, "a status")
        assert answer == (True, "running")

    def publisher(self, topic, readers=()):
        """Return what publishes the CDR bytes of a topic; see `until_connected` for readers."""
        return self.node.raw_publisher(topic, readers)

    def until_connected(self):
        """Listen until the nodes that were named as readers hear our publishers."""
        self.until(lambda: not self.node.unmatched(), "readers to be connected")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._stack.close()


class Evidence:
    """What a recording shows of a run, times in s since its first message."""

    def __init__(self, folder):
        with Recording(folder) as recording:
            types = {name: topic.ros_type for name, topic in recording.topics.items()}
            names = [name for name, ros_type in types.items() if carries_row(ros_type)]
            self.rows = recording.rows_of(names)
            reported = recording.payloads(DIAGNOSTICS.name)
            self.statuses = [
                status
                for payload in reported.payloads
                for status in decode_diagnostics(payload).statuses
            ]
            brakes = recording.payloads(BRAKE.name).payloads
            self.brakes = [payload[4] != 0 for payload in brakes]
            stops = recording.payloads(EMERGENCY_STOP.name).payloads
            self.stops = [payload[4] != 0 for payload in stops]

    def alarms(self, name):
        """Return when a guard entered its safe state [ns] and why, in order, each once."""
        found = []
        for status in self.statuses:
            if status.name != name or not status.values.get("reason"):
                continue
            since = status.message.partition(" since ")[2].partition(" s:")[0]
            event = (round(float(since) * 1e3) * 1_000_000, status.values["reason"])
            if event not in found:
                found.append(event)
        return found

    def stamps(self, topic):
        return self.rows[topic].stamp_ns

    def last_before(self, topic, at_ns):
        """Return the last stamp of a topic among the messages that had come by a time [ns]."""
        rows = self.rows[topic]
        return int(rows.stamp_ns[rows.log_ns <= at_ns].max())

    def longest_gap(self, topic, start_ns, end_ns):
        """Return the longest time without a message between two that overlaps a span [ns].

        A pause that begins before the span or ends after it counts whole.
        """
        logs = np.sort(self.rows[topic].log_ns)
        first = max(np.searchsorted(logs, start_ns, side="right") - 1, 0)
        last = np.searchsorted(logs, end_ns, side="left") + 1
        return int(np.diff(logs[first:last]).max(initial=0))

    def torques(self, start_ns=0, end_ns=2**62):
        """Return stamps [ns] and rows of the torque commands stamped within a span of time."""
        rows = self.rows[TORQUE_COMMAND]
        chosen = (rows.stamp_ns >= start_ns) & (rows.stamp_ns <= end_ns)
        return rows.stamp_ns[chosen], rows.rows[chosen]


def check_plant(plant):
    if plant == "mujoco":
        pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")


class Command:
    """`cspm run … --mode realtime` as a process, on a domain of its own."""

    def __init__(self, place, bundle, *arguments):
        self.domain = new_domain()
        self.folder = place / "bag"
        for name, content in bundle.attachments().items():
            (place / name).write_bytes(content)
        command = [*CSPM, "run", place / "scenario.yaml", "--mode", "realtime"]
        if "external" not in arguments:
            # What a busy computer may refuse is not these tests' business.
            command.append("--anyway")
        self.process = subprocess.Popen(
            [*map(str, [*command, "--out", self.folder, *arguments])],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | {"ROS_DOMAIN_ID": str(self.domain)},
        )
        go_first(self.process.pid)

    def nodes(self):
        """Return the processes of the run's nodes, by name."""
        return node_processes(self.process.pid)

    def done(self):
        """Wait for the end; return exit code, stdout and stderr."""
        out, err = self.process.communicate(timeout=START_S)
        return self.process.returncode, out, err

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
            self.process.communicate()


def under_way(witness):
    for guard in GUARDS:
        witness.until(lambda guard=guard: guard in witness.latest, guard, START_S)
    witness.until_running(*GUARDS)
    witness.until_more(TENSION, 100)


def topics_of(bundle, *names):
    return [bundle.testbed.testbed.topics[name] for name in names]
