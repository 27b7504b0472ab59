"""The driver that people copy: short, on ROS alone, for the thesis's machine, and it works."""

import ast
import importlib.util
import json
import os
import signal
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from first_in_line import go_first
from realtime_graph import Evidence, Witness
from ros_graph import load_ros, new_domain
from run_samples import bundle_of

from cspm_control.safety import check_real_time
from cspm_msgs_py.message import message_of
from cspm_msgs_py.recording import overview
from cspm_msgs_py.ros_types import serialize
from cspm_msgs_py.schedule import (
    BAR_POSE,
    FORCE_CONTROLLER,
    FRAME_POSE,
    TENSION,
    TORQUE_COMMAND,
    WINCH_STATE,
    schedule_of,
)
from cspm_msgs_py.wire import WireReader

load_ros()

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
DRIVER, SCENARIO = EXAMPLES / "driver.py", EXAMPLES / "clamped_bar.yaml"
CSPM = [sys.executable, "-c", "from cspm.cli.main import main; main()"]
MEASURED = (FRAME_POSE, BAR_POSE, WINCH_STATE, TENSION)
MS = 1_000_000
START_S = 300.0
# Patient with a busy computer.
WAIT = 0.3
PATIENT = ("stale_after", "lateness")


@pytest.fixture(scope="module")
def bundle():
    return bundle_of(SCENARIO, *(f"safety.{key}={WAIT}" for key in PATIENT))


@pytest.fixture(scope="module")
def module():
    """The example's names, without running it."""
    spec = importlib.util.spec_from_file_location("driver_example", DRIVER)
    found = importlib.util.module_from_spec(spec)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        spec.loader.exec_module(found)
    return found


def test_it_has_at_most_120_lines_and_needs_ros_alone():
    text = DRIVER.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 120
    roots = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            roots |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            roots.add(node.module.partition(".")[0])
    ros = {"rclpy", "geometry_msgs", "sensor_msgs", "std_msgs"}
    assert roots - set(sys.stdlib_module_names) == ros


def test_its_machine_is_the_thesiss(module, bundle):
    cables = bundle.testbed.testbed.cables
    assert tuple(module.CABLES) == bundle.testbed.testbed.cable_names
    assert [cable.drum_radius / cable.gear_ratio for cable in cables] == pytest.approx(module.RADII)
    assert [cable.torque_limit for cable in cables] == module.LIMITS
    assert module.POSES[BAR_POSE].position.z == bundle.scenario.bar_mean_pose[2]


def test_its_scenario_can_be_run_in_real_time():
    bundle = bundle_of(SCENARIO)
    schedule = schedule_of(bundle.scenario, bundle.testbed.testbed)
    check_real_time(bundle.scenario.safety, schedule)
    assert {timing.divider for timing in schedule.topics.values()} == {1}


@pytest.fixture(scope="module")
def domain():
    """Return a ROS domain for all drivers that end in order."""
    return new_domain()


class Process:
    """The driver's process."""

    def __init__(self, domain, **parameters):
        self.domain = domain
        words = [word for pair in parameters.items() for word in ("-p", "{}:={}".format(*pair))]
        self.process = subprocess.Popen(
            [sys.executable, DRIVER, "--ros-args", *words],
            # rclpy warns of its own handlers where a signal comes between two of its steps.
            env=os.environ
            | {"ROS_DOMAIN_ID": str(self.domain), "PYTHONWARNINGS": "ignore::RuntimeWarning"},
            stderr=subprocess.PIPE,
            text=True,
        )
        go_first(self.process.pid)

    def end(self, number):
        """End it by a signal; return exit code and what it said."""
        self.process.send_signal(number)
        _, err = self.process.communicate(timeout=START_S)
        return self.process.returncode, err

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate()


class Listener(Witness):
    """A witness that reads the driver's messages and commands its torques."""

    def __init__(self, bundle, domain):
        topics = bundle.testbed.testbed.topics
        super().__init__(domain, [topics[name] for name in MEASURED])
        self.rows = {name: [] for name in MEASURED}
        for name in MEASURED:
            keep = self.rows[name]
            self.node.subscribe_rows(
                topics[name], lambda stamp, row, keep=keep: keep.append((stamp, row)), pytest.fail
            )
        self.topic = topics[TORQUE_COMMAND]
        self.send = self.publisher(self.topic)

    def command(self, torques, **changes):
        """Command torques, in a message with some of its fields replaced."""
        made = message_of(self.topic, self.node.now_ns(), torques)
        for name, value in changes.items():
            setattr(made, name, value)
        self.send(serialize(made))

    def follow(self, torques, count):
        """Command the same torques again and again until so many tensions came."""
        wanted = self.counts[TENSION] + count

        def done():
            self.command(torques)
            return self.counts[TENSION] >= wanted

        self.until(done, f"{count} tensions")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_ends_without_a_word(domain, bundle, number):
    with Process(domain) as driver, Listener(bundle, driver.domain) as listener:
        listener.until_more(TENSION, 10)
        assert driver.end(number) == (0, "")


def test_it_measures_follows_and_brakes_by_itself(domain, bundle):
    held = np.array([5.0 * c.drum_radius / c.gear_ratio for c in bundle.testbed.testbed.cables])
    with (
        Process(domain, watchdog=WAIT) as driver,
        Listener(bundle, driver.domain) as listener,
    ):
        # It waits for a first command for as long as it takes.
        listener.until_more(TENSION, 150)
        listener.until_more(WINCH_STATE, 10)
        for name in MEASURED:
            stamps = [stamp for stamp, _ in listener.rows[name]]
            assert (np.diff(stamps) > 0).all()
            assert abs(stamps[-1] - listener.node.now_ns()) < 10_000 * MS
        assert listener.rows[BAR_POSE][-1][1].tolist() == [0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0]
        np.testing.assert_allclose(listener.rows[TENSION][-1][1], 5.0)
        listener.follow(2.0 * held, 100)
        np.testing.assert_allclose(listener.rows[TENSION][-1][1], 10.0, rtol=1e-3)
        np.testing.assert_array_equal(listener.rows[WINCH_STATE][-1][1][16:], 2.0 * held)
        # No more commands: it brakes, and its winches fall silent.
        listener.until_more(TENSION, round(2 * WAIT * 200))
        silent = listener.counts[WINCH_STATE]
        listener.follow(held, 50)
        assert listener.counts[WINCH_STATE] == silent
        np.testing.assert_allclose(listener.rows[TENSION][-1][1], 10.0, rtol=1e-3)


@pytest.mark.parametrize(
    "changes",
    [
        {"effort": np.full(8, np.nan)},
        pytest.param({"effort": np.full(8, 3.0)}, marks=pytest.mark.slow),
        pytest.param({"effort": np.zeros(7)}, marks=pytest.mark.slow),
        pytest.param({"effort": np.zeros(0)}, marks=pytest.mark.slow),
        pytest.param({"name": [f"c{i}" for i in range(8)]}, marks=pytest.mark.slow),
    ],
    ids=["nan", "beyond", "short", "empty", "names"],
)
def test_it_brakes_on_commands_that_cannot_be_used(domain, bundle, changes):
    with Process(domain, watchdog=10.0) as driver, Listener(bundle, driver.domain) as listener:
        listener.until_more(WINCH_STATE, 10)
        listener.follow(np.zeros(8), 10)
        listener.until_more(WINCH_STATE, 10)
        listener.command(np.zeros(8), **changes)
        listener.until_more(TENSION, 50)
        silent = listener.counts[WINCH_STATE]
        listener.follow(np.zeros(8), 50)
        assert listener.counts[WINCH_STATE] == silent


def test_it_brakes_on_a_command_that_answers_an_old_state(domain, bundle):
    with Process(domain, watchdog=10.0) as driver, Listener(bundle, driver.domain) as listener:
        listener.until_more(WINCH_STATE, 10)
        listener.follow(np.zeros(8), 10)
        made = message_of(listener.topic, listener.node.now_ns() - 9_000 * MS, np.zeros(8))
        listener.send(serialize(made))
        listener.until_more(WINCH_STATE, 10)
        made = message_of(listener.topic, listener.node.now_ns() - 10_001 * MS, np.zeros(8))
        listener.send(serialize(made))
        listener.until_more(TENSION, 50)
        silent = listener.counts[WINCH_STATE]
        listener.follow(np.zeros(8), 50)
        assert listener.counts[WINCH_STATE] == silent


class External:
    """`cspm run … --plant external`, and what it prints line by line."""

    def __init__(self, folder, *arguments):
        self.domain, self.folder = new_domain(), folder
        command = [*CSPM, "run", SCENARIO, "--mode", "realtime", "--plant", "external"]
        self.process = subprocess.Popen(
            [*map(str, [*command, "--out", folder, *arguments])],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | {"ROS_DOMAIN_ID": str(self.domain)},
        )
        go_first(self.process.pid)
        self.said = []

    def until(self, text):
        """Read until a line says it."""
        for line in self.process.stdout:
            self.said.append(line.rstrip("\n"))
            if text == self.said[-1]:
                return
        pytest.fail(f"{text!r} was not said but {self.said}; {self.process.stderr.read()}")

    def done(self):
        out, err = self.process.communicate(timeout=START_S)
        self.said += out.splitlines()
        return self.process.returncode, err

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.terminate()
        self.process.communicate()


@pytest.mark.slow
def test_a_run_waits_for_it_says_so_starts_and_records(bundle, tmp_path):
    waits = [word for key in PATIENT for word in ("--set", f"safety.{key}={WAIT}")]
    patient = (*waits, "--duration", "3")
    with External(tmp_path / "bag", *patient) as run:
        run.until(f"waits for {', '.join(MEASURED)}")
        with Process(run.domain, watchdog=WAIT) as driver:
            run.until("all is there")
            assert run.done() == (0, "")
            with Listener(bundle, run.domain) as listener:
                # The end of a run is a silence: the drives brake.
                listener.until_more(TENSION, round(2 * WAIT * 200))
                assert listener.counts[WINCH_STATE] < listener.counts[TENSION]
            assert driver.end(signal.SIGINT) == (0, "")
    assert overview(run.folder).complete
    summary = json.loads((run.folder / "summary.json").read_text())
    assert summary["mode"] == "realtime"
    assert summary["realtime"]["recorder"] == {"lost": 0, "refused": 0}
    assert max(error["max"] for error in summary["errors"].values()) == 0.0
    evidence = Evidence(run.folder)
    assert not any(name.startswith("/truth/") for name in evidence.rows)
    assert "/clock" not in evidence.rows
    start = evidence.stamps("/bar/reference")[0]
    # The driver was there before the run, and drove during all of it.
    assert evidence.stamps(TENSION)[0] < start
    states, torques = evidence.rows[WINCH_STATE], evidence.rows[TORQUE_COMMAND]
    assert states.stamp_ns[-1] - start > 2500 * MS
    applied = np.split(states.rows, 3, axis=1)[2]
    commands = {tuple(row) for row in torques.rows}
    followed = [tuple(row) in commands for row in applied[states.stamp_ns > start + 1000 * MS]]
    assert np.mean(followed) > 0.95
    assert not evidence.alarms(FORCE_CONTROLLER)


@pytest.mark.slow
def test_the_check_of_drivers_finds_no_error_in_it(domain, tmp_path):
    with Process(domain) as driver:
        done = subprocess.run(
            [*CSPM, "check-drivers", "--scenario", SCENARIO, "--json", tmp_path / "found.json"],
            capture_output=True,
            text=True,
            check=False,
            timeout=START_S,
            env=os.environ | {"ROS_DOMAIN_ID": str(driver.domain)},
        )
    found = json.loads((tmp_path / "found.json").read_text())
    wrong = [
        each["text"]
        for topic in found["topics"].values()
        for each in topic["findings"]
        # How soon Python gets its turn is not the driver's business.
        if each["ok"] is False and each["check"] not in ("rate", "late", "gaps")
    ]
    assert (wrong, done.stderr) == ([], ""), done.stdout
    assert found["topics"][TORQUE_COMMAND]["verdict"] == "ok"


def test_its_messages_are_read_as_they_are(domain, bundle):
    """Without the listener's own reader, in case it forgives too much."""
    topics = bundle.testbed.testbed.topics
    with Process(domain) as driver, Witness(driver.domain) as witness:
        payloads = {name: [] for name in MEASURED}
        for name in MEASURED:
            witness.node.subscribe(topics[name], payloads[name].append)
        witness.until(lambda: all(len(found) > 5 for found in payloads.values()), "all topics")
    for name, found in payloads.items():
        decode = WireReader(topics[name]).decode
        for payload in found:
            _, row = decode(payload)
            assert len(row) == topics[name].width
