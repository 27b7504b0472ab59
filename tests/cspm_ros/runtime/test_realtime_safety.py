"""What happens to the winches when a part of a run in real time dies, stops, or talks nonsense.

Reaction times are read from the recordings: from the stamp of the last good input to the first safe
torque. What the computer's scheduling adds is read from the same recording, as the longest time
between two messages of the node that has to react.
"""

import re
import signal

import numpy as np
import pytest
from realtime_graph import (
    STALE_AFTER,
    Evidence,
    Graph,
    Witness,
    slow_bundle,
    warm_processes,
)
from ros_graph import load_ros
from rosbags.highlevel import AnyReader

from cspm_control.safe_state import balancing_tensions
from cspm_msgs_py.graph import RECORDER
from cspm_msgs_py.message import message_of
from cspm_msgs_py.recording import Recording
from cspm_msgs_py.recording.recover import recover
from cspm_msgs_py.ros.contract_node import ros_class
from cspm_msgs_py.ros_types import serialize, typestore
from cspm_msgs_py.schedule import (
    BAR_POSE,
    FORCE_CONTROLLER,
    MOTION_CONTROLLER,
    PLANT,
    TENSION,
    TENSION_COMMAND,
    TENSION_DISTRIBUTION,
    TORQUE_COMMAND,
    WAVE_TRAJECTORY,
    WINCH_STATE,
)
from cspm_msgs_py.topics import BRAKE
from cspm_ros.runtime.exit_watchdog import IN_ORDER

load_ros()

from rclpy.parameter import Parameter  # noqa: E402

pytestmark = [pytest.mark.slow, pytest.mark.realtime]

MS = 1_000_000
PERIOD = 5 * MS
WATCHDOG = "plant/watchdog"
GUARDS = (FORCE_CONTROLLER, WATCHDOG)
REFERENCE, TRUTH = "/bar/reference", "/truth/bar/pose"
# Longest silence of the emergency stop [s].
HEARTBEAT = 2.0
# How far the bar may move [m] until somebody holds it; a falling one sinks 0.44 m in STALE_AFTER.
SAG = 0.02
# Who falls silent, and what is missing in the end.
MISSED = {
    WAVE_TRAJECTORY: TENSION_COMMAND,
    MOTION_CONTROLLER: TENSION_COMMAND,
    TENSION_DISTRIBUTION: TENSION_COMMAND,
}


@pytest.fixture(scope="module")
def warm():
    return warm_processes()


@pytest.fixture
def note(request):
    """Return what shows a measured time among the test's progress."""
    plugins = request.config.pluginmanager

    def show(text):
        with plugins.getplugin("capturemanager").global_and_fixture_disabled():
            plugins.getplugin("terminalreporter").write_line(f"\n{text}")

    return show


def topics_of(bundle, *names):
    return [bundle.testbed.testbed.topics[name] for name in names]


def under_way(witness):
    """Listen until all is well, and for 0.3 s more of it."""
    witness.until_running(*GUARDS)
    witness.until_more(TENSION, 60)


def balance_torque(bundle):
    cables = bundle.testbed.testbed.cables
    radii = np.array([cable.drum_radius / cable.gear_ratio for cable in cables])
    return radii * balancing_tensions(bundle.scenario, bundle.testbed.testbed)


def reaction(evidence, guard, topic, reacts, wait=STALE_AFTER, event=0):
    """Hold the time from the last good message to the safe state to what it may be; return it [s].

    `reacts` is a topic that the guard's node sends in every period. A busy computer may stop the
    node meanwhile, which it then says instead; it reacts as soon all the same.
    """
    since, reason = evidence.alarms(guard)[event]
    stopped = reason.startswith("stood still for ")
    assert stopped or reason.startswith((f"{topic} stale: ", f"no {topic} for ")), reason
    good = evidence.last_before(topic, since)
    # What it reports is rounded to 1 ms.
    allowed = round(wait * 1e9) + 2 * PERIOD + MS
    allowed += evidence.longest_gap(reacts, good, since + 10 * PERIOD)
    took = since - good
    assert took <= allowed
    assert stopped or took > round(wait * 1e9) - MS
    return took * 1e-9


def check_torques(evidence, bundle, since, state, blind):
    """Hold the torques after the event to the safe state; return the first one's stamp [ns]."""
    stamps, torques = evidence.torques(since + MS)
    assert len(stamps) > 50
    assert (np.diff(stamps) > 0).all()
    if state == "brake":
        assert not torques.any()
        assert evidence.brakes[-1]
    else:
        # As hung as before: balancing torque, give or take what the spring adds.
        np.testing.assert_allclose(torques[-1], balance_torque(bundle), rtol=0.2)
        # Nobody can hold by the motors who does not know how they turn.
        assert evidence.brakes[-1] == blind
    return int(stamps[0])


def heave(evidence):
    return evidence.rows["/truth/bar/pose"].rows[:, 2]


@pytest.mark.parametrize(
    ("name", "state"),
    [
        (WAVE_TRAJECTORY, "hold"),
        (MOTION_CONTROLLER, "hold"),
        (TENSION_DISTRIBUTION, "hold"),
        (TENSION_DISTRIBUTION, "brake"),
        (PLANT, "hold"),
    ],
)
def test_a_killed_node_brings_the_force_controllers_to_their_safe_state(
    warm, tmp_path, name, state, note
):
    bundle = slow_bundle(f"safety.state={state}")
    with (
        Graph(warm, bundle, tmp_path) as graph,
        Witness(graph.domain, topics_of(bundle, TENSION, TORQUE_COMMAND)) as witness,
    ):
        graph.start()
        under_way(witness)
        graph.send(name, signal.SIGKILL)
        reported = witness.until_state(FORCE_CONTROLLER, state)
        assert reported.level == 2
        witness.until_more(TORQUE_COMMAND, 100)
        if name == PLANT:
            for left in set(graph.names) - {PLANT}:
                graph.send(left, signal.SIGTERM)
            codes = graph.join()
        else:
            codes = graph.end() | {name: graph.processes[name].exitcode}
    assert codes == {each: -signal.SIGKILL if each == name else 0 for each in graph.names}
    evidence = Evidence(graph.folder)
    # The last one: a busy computer may have kept it waiting before, which was reset.
    since, reason = evidence.alarms(FORCE_CONTROLLER)[-1]
    heard = (TENSION_COMMAND, TENSION, WINCH_STATE)
    topic = MISSED.get(name) or next((each for each in heard if f"{each} " in reason), TENSION)
    took = reaction(evidence, FORCE_CONTROLLER, topic, TORQUE_COMMAND)
    first = check_torques(evidence, bundle, since, state, blind=name == PLANT)
    said = f"{name} killed, {state}: {topic} to safe torque {took * 1e3:.0f} ms"
    if name == WAVE_TRAJECTORY:
        # The motion controller fell silent first, on a stale reference.
        whole = first - evidence.last_before(REFERENCE, since)
        said += f", from the last reference {whole * 1e-6:.0f} ms"
        assert whole > 1.9 * STALE_AFTER * 1e9
    if name != PLANT:
        assert np.ptp(heave(evidence)) < SAG
        assert not evidence.alarms(WATCHDOG)
    note(said)


@pytest.mark.parametrize("state", ["hold", "brake"])
def test_when_the_force_controllers_are_killed_the_plant_stops_itself(warm, tmp_path, state, note):
    bundle = slow_bundle(f"safety.state={state}")
    with (
        Graph(warm, bundle, tmp_path) as graph,
        Witness(graph.domain, topics_of(bundle, TENSION)) as witness,
    ):
        graph.start()
        under_way(witness)
        graph.send(FORCE_CONTROLLER, signal.SIGKILL)
        witness.until_state(WATCHDOG, state)
        witness.until_more(TENSION, 200)
        graph.end()
    evidence = Evidence(graph.folder)
    took = reaction(evidence, WATCHDOG, TORQUE_COMMAND, "/truth/winches/state")
    since, _ = evidence.alarms(WATCHDOG)[0]
    winches = evidence.rows["/truth/winches/state"]
    first = evidence.stamps("/truth/winches/state") > since + 2 * PERIOD
    angles, _, torques = np.split(winches.rows[first], 3, axis=1)
    if state == "brake":
        assert not torques.any()
        assert np.ptp(angles, axis=0).max() == 0.0
    else:
        np.testing.assert_allclose(torques[-1], balance_torque(bundle), rtol=0.2)
    assert np.ptp(heave(evidence)) < SAG
    assert not evidence.alarms(FORCE_CONTROLLER)
    note(f"force_controller killed, {state}: last command to safe torque {took * 1e3:.0f} ms")


def test_a_patient_watchdog_lets_the_last_torques_stand(warm, tmp_path):
    bundle = slow_bundle("safety.watchdog=10.0", "safety.lateness=10.0")
    with (
        Graph(warm, bundle, tmp_path) as graph,
        Witness(graph.domain, topics_of(bundle, TENSION)) as witness,
    ):
        graph.start()
        under_way(witness)
        graph.send(FORCE_CONTROLLER, signal.SIGKILL)
        witness.until_more(TENSION, 300)
        assert witness.until_said(WATCHDOG, lambda _: True, "a status").message == "ok"
        graph.end()
    evidence = Evidence(graph.folder)
    assert not evidence.alarms(WATCHDOG)
    torques = np.split(evidence.rows["/truth/winches/state"].rows, 3, axis=1)[2]
    assert (torques[-1] > 0.0).all()
    np.testing.assert_array_equal(torques[-200:], np.tile(torques[-1], (200, 1)))


def test_without_the_recorder_the_winches_go_on_and_the_recording_can_be_restored(warm, tmp_path):
    bundle = slow_bundle()
    with (
        Graph(warm, bundle, tmp_path) as graph,
        Witness(graph.domain, topics_of(bundle, TENSION)) as witness,
    ):
        graph.start()
        under_way(witness)
        graph.send("recorder", signal.SIGKILL)
        witness.until_more(TENSION, 200)
        witness.until_running(*GUARDS)
        graph.end()
    report = recover(graph.folder)
    assert report.restored
    with Recording(graph.folder) as recording:
        assert recording.complete
    evidence = Evidence(graph.folder)
    # All but the last 0.2 s of what was recorded before it died.
    assert len(evidence.stamps(TENSION)) >= 60 - 40
    assert (np.diff(evidence.stamps(TENSION)) == PERIOD).all()


def test_stopped_nodes_are_missed_one_after_the_other_and_come_back(warm, tmp_path, note):
    """SIGSTOP hits each node in turn; SIGCONT and a reset bring it back, in one run."""
    bundle = slow_bundle()
    guard_of = dict.fromkeys(MISSED, FORCE_CONTROLLER)
    guard_of |= {PLANT: FORCE_CONTROLLER, FORCE_CONTROLLER: WATCHDOG}
    with (
        Graph(warm, bundle, tmp_path) as graph,
        Witness(graph.domain, topics_of(bundle, TENSION, TORQUE_COMMAND)) as witness,
    ):
        graph.start()
        under_way(witness)
        for name, guard in guard_of.items():
            graph.send(name, signal.SIGSTOP)
            witness.until_state(guard, "hold")
            if name != FORCE_CONTROLLER:
                assert not witness.reset(FORCE_CONTROLLER)[0]
            graph.send(name, signal.SIGCONT)
            # First the drives follow the safe torques again, then the controllers are let go.
            witness.until_state(FORCE_CONTROLLER, "hold")
            for each in (PLANT, FORCE_CONTROLLER):
                witness.until_reset(each)
            under_way(witness)
        # A recorder that is late takes what waits for it, and says what did not.
        graph.send("recorder", signal.SIGSTOP)
        witness.until_more(TENSION, 100)
        graph.send("recorder", signal.SIGCONT)
        under_way(witness)
        assert set(graph.end().values()) <= IN_ORDER
    evidence = Evidence(graph.folder)
    reasons = [reason for _, reason in evidence.alarms(FORCE_CONTROLLER)]
    for event, name in enumerate(MISSED):
        took = reaction(evidence, FORCE_CONTROLLER, TENSION_COMMAND, TORQUE_COMMAND, event=event)
        note(f"{name} stopped: {TENSION_COMMAND} to safe torque {took * 1e3:.0f} ms")
    silent = (TENSION, WINCH_STATE, TENSION_COMMAND)
    # Or the computer was too busy to run it meanwhile, see `reaction`.
    missed = *(f"{topic} stale: " for topic in silent), "stood still for "
    assert reasons[3].startswith(missed)
    assert reasons[4].startswith("stood still for ")
    assert evidence.alarms(WATCHDOG)[-1][1].startswith(f"no {TORQUE_COMMAND} for ")
    # Through all of that the bar hung where it was.
    assert np.ptp(heave(evidence)) < SAG


# The emergency stop


@pytest.mark.parametrize("state", ["hold", "brake"])
def test_the_emergency_stop_acts_within_two_periods_until_it_is_reset(warm, tmp_path, state, note):
    bundle = slow_bundle(f"safety.state={state}")
    with (
        Graph(warm, bundle, tmp_path) as graph,
        Witness(graph.domain, topics_of(bundle, TENSION)) as witness,
    ):
        graph.start()
        under_way(witness)
        # Released it changes nothing.
        witness.emergency_stop(False)
        witness.until_more(TENSION, 50)
        witness.until_running(FORCE_CONTROLLER)
        pressed_ns = witness.node.now_ns()
        witness.emergency_stop(True)
        pressing = witness.node.now_ns() - pressed_ns
        reported = witness.until_state(FORCE_CONTROLLER, state)
        assert reported.values["reason"] == "emergency stop set"
        assert witness.reset(FORCE_CONTROLLER) == (False, "reset refused: emergency stop set")
        witness.emergency_stop(False)
        witness.until_more(TENSION, 100)
        # Latched: released it stays safe until it is reset.
        witness.until_state(FORCE_CONTROLLER, state)
        witness.until_reset(FORCE_CONTROLLER)
        under_way(witness)
        assert set(graph.end().values()) <= IN_ORDER
    evidence = Evidence(graph.folder)
    # The recorder may not know the publisher yet when the first is sent.
    assert evidence.stops[-2:] == [True, False]
    assert set(evidence.stops[:-2]) <= {False}
    ((since, reason),) = evidence.alarms(FORCE_CONTROLLER)
    assert reason == "emergency stop set"
    stamps, _ = evidence.torques(since + MS)
    took = int(stamps[0]) - pressed_ns
    gap = evidence.longest_gap(TORQUE_COMMAND, pressed_ns - PERIOD, since + 10 * PERIOD)
    assert took <= 2 * PERIOD + MS + gap + pressing
    assert np.ptp(heave(evidence)) < SAG
    if state == "brake":
        assert True in evidence.brakes
        assert not evidence.brakes[-1]
        (safe,) = np.nonzero(~evidence.torques()[1].any(axis=1))
        assert len(safe) > 90
        took = int(evidence.torques()[0][safe[0]]) - pressed_ns
        assert took <= 2 * PERIOD + gap + pressing
    note(f"emergency stop, {state}: to safe torque {took * 1e-6:.1f} ms")


def test_an_emergency_stop_that_falls_silent_acts_like_one_that_is_pressed(warm, tmp_path):
    bundle = slow_bundle(f"safety.stop_heartbeat={HEARTBEAT}")
    with (
        Graph(warm, bundle, tmp_path) as graph,
        Witness(graph.domain, topics_of(bundle, TENSION)) as witness,
    ):
        beat = witness.repeat_stop(0.1 * HEARTBEAT)
        graph.start()
        under_way(witness)
        witness.node.forget(beat)
        reported = witness.until_state(FORCE_CONTROLLER, "hold")
        silence = re.fullmatch(
            rf"emergency stop silent for (\d+) ms, allowed: {1e3 * HEARTBEAT:g} ms",
            reported.values["reason"],
        )
        assert int(silence[1]) > 1e3 * HEARTBEAT
        refused, why = witness.reset(FORCE_CONTROLLER)
        assert (refused, why.partition(" for ")[0]) == (
            False,
            "reset refused: emergency stop silent",
        )
        witness.repeat_stop(0.1 * HEARTBEAT)
        witness.until_reset(FORCE_CONTROLLER)
        under_way(witness)
        assert set(graph.end().values()) <= IN_ORDER
    assert np.ptp(heave(Evidence(graph.folder))) < SAG


# Foreign messages


def message(topic, stamp_ns, row, **changes):
    """Return CDR bytes of a message with some of its fields replaced."""
    made = message_of(topic, stamp_ns, row)
    for name, value in changes.items():
        setattr(made, name, value)
    return serialize(made)


def test_foreign_messages_are_answered_with_the_safe_state_and_its_reason(warm, tmp_path, note):
    bundle = slow_bundle()
    topics = bundle.testbed.testbed.topics
    tension, command, twist = topics[TENSION], topics[TENSION_COMMAND], topics["/bar/twist"]
    pose, torque, truth = topics[BAR_POSE], topics[TORQUE_COMMAND], topics[TRUTH]
    five, names = np.full(8, 5.0), list(bundle.testbed.testbed.cable_names)
    nan = np.where(np.arange(8) == 2, np.nan, 5.0)
    swapped = [names[1], names[0], *names[2:]]
    thousands = [f"c{i}" for i in range(10_000)]
    upright = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    abroad = message_of(pose, 0, upright).header
    abroad.frame_id = "map"
    second = 1_000 * MS
    stranger = "a second publisher, of witness, allowed: that of"
    cases = [
        (tension, 0, nan, {}, f"{TENSION}: effort of surge_1 is nan, allowed: finite numbers"),
        (command, 0, nan, {}, f"{TENSION_COMMAND}: effort of surge_1 is nan, allowed: finite"),
        (command, 0, five, {"effort": five[:7]}, f"{TENSION_COMMAND}: effort has 7 values for 8"),
        (tension, 0, five, {"name": swapped}, f"{TENSION}: names in a wrong order, name 1 is 'h"),
        (tension, 0, five, {"name": thousands}, f"{TENSION}: a message of "),
        (tension, -second, five, {}, f"{TENSION}: {stranger} plant alone"),
        (command, 0, five, {}, f"{TENSION_COMMAND}: {stranger} tension_distribution alone"),
        (tension, 10 * second, five, {}, f"{TENSION}: {stranger}"),
        (pose, 0, upright, {}, f"{BAR_POSE}: {stranger} plant alone"),
        (pose, 0, upright, {"header": abroad}, f"{BAR_POSE}: frame 'map', allowed: 'world_ned'"),
        (truth, 0, upright, {}, f"recorder: {TRUTH}: {stranger} plant alone"),
        (torque, 3600 * second, five, {}, f"{TORQUE_COMMAND}: {stranger} force_controller alone"),
    ]
    took = []
    with (
        Graph(warm, bundle, tmp_path) as graph,
        Witness(graph.domain, topics_of(bundle, TENSION)) as witness,
    ):
        send = {
            topic.name: witness.publisher(topic, (RECORDER,))
            for topic in (tension, command, pose, torque, truth, BRAKE)
        }
        send[twist.name] = witness.publisher(twist)
        graph.start()
        under_way(witness)
        witness.until_connected()
        # What is no topic of this run changes nothing.
        for _ in range(20):
            send[twist.name](message(twist, witness.node.now_ns(), np.full(6, np.nan)))
        witness.until_more(TENSION, 50)
        witness.until_running(*GUARDS)
        for topic, shift, row, changes, reason in cases:
            sent_ns = witness.node.now_ns()
            send[topic.name](message(topic, sent_ns + shift, row, **changes))
            sending = witness.node.now_ns() - sent_ns
            reported = witness.until_state(FORCE_CONTROLLER, "hold")
            # Whichever node is first to hear of it says so; the recorder asks for the sender alone.
            said = reported.values["reason"]
            assert reason in said or f"recorder: {topic.name}: {stranger}" in said
            since = float(reported.message.partition(" since ")[2].partition(" s:")[0])
            took.append((round(since * 1e3) * MS - sent_ns, sent_ns, sending))
            if topic is torque:
                held = witness.until_state(WATCHDOG, "hold")
                assert held.values["reason"].startswith(reason)
                witness.until_reset(PLANT)
            witness.until_reset(FORCE_CONTROLLER)
            witness.until_running(*GUARDS)
        send[BRAKE.name](b"\0\1\0\0\1")
        held = witness.until_state(WATCHDOG, "hold")
        assert f"{BRAKE.name}: {stranger} force_controller alone" in held.values["reason"]
        witness.until_state(FORCE_CONTROLLER, "hold")
        witness.until_reset(PLANT)
        witness.until_reset(FORCE_CONTROLLER)
        witness.until_running(*GUARDS)
        assert set(graph.end().values()) <= IN_ORDER
    evidence = Evidence(graph.folder)
    assert len(evidence.alarms(FORCE_CONTROLLER)) == len(cases) + 1
    assert True not in evidence.brakes
    for reacted, sent_ns, sending in took:
        until = sent_ns + sending + 10 * PERIOD
        gap = evidence.longest_gap(TORQUE_COMMAND, sent_ns - PERIOD, until)
        assert reacted <= 2 * PERIOD + MS + gap + sending
    assert np.ptp(heave(evidence)) < SAG
    # What nobody obeyed is recorded as it came, and on topics of its own.
    refused = {
        TENSION: 5,
        TENSION_COMMAND: 3,
        BAR_POSE: 2,
        TRUTH: 1,
        TORQUE_COMMAND: 1,
        BRAKE.name: 1,
    }
    with Recording(graph.folder) as recording:
        assert recording.refused == {f"/refused{name}": n for name, n in refused.items()}
        assert np.abs(recording.rows(BAR_POSE).rows[:, 2] - 2.0).max() < SAG
    frames = {m.header.frame_id for m in rosbags_messages(graph.folder, BAR_POSE)}
    assert frames == {"world_ned"}
    frames = {m.header.frame_id for m in rosbags_messages(graph.folder, f"/refused{BAR_POSE}")}
    assert frames == {"world_ned", "map"}
    for topic in (tension, command, torque):
        obeyed = [m.effort.tolist() for m in rosbags_messages(graph.folder, topic.name)]
        apart = [m.effort.tolist() for m in rosbags_messages(graph.folder, f"/refused{topic.name}")]
        assert five.tolist() not in obeyed
        assert len(apart) == refused[topic.name]
    # Strangers' numbers are no losses.
    lost = [s.values["lost"] for s in evidence.statuses if s.name == "recorder"]
    assert set(lost) == {"0"}
    note(f"foreign messages: {max(r for r, _, _ in took) * 1e-6:.0f} ms at most")


def rosbags_messages(folder, topic):
    """Yield the messages of a topic as another reader of bags finds them."""
    with AnyReader([folder], default_typestore=typestore()) as reader:
        wanted = [each for each in reader.connections if each.topic == topic]
        for connection, _, payload in reader.messages(wanted):
            yield reader.deserialize(payload, connection.msgtype)


def test_the_time_of_a_run_is_nobody_elses(warm, tmp_path):
    bundle = slow_bundle()
    with (
        Graph(warm, bundle, tmp_path) as graph,
        Witness(graph.domain, topics_of(bundle, TENSION)) as witness,
    ):
        graph.start()
        under_way(witness)
        service = f"/{FORCE_CONTROLLER}/set_parameters"
        kind = ros_class("rcl_interfaces/srv/SetParameters")
        client = witness.node.node.create_client(kind, service)
        witness.until(client.service_is_ready, service)
        request = kind.Request(
            parameters=[Parameter("use_sim_time", value=True).to_parameter_msg()]
        )
        answer = client.call_async(request)
        witness.until(answer.done, service)
        (result,) = answer.result().results
        assert not result.successful
        assert result.reason == "use_sim_time: true, allowed in real time: false"
        witness.until_more(TENSION, 50)
        witness.until_running(*GUARDS)
        assert set(graph.end().values()) <= IN_ORDER
    assert not Evidence(graph.folder).alarms(FORCE_CONTROLLER)
