"""A run and its recording."""

import os
import resource
import signal
from contextlib import contextmanager
from importlib.metadata import version

import numpy as np
import pytest
from loops import WILD, Listener
from rosbags.highlevel import AnyReader
from run_samples import THESIS_CABLES, bundle_of, recorded, run_to, stamps

from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.message import carries_row
from cspm_msgs_py.recording import Recording, first_difference, overview
from cspm_msgs_py.topics import SCENE
from cspm_run.recorded_run import metadata, run

MEASURED = {"/winches/state", "/cables/tension"}
POSES = {"/winch_frame/pose", "/bar/pose"}
TWISTS = {"/winch_frame/twist", "/bar/twist"}
REFERENCES = {"/winch_frame/reference", "/bar/reference"}
COMMANDS = {"/wrench_command", "/tension_command", "/winches/torque_command"}
ALWAYS = {"/clock", "/diagnostics", "/tf_static", "/robot_description", *MEASURED}
SHOWN = {"/tf", "/markers"}
RIG_TRUTH = {f"/truth{name}" for name in (*MEASURED, "/cables/unstretched_length")}
TRUTH = RIG_TRUTH | {f"/truth{name}" for name in POSES | TWISTS}
TYPES = {
    "pose": "geometry_msgs/msg/PoseStamped",
    "twist": "geometry_msgs/msg/TwistStamped",
    "reference": "trajectory_msgs/msg/MultiDOFJointTrajectory",
    "clock": "rosgraph_msgs/msg/Clock",
    "diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    "wrench_command": "geometry_msgs/msg/WrenchStamped",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """0.3 s of the worst case."""
    place = tmp_path_factory.mktemp("run") / "waves"
    run(bundle_of("worst_case"), place, steps=300)
    return place


@pytest.fixture(scope="module")
def heard():
    """The same 0.3 s, taken from the loop without any recording."""
    return Listener(bundle_of("worst_case")).run(300)


@pytest.mark.parametrize(
    ("scenario", "topics"),
    [
        ("rest", ALWAYS | POSES | REFERENCES | COMMANDS | TRUTH | SHOWN),
        ("verification_mid", ALWAYS | POSES | REFERENCES | TRUTH | SHOWN),
        ("one_winch", ALWAYS | {"/winches/torque_command"} | RIG_TRUTH),
    ],
)
def test_every_topic_of_the_machines_parts_is_there_and_no_other(tmp_path, scenario, topics):
    result = run(bundle_of(scenario), tmp_path / "bag", steps=20)
    with Recording(tmp_path / "bag") as recording:
        found = {name: info.count for name, info in recording.topics.items()}
        assert {name for name, count in found.items() if count} == topics
        assert set(found) - topics <= SHOWN
        assert found == result.messages
        for name, info in recording.topics.items():
            if name in SCENE:
                assert info.ros_type == SCENE[name].ros_type
                continue
            expected = TYPES.get(name.rsplit("/", 1)[1], "sensor_msgs/msg/JointState")
            assert info.ros_type == expected


@pytest.mark.slow
def test_other_tools_read_the_same_numbers(folder, heard):
    """Every message by its own class, read by rosbags, against what the loop sent."""
    seen = dict.fromkeys(heard.messages, 0)
    with AnyReader([folder]) as bag:
        for connection, log_ns, payload in bag.messages():
            name = connection.topic
            if name == "/diagnostics" or name in SCENE:
                continue
            message = bag.deserialize(payload, connection.msgtype)
            log, stamp, row = heard.messages[name][seen[name]]
            seen[name] += 1
            assert log_ns == log
            np.testing.assert_array_equal(numbers(message), row)
            check_head(name, message, stamp)
    assert seen == {name: len(found) for name, found in heard.messages.items()}


def check_head(name, message, stamp_ns):
    time = message.clock if name == "/clock" else message.header.stamp
    assert time.sec * 10**9 + time.nanosec == stamp_ns
    if name == "/clock":
        return
    if name.endswith(("pose", "twist", "reference", "wrench_command")):
        assert message.header.frame_id == "world_ned"
    else:
        assert tuple(message.name) == THESIS_CABLES
    if name.endswith("reference"):
        assert message.joint_names == [name.split("/")[1] + "_ned"]


def numbers(message):
    """The numbers of a message in the contract's order."""

    def xyz(vector):
        return [vector.x, vector.y, vector.z]

    def four(rotation):
        return [*xyz(rotation), rotation.w]

    kind = message.__msgtype__.split("/")[-1]
    if kind == "PoseStamped":
        return xyz(message.pose.position) + four(message.pose.orientation)
    if kind == "TwistStamped":
        return xyz(message.twist.linear) + xyz(message.twist.angular)
    if kind == "WrenchStamped":
        return xyz(message.wrench.force) + xyz(message.wrench.torque)
    if kind == "JointState":
        return [*message.position, *message.velocity, *message.effort]
    if kind == "MultiDOFJointTrajectory":
        [point] = message.points
        [place], [speed], [change] = point.transforms, point.velocities, point.accelerations
        parts = (speed.linear, speed.angular, change.linear, change.angular)
        pose = xyz(place.translation) + four(place.rotation)
        return [*pose, *(number for part in parts for number in xyz(part))]
    return []


def test_tensions_are_efforts_and_states_are_all_three(folder):
    with AnyReader([folder]) as bag:
        first = {}
        for connection, _, payload in bag.messages():
            first.setdefault(connection.topic, (connection, payload))
        sizes = {}
        for name, (connection, payload) in first.items():
            if connection.msgtype == "sensor_msgs/msg/JointState":
                message = bag.deserialize(payload, connection.msgtype)
                parts = (message.position, message.velocity, message.effort)
                sizes[name] = tuple(len(part) for part in parts)
    assert sizes == {
        "/winches/state": (8, 8, 8),
        "/truth/winches/state": (8, 8, 8),
        "/cables/tension": (0, 0, 8),
        "/truth/cables/tension": (0, 0, 8),
        "/tension_command": (0, 0, 8),
        "/winches/torque_command": (0, 0, 8),
        "/truth/cables/unstretched_length": (8, 0, 0),
    }


def test_recorded_rates(tmp_path):
    _, rows = run_to(tmp_path / "bag", "rest", steps=500)
    slow = {"/bar/pose", "/winch_frame/pose", "/wrench_command", "/tension_command"}
    for name, found in rows.items():
        expected = stamps(100 if name in slow else 1000, 0.5)
        np.testing.assert_array_equal(found.stamp_ns, expected)
        np.testing.assert_array_equal(found.log_ns, expected)
    with Recording(tmp_path / "bag") as recording:
        assert recording.topics["/diagnostics"].count == 5 * 5


def test_the_same_seed_gives_the_same_recording(folder, tmp_path):
    run(bundle_of("worst_case"), tmp_path / "again", steps=300)
    with Recording(folder) as one, Recording(tmp_path / "again") as other:
        assert first_difference(one, other) is None


def test_another_seed_gives_another_recording(folder, tmp_path):
    run(bundle_of("worst_case", "seed=2"), tmp_path / "other", steps=300)
    with Recording(folder) as one, Recording(tmp_path / "other") as other:
        found = first_difference(one, other)
        assert found is not None
        assert found.stamp_ns == 0
    first, second = recorded(folder), recorded(tmp_path / "other")
    # Other waves, and other noise on them.
    for topic in ("/bar/reference", "/cables/tension"):
        assert (first[topic].rows != second[topic].rows).any(axis=1)[1:].all()


def test_recording_changes_nothing(folder):
    result = run(bundle_of("worst_case"), None, steps=300)
    assert result.folder is None
    assert result.messages == {}
    again = run(bundle_of("worst_case"), folder.parent / "third", steps=300)
    np.testing.assert_array_equal(result.statistics.rms_error, again.statistics.rms_error)
    assert result.statistics.tension_range == again.statistics.tension_range


def test_the_recording_says_what_was_run(folder):
    bundle = bundle_of("worst_case")
    with Recording(folder) as recording:
        assert recording.complete
        assert recording.attachments == bundle.attachments()
        assert recording.metadata["cspm"] == metadata(bundle, "inprocess")
    found = overview(folder)
    assert (found.scenario, found.testbed, found.complete) == (
        "worst_case",
        "thesis_refitted",
        True,
    )
    assert metadata(bundle, "inprocess") == {
        "contract_version": "1",
        "scenario": "worst_case",
        "seed": "1",
        "mode": "inprocess",
        "plant": "sim",
        "package_version": version("cspm"),
        "testbed": "thesis_refitted",
        "testbed_sha256": bundle.testbed.sha256,
    }


def test_a_run_lasts_as_long_as_its_scenario_or_as_requested(tmp_path):
    reported = []
    result = run(bundle_of("one_winch", "duration=0.234"), tmp_path / "bag", reported.append)
    assert result.simulated == pytest.approx(0.234)
    assert not result.interrupted
    assert result.failure is None
    assert reported == sorted(reported)
    assert reported[-1] == pytest.approx(0.234)
    assert result.messages["/clock"] == 234
    assert result.real_time_factor == result.simulated / result.elapsed > 0.0
    assert run(bundle_of("one_winch"), None, steps=1).simulated == pytest.approx(0.001)


def test_an_existing_folder_is_left_alone(tmp_path):
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "mine.txt").write_text("keep")
    with pytest.raises(InputError) as caught:
        run(bundle_of("one_winch"), tmp_path / "bag", steps=10)
    assert str(caught.value) == f"{tmp_path}/bag: already exists, allowed: a new folder"
    assert [path.name for path in (tmp_path / "bag").iterdir()] == ["mine.txt"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_run_between_two_steps(tmp_path, number):
    before = [signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)]

    def strike(now):
        if now > 0.2:
            os.kill(os.getpid(), number)

    result = run(bundle_of("one_winch"), tmp_path / "bag", strike)
    assert result.interrupted
    assert result.failure is None
    assert 0.2 < result.simulated < 0.4
    with Recording(tmp_path / "bag") as recording:
        assert recording.complete
        assert recording.topics["/clock"].count == round(result.simulated * 1000)
        rows = [info for info in recording.topics.values() if carries_row(info.ros_type)]
        counts = {info.count for info in rows}
        assert len(counts) == 1
    assert before == [signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)]


@pytest.fixture
def interruptible():
    """Let SIGINT interrupt, which programs in a shell's background are started without."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
def test_a_second_signal_means_it(tmp_path):
    def strike(_):
        # Raised in this thread: two that another thread received might count as one.
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        run(bundle_of("one_winch"), tmp_path / "bag", strike)
    with Recording(tmp_path / "bag") as recording:
        assert recording.complete


def test_a_divergence_ends_the_run_and_keeps_its_recording(tmp_path):
    result = run(bundle_of("rest", *WILD), tmp_path / "bag")
    assert result.failure is not None
    assert not result.interrupted
    assert 0.0 < result.simulated < 20.0
    when = f"t = {result.simulated:.3f} s: "
    assert result.failure.startswith(when)
    assert "; before it: wrench infeasible since 0." in result.failure
    assert "\n" not in result.failure
    rows = recorded(tmp_path / "bag")
    with Recording(tmp_path / "bag") as recording:
        assert recording.complete
    # The last recorded instant is the one from which the plant did not come.
    assert rows["/clock"].stamp_ns[-1] == round((result.simulated - 0.001) * 1e9)
    assert all(np.isfinite(found.rows).all() for found in rows.values())


@contextmanager
def no_file_above(size):
    """Python ignores SIGXFSZ, so that writing beyond the limit is an error like a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_full_disk_ends_the_run_with_one_line(tmp_path):
    bundle = bundle_of("one_winch")
    run(bundle, None, steps=10)  # compiles, which writes files of its own
    with no_file_above(60_000), pytest.raises(CspmError) as caught:
        run(bundle, tmp_path / "bag")
    assert str(caught.value) == (f"{tmp_path}/bag/bag_0.mcap: recording failed (File too large)")
    assert caught.value.exit_code == 1
    with Recording(tmp_path / "bag") as recording:
        assert not recording.complete
        assert recording.topics["/clock"].count > 0
