"""The recorder without ROS: any delivery of a run's messages makes the same recording."""

import random
from itertools import count

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lockstep_network import Network, chooser
from recorded_lockstep_runs import MS, REST, STEPS, Case, Intake, late, spoilt
from ros_graph import content, difference, hashes
from run_samples import bundle_of

from cspm_msgs_py.diagnostics import encode_diagnostics
from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.message import header_of
from cspm_msgs_py.recording import Recording
from cspm_msgs_py.ros_types import message_class, serialize
from cspm_msgs_py.schedule import schedule_of
from cspm_msgs_py.stepping.lockstep import RECORDED_EVERY, RECORDER_WINDOW
from cspm_msgs_py.wire import WireWriter
from cspm_run.recorded_run import run

SEEDS = st.integers(0, 2**32 - 1)

NO_STATUS = "not one status of a node of this run, allowed: one"


LATE = late(REST, bar__pose=23, cables__tension=3)


@pytest.fixture(scope="module", params=[REST, LATE], ids=["ideal", "late"])
def case(request, tmp_path_factory):
    return Case(request.param, tmp_path_factory.mktemp("recorder") / "expected")


def deliver(intake, sent, seed):
    """Deliver all of `sent`, in the order of each sender, otherwise in any."""
    left = {queue: iter(payloads) for queue, payloads in sent.items()}
    choose, names = chooser(random.Random(seed)), list(sent)
    while names:
        queue = choose(names)
        payload = next(left[queue], None)
        if payload is None:
            names.remove(queue)
        else:
            intake.take(queue, payload)


@pytest.mark.slow
@settings(max_examples=6)
@given(seed=SEEDS)
def test_any_delivery_makes_the_same_file(case, tmp_path_factory, seed):
    folder = tmp_path_factory.mktemp("any") / "bag"
    intake = Intake(case.bundle, folder)
    with intake.writer:
        deliver(intake, case.sent, seed)
        assert intake.recorder.completed <= STEPS - 1
        intake.recorder.end(STEPS - 1)
        assert intake.recorder.done
    assert content(folder) == content(case.expected)
    assert intake.recorder.refused == (0, "")
    assert intake.reported[-1] == STEPS - 1
    assert intake.reported == sorted(intake.reported)


@pytest.mark.slow
@settings(max_examples=5)
@given(seed=SEEDS)
def test_recorded_while_it_runs(case, tmp_path_factory, seed):
    """The recorder holds the plant back, so that no queue overflows, and is notified of the end."""
    folder = tmp_path_factory.mktemp("run") / "bag"
    intakes = []

    def make_recorder(acknowledge):
        intakes.append(Intake(case.bundle, folder, acknowledge))
        return intakes[0].recorder

    testbed = case.bundle.testbed.testbed
    network = Network(case.bundle.scenario, testbed, STEPS, make_recorder)
    with intakes[0].writer:
        network.run(chooser(random.Random(seed)))
    assert network.lost == 0
    assert network.plant.finished
    assert network.recorder.done
    assert content(folder) == content(case.expected)


def test_hashes_distinguish_recordings(case, tmp_path):
    run(bundle_of("rest", "seed=2"), tmp_path / "other", steps=STEPS)
    found, other = hashes(case.expected), hashes(tmp_path / "other")
    assert found["/cables/tension"] != other["/cables/tension"]
    assert found["/clock"] == other["/clock"]
    assert content(case.expected) != content(tmp_path / "other")


@pytest.mark.parametrize("end", [0, 1, 49, 50, 117])
def test_a_run_that_ends_early_is_recorded_to_its_end(case, tmp_path, end):
    """What nodes computed ahead of the end is left out."""
    run(case.bundle, tmp_path / "expected", steps=end + 1)
    intake = Intake(case.bundle, tmp_path / "bag")
    with intake.writer:
        deliver_through(intake, case, end + 3, until=end)
        intake.recorder.end(end)
        assert intake.recorder.done
    assert difference(tmp_path / "expected", tmp_path / "bag") is None
    assert content(tmp_path / "expected") == content(tmp_path / "bag")


def deliver_through(intake, case, step, until=None):
    """Deliver what belongs to steps up to `step`; of one topic, the clock, only up to `until`."""
    schedule = schedule_of(case.bundle.scenario, case.bundle.testbed.testbed)
    for queue, payloads in case.sent.items():
        if isinstance(queue, tuple):
            share = -(-(step + 1) // 100)
        else:
            last = until if queue == "/clock" and until is not None else step
            share = schedule.topics[queue].count(last + 1)
        for payload in payloads[:share]:
            intake.take(queue, payload)


def test_a_run_that_ends_without_a_word_keeps_its_whole_steps(case, tmp_path):
    run(case.bundle, tmp_path / "expected", steps=58)
    intake = Intake(case.bundle, tmp_path / "bag")
    with intake.writer:
        deliver_through(intake, case, 70, until=57)
        assert not intake.recorder.done
        intake.recorder.write_whole()
    assert difference(tmp_path / "expected", tmp_path / "bag") is None


def test_nothing_is_acknowledged_before_all_of_it_is_there(case, tmp_path):
    intake = Intake(case.bundle, tmp_path / "bag")
    with intake.writer:
        deliver_through(intake, case, 40, until=-1)
        assert intake.reported == []
        assert intake.recorder.missing() == ["/clock"]
        clock = count()
        for payload in case.sent["/clock"][:41]:
            intake.take("/clock", payload)
            step = next(clock)
            assert not intake.reported or intake.reported[-1] <= step
            assert step - max(intake.reported, default=-1) <= RECORDED_EVERY
        assert intake.recorder.completed >= 40 - RECORDED_EVERY


def test_a_silent_node_is_missed(case, tmp_path):
    intake = Intake(case.bundle, tmp_path / "bag")
    with intake.writer:
        silent = {
            key: value for key, value in case.sent.items() if key != ("/diagnostics", "plant")
        }
        deliver(intake, silent, 0)
        assert intake.recorder.completed == -1
        assert intake.recorder.missing() == ["/diagnostics of plant"]


def test_an_end_that_cannot_be_is_refused(case, tmp_path):
    intake = Intake(case.bundle, tmp_path / "bag")
    with intake.writer:
        with pytest.raises(InputError, match=r"^the last step is 5000, allowed: -1 to "):
            intake.recorder.end(5000)
        deliver_through(intake, case, 60)
        reached = intake.recorder.completed
        for last in (reached - 1, -1, reached + RECORDER_WINDOW + 3):
            with pytest.raises(InputError, match=rf"^the last step is {last}, allowed: {reached} "):
                intake.recorder.end(last)
        assert not intake.recorder.done
        intake.recorder.end(60)
        assert intake.recorder.done


# What does not belong


@settings(max_examples=6)
@given(seed=SEEDS)
def test_what_does_not_belong_changes_nothing(case, tmp_path_factory, seed):
    """Before each genuine message come copies of it that are broken, late or early."""
    rng = random.Random(seed)
    folder = tmp_path_factory.mktemp("spoilt") / "bag"
    intake = Intake(case.bundle, folder)
    left = {queue: list(payloads) for queue, payloads in case.sent.items()}
    at, added = dict.fromkeys(left, 0), 0
    choose, names = chooser(rng), list(left)
    with intake.writer:
        while names:
            queue = choose(names)
            payloads, i = left[queue], at[queue]
            if i == len(payloads):
                names.remove(queue)
                continue
            wrong = [
                p for j, p in enumerate(payloads[max(0, i - 2) : i + 3]) if j + max(0, i - 2) != i
            ]
            if rng.random() < 0.3:
                wrong += [spoilt(queue, payloads[i], rng) for _ in range(2)]
            for payload in wrong if rng.random() < 0.2 else []:
                if payload != payloads[i]:
                    intake.take(queue, payload)
                    added += 1
            intake.take(queue, payloads[i])
            at[queue] += 1
        intake.recorder.end(STEPS - 1)
    assert content(folder) == content(case.expected)
    assert intake.recorder.refused[0] == added == len(intake.rate_limited_warnings)
    assert added > 100
    assert all(reason.startswith(f"{topic}: ") for topic, reason in intake.rate_limited_warnings)


@pytest.fixture
def fresh(tmp_path):
    intake = Intake(REST, tmp_path / "bag")
    with intake.writer:
        yield intake


def test_a_broken_message_with_the_right_stamp_does_not_take_the_genuine_ones_place(fresh):
    topic = REST.testbed.testbed.topics["/cables/tension"]
    encode = WireWriter(topic).encode
    good = encode(0, np.arange(8.0))
    names = good.replace(b"hoist_1", b"hoist_9")
    for payload in (encode(0, np.full(8, np.nan)), names, good[:-8]):
        fresh.take("/cables/tension", payload)
    assert fresh.recorder.refused[0] == 3
    assert [reason.split(", allowed")[0] for _, reason in fresh.rate_limited_warnings] == [
        "/cables/tension: effort of hoist_1 is nan",
        "/cables/tension: name 1 is 'hoist_9'",
        f"/cables/tension: {len(good) - 8} bytes that are no sensor_msgs/msg/JointState",
    ]
    fresh.take("/cables/tension", good)
    assert fresh.recorder.refused[0] == 3
    fresh.take("/cables/tension", good)
    assert fresh.recorder.refused == (
        4,
        "/cables/tension: stamp 0.000000 s came already: a restarted clock or a second sender,"
        " allowed: 0.001000 s",
    )


@pytest.mark.parametrize(
    ("payload", "reason"),
    [
        (b"", NO_STATUS),
        (b"\x00\x01\x00\x00" + b"\xff" * 20, NO_STATUS),
        (encode_diagnostics(0, []), NO_STATUS),
        (
            encode_diagnostics(0, [(0, "plant", "ok", {})] * 2),
            NO_STATUS,
        ),
        (
            encode_diagnostics(0, [(0, "battery", "ok", {})]),
            NO_STATUS,
        ),
        (encode_diagnostics(5, [(0, "plant", "ok", {})]), "plant at 5 ns, allowed: 0 ns"),
    ],
)
def test_other_diagnostics_are_refused(fresh, payload, reason):
    fresh.recorder.receive_diagnostics(payload, 0)
    assert fresh.recorder.refused == (1, f"/diagnostics: {reason}")
    assert fresh.rate_limited_warnings == [("/diagnostics", f"/diagnostics: {reason}")]
    fresh.recorder.receive_diagnostics(encode_diagnostics(0, [(0, "plant", "ok", {})]), 0)
    assert fresh.recorder.refused[0] == 1


def test_a_status_is_known_by_its_senders_number(tmp_path):
    """Of nodes that speak for themselves; who speaks for others has other numbers."""
    intake = Intake(REST, tmp_path / "bag", reporting=["plant"])
    with intake.writer:
        take, period = intake.recorder.receive_diagnostics, 100 * MS
        status = {name: (0, name, "ok", {}) for name in ("plant", "force_controller")}
        take(encode_diagnostics(0, [status["plant"]]), 0, 2)
        assert intake.recorder.refused == (
            1,
            "/diagnostics: plant at 0 ns is its sender's message 2, allowed: 1; a second sender",
        )
        take(encode_diagnostics(0, [status["plant"]]), 0, 1)
        take(encode_diagnostics(period, [status["plant"]]), 0, 1)
        assert intake.recorder.refused[0] == 2
        take(encode_diagnostics(period, [status["plant"]]), 0, 2)
        take(encode_diagnostics(0, [status["force_controller"]]), 0, 77)
        assert intake.recorder.refused[0] == 2


def test_a_number_that_no_node_has_next_is_refused_unread(tmp_path, monkeypatch):
    """Whoever floods the topic sends more than can be decoded."""
    everybody = ["plant", *schedule_of(REST.scenario, REST.testbed.testbed).nodes]
    intake = Intake(REST, tmp_path / "bag", reporting=everybody)
    with intake.writer:
        take = intake.recorder.receive_diagnostics
        take(encode_diagnostics(0, [(0, "plant", "ok", {})]), 0, 1)
        decoded = []
        monkeypatch.setattr("cspm_ros.runtime.lockstep_recorder.decode_diagnostics", decoded.append)
        take(b"anything", 0, 9)
        assert decoded == []
        assert intake.recorder.refused == (
            1,
            "/diagnostics: its sender's message 9, allowed: 1, 2; a second sender",
        )
        monkeypatch.undo()
        take(encode_diagnostics(100 * MS, [(0, "plant", "ok", {})]), 0, 2)
        assert intake.recorder.refused[0] == 1


def test_two_senders_of_a_topic_are_an_error(fresh):
    encode = WireWriter(REST.testbed.testbed.topics["/cables/tension"]).encode
    take = fresh.recorder.receive("/cables/tension")
    take(encode(0, np.arange(8.0)), 0, 1)
    with pytest.raises(CspmError, match=r"^/cables/tension: two senders"):
        take(encode(0, np.ones(8)), 0, 1)


def test_ten_thousand_statuses_are_refused(fresh):
    fresh.recorder.receive_diagnostics(encode_diagnostics(0, [(0, "plant", "ok", {})] * 10_000), 0)
    assert fresh.recorder.refused[0] == 1


def test_a_status_with_text_that_is_none_is_refused(fresh):
    payload = encode_diagnostics(0, [(0, "plant", "okay", {})])
    fresh.recorder.receive_diagnostics(payload.replace(b"okay", b"\xff\xfe\xfd\xfc"), 0)
    assert fresh.recorder.refused[0] == 1


def test_the_same_message_of_another_sender_is_recorded_in_the_contracts_form(fresh, tmp_path):
    """A frame of its own and numbers that are not asked for do not matter."""
    topic = REST.testbed.testbed.topics["/cables/tension"]
    message = message_class(topic.ros_type)(
        header_of(0, "lab"), list(topic.joint_names), np.ones(8), np.zeros(0), np.arange(8.0)
    )
    fresh.take("/cables/tension", serialize(message))
    assert fresh.recorder.refused == (0, "")
    fresh.recorder._write(1)
    fresh.writer.close()
    with Recording(tmp_path / "bag") as recording:
        [payload] = recording.payloads("/cables/tension").payloads
    assert payload == WireWriter(topic).encode(0, np.arange(8.0))
