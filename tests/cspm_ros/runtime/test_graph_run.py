"""All nodes in one process over the real middleware: the same messages as without ROS."""

import json
import os
import re
import resource
import signal
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest
from error_lines import said
from loops import WILD
from recorded_lockstep_runs import late
from ros_graph import assert_same, content, difference, done, load_ros, new_domain
from run_samples import bundle_of, recorded

from bench.results.tracking import Case
from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.recording import Recording
from cspm_ros.runtime import stall_watchdog as watch
from cspm_run.recorded_run import metadata, run
from cspm_run.resim import resimulate

load_ros()

from std_msgs.msg import Header, String  # noqa: E402

from cspm_msgs_py.ros.contract_node import ros_class  # noqa: E402
from cspm_msgs_py.ros.qos import contract_qos  # noqa: E402
from cspm_msgs_py.ros.rendezvous import END  # noqa: E402
from cspm_msgs_py.ros.session import Session  # noqa: E402
from cspm_msgs_py.schedule import PLANT  # noqa: E402
from cspm_ros.runtime.graph_run import run_graph  # noqa: E402
from cspm_ros.runtime.lockstep_nodes import LockstepRun  # noqa: E402

pytestmark = pytest.mark.compiled

LATE = {"bar__pose": 23, "cables__tension": 3, "winches__state": 11}
# Rates of which none divides another.
ODD = ("motion_capture=125", "wave_trajectory=250", "motion_controller=50", "force_controller=200")
SLOW_SENSORS = ("motion_capture=20", "wave_trajectory=20")
FAST_CONTROL = ("motion_controller=1000", "tension_distribution=1000")
RUNS = {
    "calm": (bundle_of("calm"), 600),
    "worst case": (bundle_of("worst_case"), 600),
    "past the thesis": (bundle_of("worst_case_past_thesis"), 300),
    "torques, no bar": (bundle_of("one_winch"), 250),
    "angles, no bar": (bundle_of("rig_stiffness_sway"), 250),
    "late sensors": (late(bundle_of("rest"), **LATE), 200),
    "internals and dither": (
        bundle_of(
            "worst_case",
            "control.record_internals=true",
            "control.force.dither={amplitude: 0.01, frequency: 130}",
        ),
        300,
    ),
    "a measured target": (bundle_of("calm_measured_target", "rates.motion_capture=100"), 250),
    "a cut cable": (bundle_of("calm_cut_cable", "events=[{at: 0.1, cut: hoist_1}]"), 250),
    "tension drives": (bundle_of("rest", "drive=tension"), 200),
    "odd rates": (bundle_of("rest", *[f"rates.{rate}" for rate in ODD]), 200),
}
MORE_RUNS = {
    "calm for longer": (bundle_of("calm"), 3000),
    "controllers at 100 Hz": (bundle_of("rest"), 250),
    "locked winches": (bundle_of("verification_mid"), 250),
    "plant at 2 kHz": (bundle_of("rest", "rates.plant=2000"), 250),
    "slow sensors": (
        bundle_of("rest", *[f"rates.{rate}" for rate in (*SLOW_SENSORS, *FAST_CONTROL)]),
        250,
    ),
    # The force controller reads references as well.
    "friction and winches fed forward, mass given": (
        Case(
            "worst_case_past_thesis",
            (
                "control.motion.governor=null",
                "control.motion.mass_adaptation={}",
                "control.force.friction_feedforward={}",
                "control.force.winch_feedforward={stretch_bandwidth: 200}",
            ),
            (("winch_coulomb_friction", (), {"torque": 0.01}),),
        ).bundle(),
        400,
    ),
    # Tensions that trip the force controllers.
    "safe state": (
        bundle_of("worst_case", "safety.tension_trip=8.2", "control.record_internals=true"),
        700,
    ),
}


def graph(bundle, folder, *arguments, **options):
    """Run in the domain of nobody else, and wait no longer than a test may."""
    return run_graph(
        bundle, folder, *arguments, **{"domain_id": new_domain(), "patience_s": 20.0} | options
    )


@pytest.mark.parametrize(
    "name", [*RUNS, *[pytest.param(name, marks=pytest.mark.slow) for name in MORE_RUNS]]
)
def test_the_recording_is_the_one_of_a_run_in_process(tmp_path, name):
    bundle, steps = (RUNS | MORE_RUNS)[name]
    kept = run(bundle, tmp_path / "inprocess", steps=steps)
    result = graph(bundle, tmp_path / "graph", steps=steps)
    assert_same(tmp_path / "inprocess", tmp_path / "graph")
    # Not only the messages: chunk for chunk the same bytes.
    assert content(tmp_path / "inprocess") == content(tmp_path / "graph")
    assert result.messages == kept.messages
    assert result.simulated == kept.simulated
    assert (result.failure, result.interrupted) == (kept.failure, False)
    assert (result.failure is not None) == (name == "safe state")
    np.testing.assert_allclose(
        result.statistics.rms_error, kept.statistics.rms_error, rtol=1e-9, atol=1e-14
    )
    with Recording(tmp_path / "graph") as recording:
        assert recording.complete
        assert recording.metadata["cspm"] == metadata(bundle, "graph")
        assert recording.attachments == bundle.attachments()


@pytest.mark.parametrize("name", ["calm", "late sensors"])
def test_where_rcl_cannot_be_called_the_recording_is_the_same(tmp_path, monkeypatch, name):
    bundle, steps = RUNS[name]
    graph(bundle, tmp_path / "rcl", steps=steps)
    monkeypatch.setattr("cspm_msgs_py.ros.intake.take_address", lambda: None)
    graph(bundle, tmp_path / "rclpy", steps=steps)
    assert content(tmp_path / "rcl") == content(tmp_path / "rclpy")


@pytest.mark.skipif(not find_spec("mujoco"), reason="the MuJoCo plant needs MuJoCo")
def test_the_mujoco_plant_in_the_graph(tmp_path):
    bundle = replace(bundle_of("calm"), plant="mujoco")
    run(bundle, tmp_path / "inprocess", steps=150)
    graph(bundle, tmp_path / "graph", steps=150)
    assert_same(tmp_path / "inprocess", tmp_path / "graph")
    run(bundle_of("calm"), tmp_path / "sim", steps=150)
    assert difference(tmp_path / "graph", tmp_path / "sim") is not None


def test_another_seed_gives_other_hashes_and_resim_knows(tmp_path):
    graph(bundle_of("calm"), tmp_path / "graph", steps=200)
    run(bundle_of("calm", "seed=2"), tmp_path / "other", steps=200)
    with pytest.raises(AssertionError):
        assert_same(tmp_path / "graph", tmp_path / "other")
    found = resimulate(tmp_path / "graph", lambda now, total: None)
    assert (found.difference, found.cut_ns) == (None, None)
    assert found.messages > 200 * 17


def test_a_divergence_ends_the_run_and_keeps_its_recording(tmp_path):
    bundle = bundle_of("rest", *WILD)
    kept = run(bundle, tmp_path / "inprocess")
    result = graph(bundle, tmp_path / "graph")
    assert result.failure is not None
    # What a graph knows of it: the plant's part.
    assert result.failure.partition(";")[0] == kept.failure.partition(";")[0]
    assert "; before it: " in result.failure
    assert "\n" not in result.failure
    assert result.simulated == kept.simulated
    assert not result.interrupted
    assert_same(tmp_path / "inprocess", tmp_path / "graph")
    with Recording(tmp_path / "graph") as recording:
        assert recording.complete


def test_a_run_lasts_as_long_as_its_scenario_and_says_how_far_it_is(tmp_path):
    reported = []
    result = graph(bundle_of("one_winch", "duration=0.6"), tmp_path / "bag", reported.append)
    assert result.simulated == pytest.approx(0.6)
    assert result.messages["/clock"] == 600
    assert reported == sorted(reported)
    assert 0.0 <= reported[-1] <= 0.6


@pytest.mark.parametrize(
    ("number", "at"), [(signal.SIGINT, 0.1), (signal.SIGTERM, 0.1), (signal.SIGINT, 0.0)]
)
def test_a_signal_ends_the_run_between_two_steps(tmp_path, number, at):
    before = [signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)]
    struck = []

    def strike(now):
        if now >= at and not struck:
            struck.append(now)
            os.kill(os.getpid(), number)

    result = graph(bundle_of("rest", "duration=60"), tmp_path / "bag", strike)
    assert result.interrupted
    assert result.failure is None
    assert struck[0] <= result.simulated < 30.0
    steps = result.messages["/clock"]
    assert result.simulated == pytest.approx(steps * 1e-3, abs=1e-9)
    with Recording(tmp_path / "bag") as recording:
        assert recording.complete
    if steps:
        run(bundle_of("rest", "duration=60"), tmp_path / "again", steps=steps)
        assert_same(tmp_path / "again", tmp_path / "bag")
    assert before == [signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)]


@pytest.mark.parametrize("stopped", [False, True])
def test_a_plant_that_is_stopped_before_its_start_never_starts(stopped):
    """It has reported the end; who then heard of a first step would wait for the next for ever."""
    with Session(domain_id=new_domain(), polled=True) as session:
        plant = LockstepRun(bundle_of("one_winch"), (PLANT,)).plant(session.node(PLANT), 10)
        if stopped:
            plant.stop()
        assert session.spin_until(lambda: not plant._others.unmatched(), 20.0)
        plant._look_around()
        assert plant.started is not stopped
        assert (plant.progress == -1) is stopped
        assert plant.finished is stopped


def test_an_existing_folder_is_left_alone(tmp_path):
    (tmp_path / "bag").mkdir()
    with pytest.raises(InputError) as caught:
        graph(bundle_of("one_winch"), tmp_path / "bag", steps=10)
    assert str(caught.value) == f"{tmp_path}/bag: already exists, allowed: a new folder"


@contextmanager
def no_file_above(size):
    """Python ignores SIGXFSZ, so that writing beyond the limit is an error like a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_full_disk_ends_the_run_with_one_line(tmp_path, monkeypatch):
    # Shared memory is made of files as well.
    monkeypatch.setenv("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4")
    bundle = bundle_of("one_winch")
    run(bundle, None, steps=10)
    with no_file_above(60_000), pytest.raises(CspmError) as caught:
        graph(bundle, tmp_path / "bag")
    assert str(caught.value) == f"{tmp_path}/bag/bag_0.mcap: recording failed (File too large)"
    with Recording(tmp_path / "bag") as recording:
        assert recording.topics["/clock"].count > 0


# Others in the same domain


@contextmanager
def strangers(domain, *makers):
    """Have nodes of others, each in a session of its own, in a domain."""
    with ExitStack() as stack:
        for i, make in enumerate(makers):
            session = Session(domain_id=domain)
            stack.callback(session.close)
            make(session.node(f"stranger_{i}").node)
        yield


def listening(ros_type, topic, **policies):
    qos = contract_qos()
    for name, policy in policies.items():
        setattr(qos, name, policy)
    return lambda node: node.create_subscription(ros_type, topic, lambda _: None, qos)


@pytest.mark.slow
def test_listeners_that_cannot_be_served_do_not_keep_a_run_from_starting(tmp_path):
    from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

    stored = {"durability": DurabilityPolicy.TRANSIENT_LOCAL}
    pose = ros_class("geometry_msgs/msg/PoseStamped")
    domain = new_domain()
    with strangers(
        domain,
        listening(String, "/bar/pose"),
        listening(pose, "/bar/pose", **stored),
        listening(pose, "/bar/pose", reliability=ReliabilityPolicy.BEST_EFFORT),
        listening(Header, END, **stored),
    ):
        graph(bundle_of("rest"), tmp_path / "graph", steps=100, domain_id=domain)
    run(bundle_of("rest"), tmp_path / "inprocess", steps=100)
    assert_same(tmp_path / "inprocess", tmp_path / "graph")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "topic"), [("plant", END), ("motion_controller", "/run/progress")]
)
def test_two_runs_in_one_domain_do_not_mix(tmp_path, monkeypatch, name, topic):
    monkeypatch.setattr(watch, "START_FACTOR", 1.0)
    domain = new_domain()
    with ExitStack() as stack:
        session = stack.enter_context(Session(domain_id=domain))
        session.node(name).node.create_publisher(Header, topic, contract_qos())
        with pytest.raises(CspmError) as caught:
            graph(bundle_of("rest"), tmp_path / "bag", domain_id=domain, patience_s=5.0)
    doubled = re.escape(f"one node {name} instead of 2 (ROS_DOMAIN_ID keeps runs apart)")
    early = rf"not all nodes joined within \S+ s: plant waits for {doubled}; "
    assert re.match(rf"{early}|plant: runs in {doubled}$", str(caught.value))
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_who_ends_another_run_does_not_end_this_one(tmp_path):
    """The ends of other runs come all the time, before the start and after it."""
    domain = new_domain()
    with Session(domain_id=domain) as session:
        node = session.node("elsewhere").node
        ends = node.create_publisher(Header, END, contract_qos())

        def end_others(_):
            for seconds in (0, 1, 3600, -1):
                message = Header(frame_id="plant")
                message.stamp.sec = seconds
                ends.publish(message)

        result = graph(
            bundle_of("calm"), tmp_path / "graph", end_others, steps=600, domain_id=domain
        )
    assert result.simulated == pytest.approx(0.6)
    run(bundle_of("calm"), tmp_path / "inprocess", steps=600)
    assert_same(tmp_path / "inprocess", tmp_path / "graph")


# The command line


@pytest.mark.slow
def test_the_command_line_runs_a_graph(tmp_path):
    folder = tmp_path / "bag"
    code, out, err = done(
        "run",
        "rest",
        "--mode",
        "graph",
        "--duration",
        "0.3",
        "--out",
        folder,
        "--json",
        tmp_path / "reported.json",
    )
    assert (code, err) == (0, "")
    assert "simulated 0.3 s at " in out
    assert (folder / "run.png").is_file()
    reported = json.loads((tmp_path / "reported.json").read_text())
    assert reported["mode"] == "graph"
    assert reported == json.loads((folder / "summary.json").read_text())
    run(bundle_of("rest", "duration=0.3"), tmp_path / "inprocess")
    assert difference(folder, tmp_path / "inprocess") is None
    assert recorded(folder)["/clock"].stamp_ns[-1] == 299_000_000


@pytest.mark.slow
def test_the_command_line_reports_a_divergence(tmp_path):
    settings = [word for override in WILD for word in ("--set", override)]
    code, _, err = done("run", "rest", "--mode", "graph", "--out", tmp_path / "bag", *settings)
    assert code == 1
    [line] = [line for line in err.splitlines() if not line.startswith("[WARN]")]
    assert said(line).startswith("diverged at t = 0.")
    with Recording(tmp_path / "bag") as recording:
        assert recording.complete
