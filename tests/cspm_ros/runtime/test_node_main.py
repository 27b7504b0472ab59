"""Nodes started one by one, as a lab starts them."""

import random
import re
import signal
from itertools import cycle

import psutil
import pytest
from cspm_process import grown
from error_lines import said
from ros_graph import (
    NODES,
    assert_same,
    ended_in_any_case,
    load_ros,
    new_domain,
    outcome,
    start_node,
)
from run_samples import SCENARIOS, bundle_of

from cspm_msgs_py.recording import Recording
from cspm_msgs_py.recording.recover import recover
from cspm_ros.runtime import node_main
from cspm_ros.runtime import stall_watchdog as watch
from cspm_ros.runtime.exit_watchdog import IN_ORDER
from cspm_ros.runtime.node_main import main
from cspm_run.recorded_run import run
from cspm_run.resim import resimulate

load_ros()

from rcl_interfaces.msg import Parameter, ParameterValue  # noqa: E402
from rcl_interfaces.srv import GetParameters, ListParameters, SetParameters  # noqa: E402

from cspm_msgs_py.ros.session import Session  # noqa: E402

pytestmark = pytest.mark.compiled

RIG = ("plant", "force_controller", "recorder")
# On a quiet machine a node takes a second to end; nobody waits for ever.
SOON_S = 60.0


def by_hand(names, *parameters, domain, seed=0, remap=()):
    """Start nodes in any order."""
    order = random.Random(seed).sample(names, len(names))
    return {name: start_node(name, *parameters, domain=domain, remap=remap) for name in order}


def assert_all_well(processes):
    for name, process in processes.items():
        code, out, err = outcome(process)
        # On a busy machine they wait for each other long enough to say so.
        errors = [line for line in err.splitlines() if not line.startswith("[WARN]")]
        assert (name, code, out, errors) == (name, 0, "", [])


def ask(session, node, service, ros_type, request):
    """Return a node's answer to a service request."""
    client = session.node("asker").node.create_client(ros_type, f"/{node}/{service}")
    assert session.spin_until(client.service_is_ready, 30.0)
    answer = client.call_async(request)
    assert session.spin_until(answer.done, 30.0)
    return answer.result()


@pytest.mark.slow
def test_nodes_by_hand_in_any_order_with_a_topic_of_another_name(tmp_path):
    """The plant comes first, shows its parameters, and runs once the others are there."""
    domain = new_domain()
    parameters = ("scenario:=one_winch", "steps:=300", f"folder:={tmp_path}/bag", "patience:=60.0")
    remap = ("/winches/torque_command:=/lab/winches/torque_command",)
    with ended_in_any_case({}) as processes, Session(domain_id=domain) as session:
        processes |= by_hand(RIG[:1], *parameters, domain=domain, remap=remap)
        names = ask(session, "plant", "list_parameters", ListParameters, ListParameters.Request())
        assert {"scenario", "steps", "patience", "plant", "nodes"} <= set(names.result.names)
        wanted = GetParameters.Request(names=["scenario", "steps", "patience", "pace"])
        values = ask(session, "plant", "get_parameters", GetParameters, wanted).values
        assert values[0].string_value == "one_winch"
        assert values[1].integer_value == 300
        assert values[2].double_value == 60.0
        assert values[3].string_value == "lockstep"
        change = Parameter(name="steps", value=ParameterValue(type=2, integer_value=5))
        request = SetParameters.Request(parameters=[change])
        [found] = ask(session, "plant", "set_parameters", SetParameters, request).results
        assert not found.successful
        topics = dict(session.node("looker").node.get_topic_names_and_types())
        assert "/lab/winches/torque_command" in topics
        assert "/winches/torque_command" not in topics
        processes |= by_hand(RIG[1:], *parameters, domain=domain, remap=remap)
        assert_all_well(processes)
    run(bundle_of("one_winch"), tmp_path / "inprocess", steps=300)
    assert_same(tmp_path / "inprocess", tmp_path / "bag")


@pytest.mark.slow
def test_a_closed_loop_by_hand_with_another_name_for_the_pose(tmp_path):
    parameters = ("scenario:=rest", "steps:=400", f"folder:={tmp_path}/bag", "overrides:=[seed=5]")
    remap = ("/bar/pose:=/lab/bar/pose",)
    domain = new_domain()
    started = by_hand(NODES, *parameters, domain=domain, seed=3, remap=remap)
    with ended_in_any_case(started) as processes:
        assert_all_well(processes)
    run(bundle_of("rest", "seed=5"), tmp_path / "inprocess", steps=400)
    assert_same(tmp_path / "inprocess", tmp_path / "bag")


@pytest.mark.slow
def test_a_run_without_a_recorder_and_one_of_some_nodes_only(tmp_path):
    """Who takes part is a parameter; the plant waits for nobody else."""
    nodes = ("plant", "force_controller")
    parameters = ("scenario:=one_winch", "steps:=200", f"nodes:=[{', '.join(nodes)}]")
    with ended_in_any_case(by_hand(nodes, *parameters, domain=new_domain())) as processes:
        assert_all_well(processes)


# What they cannot use


def reported(capfd, monkeypatch, name, *args):
    """Return exit code and stderr of a node that this process becomes for a moment."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(new_domain()))
    code = main(name, list(args))
    out, err = capfd.readouterr()
    assert out == ""
    return code, err


NO_SUCH_SCENARIO = "nothing: no such scenario, allowed: calm, "


@pytest.mark.parametrize(
    ("name", "setting", "line"),
    [
        ("plant", "scenario:=nothing", NO_SUCH_SCENARIO),
        ("recorder", "scenario:=nothing", NO_SUCH_SCENARIO),
        ("plant", "scenario:=nothing.yaml", "nothing.yaml: no such file, allowed: a scenario file"),
        (
            "motion_controller",
            "scenario:=one_winch",
            "scenario one_winch has none, allowed: plant, force_controller, recorder",
        ),
        (
            "plant",
            "nodes:=[plant, motor]",
            "nodes: motor, allowed: plant, wave_trajectory, motion_controller,"
            " tension_distribution, force_controller, recorder",
        ),
        (
            "plant",
            "steps:=abc",
            "parameter steps: of the wrong type, allowed: like 0 (end after so many plant steps; 0:"
            " the scenario's duration)",
        ),
        ("plant", "steps:=1.5", "parameter steps: of the wrong type, allowed: like 0 ("),
        ("plant", "steps:=-5", "parameter steps: -5, allowed: 0 or more"),
        ("plant", "scenario:=5", "parameter scenario: of the wrong type, allowed: like "),
        ("plant", "nodes:=[1, 2]", "parameter nodes: of the wrong type, allowed: like ['…'] ("),
        ("plant", "nodes:=plant", "parameter nodes: of the wrong type, allowed: like ['…'] ("),
        ("plant", "patience:=true", "parameter patience: of the wrong type, allowed: like 30.0 ("),
        ("plant", "patience:=0", "parameter patience: 0.0, allowed: 0.1 or more"),
        ("plant", "patience:=nan", "parameter patience: nan, allowed: 0.1 or more"),
        ("plant", "patience:=.inf", "parameter patience: inf, allowed: 0.1 or more"),
        ("plant", "pace:=slow", "parameter pace: slow, allowed: lockstep, realtime"),
        ("plant", "plant:=real", "parameter plant: real, allowed: sim, mujoco"),
        (
            "plant",
            "overrides:=[duration=soon]",
            f"{SCENARIOS}/worst_case.yaml: duration: 'soon', allowed: a number",
        ),
    ],
)
def test_an_unusable_parameter_is_one_line(capfd, monkeypatch, name, setting, line):
    code, err = reported(capfd, monkeypatch, name, "--ros-args", "-p", setting)
    assert code == 2
    assert said(err).startswith(line)
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("args", "what"),
    [
        (["-p", "steps"], "Couldn't parse parameter override rule: '-p steps'"),
        (["-r", "/bar/pose"], "Couldn't parse remap rule: '-r /bar/pose'"),
        (["--params-file", "none.yaml"], "Couldn't parse params file: '--params-file none.yaml'"),
        (["--steps", "5"], "['--steps', '5']"),
    ],
)
def test_arguments_that_ros_does_not_understand_are_one_line(capfd, monkeypatch, args, what):
    code, err = reported(capfd, monkeypatch, "plant", "--ros-args", *args)
    assert (code, said(err)) == (
        2,
        f"--ros-args: {what}, allowed: -p NAME:=VALUE, -r OLD:=NEW, --params-file FILE and"
        " what else ROS 2 takes\n",
    )


def test_a_node_that_is_none_is_one_line(capfd, monkeypatch):
    code, err = reported(capfd, monkeypatch, "motor")
    assert (code, err.partition(":")[0]) == (2, "cspm node motor")
    *nodes, recorder = NODES
    allowed = ", ".join((*nodes, "target_tracker", recorder, "player", "viewer"))
    assert said(err) == f"allowed: {allowed}\n"
    code, err = reported(capfd, monkeypatch, "plant", "-p", "steps:=5")
    assert code == 2
    assert err == (
        "cspm node plant: -p, allowed: nothing, or --ros-args and what ROS 2 takes after it\n"
    )


def test_whole_numbers_do_for_times_and_nothing_for_lists(capfd, monkeypatch):
    monkeypatch.setattr(watch, "START_FACTOR", 1.0)
    code, err = reported(
        capfd,
        monkeypatch,
        "plant",
        "--ros-args",
        "-p",
        "patience:=1",
        "-p",
        "nodes:=[]",
        "-p",
        "scenario:=one_winch",
    )
    assert code == 1
    (line,) = [line for line in err.splitlines() if not line.startswith("[WARN]")]
    assert re.match(
        r"cspm node plant: not all nodes joined within \S+ s: plant waits for force_controller,"
        r" recorder;"
        r" allowed: 1 times the longer of patience \(1 s\) and what this start cost \(\S+ s\); for"
        r" more use --patience SECONDS, for a node the parameter patience$",
        line,
    )


@pytest.mark.parametrize("name", NODES)
def test_each_explains_itself(capsys, name):
    assert main(name, ["--help"]) == 0
    found = capsys.readouterr().out
    assert found.startswith(f"usage: {name} [--ros-args -p PARAMETER:=VALUE")
    assert f"The node {name} of cspm." in found


def test_an_early_interrupt_is_no_traceback(monkeypatch, capsys):
    def interrupted(name, args, began, failed):
        raise KeyboardInterrupt

    monkeypatch.setattr(node_main, "start_node", interrupted)
    assert main("plant", []) == 130
    assert capsys.readouterr().err == ""


# Being ended


def present(session, names):
    """Return whether all nodes are there and connected as far as they can be alone."""
    node = session.node("looker").node

    def complete():
        found = {
            info.node_name
            for topic in ("/run/progress", "/run/end")
            for info in node.get_publishers_info_by_topic(topic)
        }
        return set(names) <= found

    return session.spin_until(complete, 60.0)


@pytest.mark.slow
def test_a_signal_ends_every_node_that_waits(tmp_path):
    """The plant waits for somebody who never comes; the others for it."""
    domain, waiting = new_domain(), [name for name in NODES if name != "wave_trajectory"]
    parameters = ("scenario:=rest", f"folder:={tmp_path}/bag", "patience:=1000.0")
    with (
        ended_in_any_case(by_hand(waiting, *parameters, domain=domain)) as processes,
        Session(domain_id=domain) as session,
    ):
        assert present(session, waiting)
        # The plant, once asked, ends the others.
        leaving = [*random.Random(1).sample(waiting[1:], len(waiting) - 1), "plant"]
        for name, number in zip(leaving, cycle([signal.SIGINT, signal.SIGTERM]), strict=False):
            assert processes[name].poll() is None
            processes[name].send_signal(number)
            assert_all_well({name: processes[name]})
    with Recording(tmp_path / "bag") as recording:
        assert recording.complete
        assert recording.topics["/clock"].count == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scenario", "nodes", "first", "number"),
    [
        ("rest", NODES, "plant", signal.SIGINT),
        ("one_winch", RIG, "recorder", signal.SIGTERM),
    ],
)
def test_a_signal_ends_every_node_in_a_run(tmp_path, scenario, nodes, first, number):
    parameters = (f"scenario:={scenario}", "overrides:=[duration=3600]", f"folder:={tmp_path}/bag")
    with ended_in_any_case(by_hand(nodes, *parameters, domain=new_domain())) as processes:
        grown(processes["recorder"], tmp_path / "bag", 100_000)
        for name in (first, *[name for name in reversed(nodes) if name != first]):
            # The others of a run whose plant was asked to end are ended by it.
            if first != "plant" or name == first:
                processes[name].send_signal(number)
            code, out, err = outcome(processes[name], SOON_S)
            assert (name, code in IN_ORDER, out) == (name, True, "")
            assert "Traceback" not in err
    assert not [process for process in psutil.Process().children() if process.name() == "cspm"]
    recover(tmp_path / "bag")
    assert resimulate(tmp_path / "bag", lambda now, total: None).difference is None
