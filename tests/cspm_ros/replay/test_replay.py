"""Replay over real ROS 2: what readers get, and controllers fed with what was recorded."""

import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from types import SimpleNamespace

import pytest
from bag_samples import (
    FLAG,
    SILENT,
    TYPES,
    sample_messages,
    stream,
    write_mcap,
    write_rosbag1,
    write_rosbag2,
)
from error_lines import said
from ros_graph import assert_same, difference, load_ros, new_domain
from run_samples import SCENARIOS, bundle_of

load_ros()

from cspm_msgs_py.bag import open_bag  # noqa: E402
from cspm_msgs_py.errors import CspmError, InputError  # noqa: E402
from cspm_msgs_py.recording import Recording  # noqa: E402
from cspm_msgs_py.ros.contract_node import ros_class  # noqa: E402
from cspm_msgs_py.ros.qos import contract_qos  # noqa: E402
from cspm_msgs_py.ros.session import Session  # noqa: E402
from cspm_msgs_py.ros_types import typestore  # noqa: E402
from cspm_msgs_py.topics import CLOCK, QOS_DEPTH, SCENE  # noqa: E402
from cspm_msgs_py.wire import WireReader  # noqa: E402
from cspm_ros.replay.bag_selection import Selection  # noqa: E402
from cspm_ros.replay.player_node import PlayerNode  # noqa: E402
from cspm_ros.replay.replay_run import replay_through  # noqa: E402
from cspm_ros.runtime import stall_watchdog as watch  # noqa: E402
from cspm_ros.runtime.discovery import Discovery  # noqa: E402
from cspm_ros.runtime.node_main import start_node  # noqa: E402
from cspm_ros.schema_types import schema_class  # noqa: E402
from cspm_run.recorded_run import run  # noqa: E402

CSPM = Path(sys.executable).with_name("cspm")
CONTROLLERS = ("motion_controller", "tension_distribution", "force_controller")
COMMANDS = ("/wrench_command", "/tension_command", "/winches/torque_command")
REFERENCES = ("/winch_frame/reference", "/bar/reference")
SLOW_RATES = ("rates.motion_controller=100", "rates.tension_distribution=500")
STEPS = 250
PATIENCE_S = 120.0


@pytest.fixture
def domain(monkeypatch):
    found = new_domain()
    monkeypatch.setenv("ROS_DOMAIN_ID", str(found))
    return found


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recording") / "calm"
    run(bundle_of("calm"), folder, steps=STEPS)
    return folder


@pytest.fixture
def captured(capfd):
    """rclpy's executor wants a file for stderr."""
    return capfd


class Listener:
    """Keeps the bytes of every message of some topics, by name."""

    def __init__(self, node, types):
        self.heard = {name: [] for name in types}
        for name, ros_type in types.items():
            take, qos = self.heard[name].append, contract_qos(QOS_DEPTH)
            message_class = schema_class.message_class_of(ros_type, typestore())
            node.node.create_subscription(message_class, name, take, qos, raw=True)

    @property
    def count(self):
        return sum(map(len, self.heard.values()))


def played(path, selection=None, own_clock=False):
    """Play a bag to a listener in one process; return what it heard, and the player's node."""
    selection = selection or Selection()
    with open_bag(path) as bag, Session(domain_id=new_domain()) as session:
        node = PlayerNode(session.node("player"), bag, selection, 1.0)
        names = {
            name: new for name, new in selection.names(bag).items() if name not in node.unplayable
        }
        types = {new: bag.topics[name].ros_type for name, new in names.items()}
        found = list(bag.messages(names, node.span_ns[0]))
        due = len(found)
        if own_clock:
            types[CLOCK.name] = CLOCK.ros_type
            due += len({message.log_ns for message in found})
        listener = Listener(session.node("listener"), types)
        assert session.spin_until(lambda: node.controls.player.finished, PATIENCE_S)
        assert node.controls.failure is None
        assert session.spin_until(lambda: listener.count >= due, PATIENCE_S)
        assert session.spin_until(lambda: not node.unacknowledged(), PATIENCE_S)
        return listener.heard, node


def by_topic(messages):
    found = {}
    for _, topic, payload in messages:
        found.setdefault(topic, []).append(payload)
    return found


def heard_only(heard):
    return {name: payloads for name, payloads in heard.items() if payloads}


def clock_times(payloads):
    decode = WireReader(CLOCK).decode
    return [decode(payload)[0] for payload in payloads]


def test_readers_get_a_recording_byte_for_byte_in_order(recording):
    heard, node = played(recording)
    assert heard == by_topic(stream(recording))
    assert node.unplayable == {}
    assert clock_times(heard["/clock"]) == [i * 1_000_000 for i in range(STEPS)]


@pytest.mark.parametrize("kind", ["mcap", "sqlite3", "ROS 1"])
def test_bags_of_others_are_played(tmp_path, kind):
    written = sample_messages(120)
    if kind == "mcap":
        path = write_mcap(tmp_path / "bag.mcap", written)
    elif kind == "sqlite3":
        path = write_rosbag2(tmp_path / "bag", written, "SQLITE3")
    else:
        path = write_rosbag1(tmp_path / "bag.bag", written)
    heard, node = played(path, Selection(remap={"/bar/pose": "/mocap/pose"}))
    expected = by_topic(stream(path))
    expected["/mocap/pose"] = expected.pop("/bar/pose")
    del expected[FLAG]
    assert heard_only(heard) == expected
    assert node.unplayable == {FLAG: "ROS 2 can have no topic of this name, allowed: one renamed"}
    assert SILENT in heard


def test_a_topic_of_an_impossible_name_is_played_renamed(tmp_path):
    path = write_mcap(tmp_path / "bag.mcap", sample_messages(40))
    heard, node = played(path, Selection([FLAG], remap={FLAG: "/flag"}))
    assert node.unplayable == {}
    assert heard["/flag"] == by_topic(stream(path))[FLAG]
    assert set(heard) == {"/flag", "/clock"}


def test_a_bag_without_clock_gets_one_of_its_log_times(tmp_path):
    written = [message for message in sample_messages(80) if message.topic != "/clock"]
    path = write_mcap(tmp_path / "bag.mcap", written)
    with open_bag(path) as bag:
        logs = [message.log_ns for message in bag.messages()]
    start = Selection(["/plain/text"], start_s=0.004)
    heard, _ = played(path, start, own_clock=True)
    messages = [m for m in stream(path, ["/plain/text"]) if m.log_ns >= logs[0] + 4_000_000]
    assert heard["/plain/text"] == [message.payload for message in messages]
    assert clock_times(heard["/clock"]) == sorted({message.log_ns for message in messages})


class FakeNode:
    """A node that keeps the order of what is published, and whose timers tick on request."""

    def __init__(self):
        self.node = self
        self.published, self.timers = [], []

    def create_publisher(self, _, name, __):
        # As a node in the root namespace resolves it.
        def publish(payload):
            self.published.append((f"/{name.removeprefix('/')}", payload))

        return SimpleNamespace(
            handle=SimpleNamespace(publish_raw=publish),
            topic_name=name,
            get_subscription_count=lambda: 0,
            wait_for_all_acked=lambda _: True,
        )

    def create_service(self, *_):
        pass

    def count_subscribers(self, _):
        return 0

    def every(self, _, call):
        timer = SimpleNamespace(call=call, cancel=lambda: self.timers.remove(timer))
        self.timers.append(timer)
        return timer

    def tick(self):
        for timer in list(self.timers):
            timer.call()


def published(path, selection, monkeypatch):
    """Everything that a player publishes, in order."""
    now = [0.0]
    monkeypatch.setattr("cspm_ros.replay.player_node.time.monotonic", lambda: now[0])
    fake = FakeNode()
    with open_bag(path) as bag:
        node = PlayerNode(fake, bag, selection, 1.0)
        while not node.controls.player.finished:
            now[0] += 0.004
            fake.tick()
    return fake.published


def test_messages_are_published_in_the_bags_order(recording, tmp_path, monkeypatch):
    assert published(recording, Selection(), monkeypatch) == [
        (topic, payload) for _, topic, payload in stream(recording)
    ]
    path = write_mcap(tmp_path / "bag.mcap", sample_messages(200, unordered=3))
    shared = Counter(message.log_ns for message in stream(path))
    assert max(shared.values()) > 5
    expected = [(name, payload) for _, name, payload in stream(path) if name != FLAG]
    assert published(path, Selection(), monkeypatch) == expected


def test_the_clock_goes_ahead_of_the_messages_of_its_instant(tmp_path, monkeypatch):
    written = [message for message in sample_messages(60) if message.topic != "/clock"]
    path = write_mcap(tmp_path / "bag.mcap", written)
    found = published(path, Selection(left_out=[FLAG]), monkeypatch)
    now, rest = None, []
    messages = [m for m in stream(path) if m.topic != FLAG]
    for name, payload in found:
        if name == "/clock":
            [now] = clock_times([payload])
        else:
            rest.append((now, name, payload))
    assert rest == messages
    without = published(path, Selection(left_out=[FLAG, "/clock"]), monkeypatch)
    assert without == [(name, payload) for _, name, payload in messages]


def test_types_that_cannot_be_sent_are_reported(recording, monkeypatch):
    """Without generated code Fast DDS sends by the definition; others cannot."""
    monkeypatch.setitem(sys.modules, "trajectory_msgs.msg", None)
    fake = FakeNode()
    ros_type = "trajectory_msgs/msg/MultiDOFJointTrajectory"
    with open_bag(recording) as bag:
        assert PlayerNode(fake, bag, Selection(), 1.0).unplayable == {}
        schema_class.schema_class.cache_clear()
        monkeypatch.setattr(schema_class, "rmw_name", lambda: "rmw_zenoh_cpp")
        node = PlayerNode(fake, bag, Selection(), 1.0)
        missing = (
            f"{ros_type} is not installed, which rmw_zenoh_cpp cannot do without, allowed:"
            " rmw_fastrtps_cpp"
        )
        # Of tf2_msgs no generated code can be installed by pip.
        reported = {
            name: why for name, why in node.unplayable.items() if not name.startswith("/tf")
        }
        assert reported == {"/winch_frame/reference": missing, "/bar/reference": missing}
        selection = Selection(left_out=[name for name in bag.topics if name != "/bar/reference"])
        with pytest.raises(InputError) as caught:
            PlayerNode(fake, bag, selection, 1.0)
    reported = f"{recording}: no topic of it can be played, /bar/reference: {missing}"
    assert str(caught.value) == reported


def test_others_pause_and_step(recording):
    pause_class, step_class = (ros_class(f"std_srvs/srv/{n}") for n in ("SetBool", "Trigger"))
    with open_bag(recording) as bag, Session(domain_id=new_domain()) as session:
        node = PlayerNode(session.node("player"), bag, Selection(), 1.0, paused=True)
        other = session.node("other")
        listener = Listener(other, {"/bar/pose": TYPES["/bar/pose"]})
        pause = other.node.create_client(pause_class, "/player/pause")
        step = other.node.create_client(step_class, "/player/step")
        assert session.spin_until(
            lambda: pause.service_is_ready() and step.service_is_ready(), PATIENCE_S
        )

        def answer(client, request):
            future = client.call_async(request)
            assert session.spin_until(future.done, PATIENCE_S)
            return future.result().success, future.result().message

        assert answer(step, step_class.Request()) == (True, "0.000000000 s")
        # Steps that are asked for before the readers are connected wait until they are.
        assert session.spin_until(lambda: len(listener.heard["/bar/pose"]) == 1, PATIENCE_S)
        assert answer(step, step_class.Request()) == (True, "0.001000000 s")
        assert session.spin_until(lambda: len(listener.heard["/bar/pose"]) == 2, PATIENCE_S)
        assert node.controls.player.paused
        answered = answer(pause, pause_class.Request(data=False))
        assert answered == (True, "playing at 0.001000000 s")
        answered = answer(pause, pause_class.Request(data=True))
        assert answered[1].startswith("paused at 0.")
        assert answer(pause, pause_class.Request(data=False))[0]
        assert session.spin_until(lambda: len(listener.heard["/bar/pose"]) == STEPS, PATIENCE_S)
        assert answer(step, step_class.Request()) == (False, "the bag is played")


@pytest.mark.slow
def test_readers_of_another_quality_of_service_are_reported(recording, capfd, monkeypatch):
    monkeypatch.setattr(Discovery, "LONGEST_S", 1.0)
    from rclpy.qos import DurabilityPolicy, QoSProfile

    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    with open_bag(recording) as bag, Session(domain_id=new_domain()) as session:
        node = PlayerNode(session.node("player"), bag, Selection(duration_s=0.01), 1.0)
        session.node("other").node.create_subscription(
            ros_class(TYPES["/bar/pose"]), "/bar/pose", lambda _: None, latched
        )
        assert session.spin_until(lambda: node.controls.player.finished, PATIENCE_S)
    assert "not all readers of /bar/pose are connected: is their quality" in capfd.readouterr().err


@pytest.mark.parametrize("overrides", [(), SLOW_RATES], ids=["1 kHz", "several rates"])
def test_controllers_reproduce_the_recorded_commands_bit_for_bit(tmp_path, overrides):
    bundle = bundle_of("worst_case", *overrides)
    run(bundle, tmp_path / "first", steps=STEPS)
    found = replay_through(
        tmp_path / "first", CONTROLLERS, folder=tmp_path / "again", domain_id=new_domain()
    )
    with Recording(tmp_path / "first") as first:
        counts = {name: first.topics[name].count for name in COMMANDS}
        total = sum(topic.count for name, topic in first.topics.items() if name not in SCENE)
    assert {name: each.compared for name, each in found.reproductions.items()} == counts
    assert found.identical
    assert all(each.different == 0 for each in found.reproductions.values())
    assert (found.messages, found.interrupted) == (total, False)
    # What the recorder took down is the recording again: measurements, commands, diagnostics.
    assert_same(tmp_path / "first", tmp_path / "again")


@pytest.mark.parametrize(
    ("through", "topics"),
    [
        (["force_controller"], COMMANDS[2:]),
        (["motion_controller"], COMMANDS[:1]),
        (
            ["wave_trajectory", "tension_distribution"],
            ("/winch_frame/reference", "/bar/reference", COMMANDS[1]),
        ),
    ],
)
def test_a_controller_reproduces_while_others_are_played(recording, tmp_path, through, topics):
    found = replay_through(recording, through, folder=tmp_path / "again", domain_id=new_domain())
    assert sorted(found.reproductions) == sorted(topics)
    assert {each.compared for each in found.reproductions.values()} == {STEPS}
    assert found.identical
    assert_same(recording, tmp_path / "again")


def test_late_sensors_are_reproduced(tmp_path):
    testbed = (SCENARIOS / "testbeds" / "thesis_refitted.yaml").read_text(encoding="utf-8")
    late = testbed.replace("delay: {value: 0.0,", "delay: {value: 0.003,")
    assert late != testbed
    (tmp_path / "late.yaml").write_text(late, encoding="utf-8")
    scenario = (SCENARIOS / "calm.yaml").read_text(encoding="utf-8")
    scenario = scenario.replace("testbeds/thesis_refitted.yaml", "late.yaml")
    (tmp_path / "scenario.yaml").write_text(scenario, encoding="utf-8")
    run(bundle_of(tmp_path / "scenario.yaml"), tmp_path / "bag", steps=50)
    found = replay_through(
        tmp_path / "bag", CONTROLLERS, folder=tmp_path / "again", domain_id=new_domain()
    )
    assert [each.compared for each in found.reproductions.values()] == [47, 47, 47]
    assert found.identical
    assert_same(tmp_path / "bag", tmp_path / "again")


def test_a_prescribed_torque_is_reproduced(tmp_path):
    run(bundle_of("one_winch"), tmp_path / "bag", steps=100)
    found = replay_through(tmp_path / "bag", ["force_controller"], domain_id=new_domain())
    assert [each.compared for each in found.reproductions.values()] == [100]
    assert found.identical


@pytest.mark.slow
def test_a_pause_is_no_lack_of_patience(recording):
    looks = []

    def look(player):
        """Pause for 1 s once the replay is under way."""
        if player.position_ns > 0.02e9 and len(looks) < 20:
            player.pause(time.monotonic())
            looks.append(player.paused)
            if len(looks) == 20:
                player.resume(time.monotonic())

    found = replay_through(
        *(recording, ["force_controller"], 1.0, look),
        duration_s=0.25,
        domain_id=new_domain(),
        patience_s=0.4,
    )
    assert [each.compared for each in found.reproductions.values()] == [250]
    assert looks == [True] * 20


def test_the_command_compares_and_reports_the_first_difference(cspm, domain, recording, tmp_path):
    gain = "control.force.gains.hoist_1.kp=0.5"
    code, out, err = cspm(
        *("replay", recording, "--through", "motion_controller,force_controller"),
        *("--set", gain, "--json", "reported.json", "--duration", "0.1"),
    )
    assert (code, err) == (1, "")
    wrench, torque, last = out.splitlines()
    assert wrench == "/wrench_command: 100 messages, identical bit for bit"
    start = "/winches/torque_command: 9. of 100 messages differ, by at most .* (effort/hoist_1)"
    assert re.match(start.replace("(", r"\(").replace(")", r"\)"), torque)
    assert last.startswith("played 0.099 s, ")
    reported = json.loads((tmp_path / "reported.json").read_text())
    assert (reported["identical"], reported["interrupted"]) == (False, False)
    assert reported["reproduced"]["/wrench_command"]["first_difference"] is None
    first = reported["reproduced"]["/winches/torque_command"]["first_difference"]
    assert first["field"] == "effort/hoist_1"
    assert first["first"] != first["second"]


def test_the_command_plays_all_nodes(cspm, domain, recording, tmp_path):
    code, out, err = cspm("replay", recording, "--through", "all", "--out", "again", "--rate", "2")
    assert (code, err) == (0, "")
    assert out.count("identical bit for bit") == 5
    assert_same(recording, tmp_path / "again")


def test_the_command_plays_to_nobody(cspm, domain, recording, tmp_path):
    arguments = ("--topics", "/bar/pose", "--start", "0.1", "--duration", "0.05")
    code, out, err = cspm("replay", recording, *arguments, "--json", "reported.json")
    assert (code, out, err) == (0, "played 0.049 s, 100 messages\n", "")
    reported = json.loads((tmp_path / "reported.json").read_text())
    assert reported == {
        "bag": str(recording),
        "messages": 100,
        "played_s": 0.049,
        "interrupted": False,
        "unplayable": {},
    }


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--rate", "0"], "rate 0: allowed with nodes in step, which report how far they are"),
        (["--rate", "-1"], "rate -1: allowed: 0.001 to 1000, or 0 with nodes in step"),
        (["--remap", "/bar/pose"], "--remap /bar/pose: allowed: OLD=NEW, such as "),
        (["--out", "x"], "out without through: allowed: with it"),
        (["--set", "seed=2"], "changed values without through: allowed: with it"),
        (
            ["--through", "all", "--start", "1"],
            "through with chosen or renamed topics or a ",
        ),
        (["--through", "plant"], "through plant: allowed: wave_trajectory, motion_controller, "),
        (["--through", ""], "through no node: allowed: wave_trajectory, motion_controller, "),
        (["--through", "all", "--set", "nonsense"], "--set nonsense: allowed: key.path=value"),
        (["--start", "9"], "start 9 s: allowed: 0 to 0.249 s, "),
        (["--topics", "/nope"], ": no topic /nope, it has: /clock, "),
        (["--except", "/nope"], ": no topic /nope, it has: /clock, "),
    ],
)
def test_unusable_input_is_one_line(cspm, domain, recording, arguments, line):
    code, _, err = cspm("replay", recording, *arguments)
    assert (code, err.count("\n")) == (2, 1)
    assert line in err


def test_bags_that_say_nothing_of_the_run_are_not_for_nodes(cspm, domain, tmp_path):
    write_mcap(tmp_path / "bag.mcap", sample_messages(40))
    code, _, err = cspm("replay", "bag.mcap", "--through", "all")
    assert (code, said(err)) == (
        2,
        "bag.mcap: carries no scenario.yaml and no testbed.yaml, allowed: a recording made"
        " by cspm\n",
    )
    assert cspm("replay", "nowhere")[0] == 2


def test_a_damaged_bag_ends_in_one_line(cspm, domain, recording, tmp_path):
    with Recording(recording) as found:
        [file] = found.files
        middle = file.chunks[len(file.chunks) // 2].record
    content = bytearray(file.path.read_bytes())
    begin = middle.offset + 200
    content[begin : begin + 200] = bytes(200)
    (tmp_path / "damaged.mcap").write_bytes(content)
    for through in ([], ["--through", "force_controller"]):
        code, _, err = cspm("replay", "damaged.mcap", *through)
        assert (code, err.count("\n")) == (2, 1)
        assert said(err).startswith("damaged.mcap: ")


def test_help_teaches(cspm):
    code, out, _ = cspm("replay", "--help")
    text = " ".join(out.replace("│", " ").split())
    assert code == 0
    for part in ("--json", "ROS 1 .bag", "Keys in a terminal", "/player/pause", "bit for bit"):
        assert part in text


def node_arguments(**parameters):
    given = []
    for name, value in parameters.items():
        given += ["-p", f"{name}:={json.dumps(value) if not isinstance(value, Path) else value}"]
    return ["--ros-args", *given]


def test_the_node_plays_a_bag(domain, recording):
    start_node("player", node_arguments(bag=recording, topics=["/bar/pose"], start=0.2))


def test_the_node_refuses_what_it_cannot_use(domain, recording):
    with pytest.raises(InputError, match="parameter bag: empty, allowed: a bag's folder or file"):
        start_node("player", ["--ros-args"])
    with pytest.raises(InputError, match=r"nodes: plant, allowed: player, wave_trajectory, "):
        start_node("force_controller", node_arguments(bag=recording, nodes=["player", "plant"]))
    with pytest.raises(InputError, match=r"through no node: allowed: wave_trajectory, "):
        start_node("player", node_arguments(bag=recording, lockstep=True, nodes=["recorder"]))


def test_the_node_does_not_wait_for_ever(domain, recording, monkeypatch):
    monkeypatch.setattr(watch, "START_FACTOR", 1.0)
    given = node_arguments(bag=recording, lockstep=True, nodes=[CONTROLLERS[2]], patience=0.5)
    late = r"not all nodes joined within \S+ s: player waits for force_controller; allowed: "
    with pytest.raises(CspmError, match=late):
        start_node("player", given)


def child(*arguments, **options):
    return subprocess.Popen([CSPM, *map(str, arguments)], **options)


def ended(process):
    try:
        return process.wait(PATIENCE_S)
    finally:
        process.kill()


@pytest.mark.slow
def test_nodes_of_other_processes_are_fed_and_compared(domain, recording, tmp_path):
    nodes = ["player", "tension_distribution", "force_controller", "recorder"]
    common = {"bag": recording, "nodes": nodes, "folder": tmp_path / "again", "mode": "replay"}
    player = child("node", "player", *node_arguments(**common, lockstep=True, rate=0.0))
    others = [child("node", name, *node_arguments(**common)) for name in nodes[1:]]
    assert [ended(process) for process in (player, *others)] == [0, 0, 0, 0]
    assert difference(recording, tmp_path / "again") is None


@pytest.mark.slow
def test_a_different_node_of_another_process_is_found(domain, recording):
    common = {"bag": recording, "nodes": ["player", "force_controller"]}
    player = child(
        *("node", "player", *node_arguments(**common, lockstep=True, rate=0.0)),
        stderr=subprocess.PIPE,
        text=True,
    )
    gain = ["control.force.gains.hoist_1.kp=0.5"]
    other = child("node", "force_controller", *node_arguments(**common, overrides=gain))
    _, err = player.communicate(timeout=PATIENCE_S)
    assert (player.returncode, ended(other)) == (1, 0)
    assert f"of {STEPS} messages differ, by at most " in err


class Terminal:
    """A command in a terminal of its own."""

    def __init__(self, *arguments):
        self.process, self.file = pty.fork()
        if not self.process:
            os.execv(CSPM, [CSPM, *map(str, arguments)])
        self.text = ""

    def wait_for(self, pattern):
        deadline = time.monotonic() + PATIENCE_S
        while not re.search(pattern, self.text):
            assert time.monotonic() < deadline, self.text
            if select.select([self.file], [], [], 0.1)[0]:
                self.text += os.read(self.file, 65536).decode(errors="replace")

    def press(self, keys):
        self.text = ""
        os.write(self.file, keys)

    def end(self):
        """Return the exit code."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            if select.select([self.file], [], [], 0.1)[0]:
                try:
                    self.text += os.read(self.file, 65536).decode(errors="replace")
                except OSError:
                    break
        return os.waitstatus_to_exitcode(os.waitpid(self.process, 0)[1])


def test_keys_in_a_terminal_steer(domain, recording):
    terminal = Terminal("replay", recording, "--paused", "--topics", "/bar/pose")
    terminal.wait_for("space: pause")
    terminal.wait_for(r"0\.000 of 0\.249 s, paused")
    terminal.press(b"s")
    terminal.press(b"s\x1b[C")
    terminal.wait_for(r"0\.002 of 0\.249 s, paused")
    terminal.press(b"----- ")
    terminal.wait_for(r"s, × 0\.02")
    terminal.press(b" ")
    terminal.wait_for("s, paused")
    terminal.press(b"q")
    assert terminal.end() == 0
    assert re.search(r"played 0\.\d{3} s, \d+ messages", terminal.text)


@pytest.mark.parametrize(
    ("number", "through"),
    [
        (signal.SIGINT, []),
        pytest.param(signal.SIGTERM, ["--through", "force_controller"], marks=pytest.mark.slow),
    ],
    ids=["free", "in step"],
)
def test_a_signal_ends_a_replay(domain, recording, tmp_path, number, through):
    # Paused, so that nothing but the signal can end it.
    given = ["replay", recording, "--paused", *through, "--json", tmp_path / "reported.json"]
    terminal = Terminal(*given)
    terminal.wait_for("s, paused")
    os.kill(terminal.process, number)
    assert terminal.end() == 1
    assert "interrupted after 0.000 s" in terminal.text
    assert json.loads((tmp_path / "reported.json").read_text())["interrupted"] is True
