"""A bar that is led to a pose and back in real time, over the middleware."""

import numpy as np
import pytest
from realtime_graph import PATIENCE_S, Evidence, Graph, Witness, slow_bundle, warm_processes
from ros_graph import load_ros, new_domain

load_ros()

from cspm_control.stages.wave_stage import WaveStage  # noqa: E402
from cspm_control.waves.wave_trajectory import WaveTrajectory  # noqa: E402
from cspm_model.motion import Motion  # noqa: E402
from cspm_msgs_py.message import message_of  # noqa: E402
from cspm_msgs_py.ros.contract_node import ros_class  # noqa: E402
from cspm_msgs_py.ros.session import Session  # noqa: E402
from cspm_msgs_py.ros_types import serialize  # noqa: E402
from cspm_msgs_py.schedule import FORCE_CONTROLLER, WAVE_TRAJECTORY  # noqa: E402
from cspm_msgs_py.topics import Topic  # noqa: E402
from cspm_ros.runtime.exit_watchdog import IN_ORDER  # noqa: E402
from cspm_ros.runtime.goal_port import GOAL, GoalPort, make_goals  # noqa: E402

pytestmark = [pytest.mark.slow, pytest.mark.realtime]

PLACE = np.array([0.05, -0.04, 2.05])
HOLD = "hold"
REFERENCE, TRUTH = "/bar/reference", "/truth/bar/pose"


def goal(place, frame=GOAL.frame_id):
    topic = Topic(GOAL.name, GOAL.ros_type, frame, GOAL.fields)
    return serialize(message_of(topic, 0, np.array([*place, 0.0, 0.0, 0.0, 1.0])))


def until_logged(witness, graph, text, again=lambda: None):
    """Listen until a text is in the log; what leads to it is done again until then."""
    log = graph.log(WAVE_TRAJECTORY)

    def logged():
        again()
        return text in log.read_text()

    witness.until(logged, text)


def test_the_bar_goes_to_a_goal_and_back(tmp_path):
    bundle = slow_bundle()
    reference = bundle.testbed.testbed.topics[REFERENCE]
    trigger = ros_class("std_srvs/srv/Trigger")
    with (
        Graph(warm_processes(), bundle, tmp_path) as graph,
        Witness(graph.domain, [reference]) as witness,
    ):
        graph.start(goal_duration=3.0)
        send = witness.publisher(GOAL, (WAVE_TRAJECTORY,))
        home = witness.node.node.create_client(trigger, f"/{WAVE_TRAJECTORY}/home")
        witness.until_running(FORCE_CONTROLLER)
        witness.until_connected()
        witness.until(home.service_is_ready, "the service")
        for wrong in (goal([9.0, 0.0, 2.0]), goal([0.0, 0.0, 2000.0]), goal(PLACE, "map")):
            send(wrong)
        witness.until_more(REFERENCE, 50)
        with Witness(graph.domain) as stranger:
            shout = stranger.publisher(GOAL, (WAVE_TRAJECTORY,))
            stranger.until_connected()
            # A node's name comes apart from its messages, and may come later.
            until_logged(
                witness,
                graph,
                "/bar/goal: a second publisher, of witness, allowed: that of ",
                lambda: shout(goal([0.1, 0.0, 2.1])),
            )
        send(goal(PLACE))
        witness.until_more(REFERENCE, 500)
        answer = home.call_async(trigger.Request())
        witness.until(answer.done, "an answer")
        assert answer.result().success
        witness.until_more(REFERENCE, 500)
        witness.until_running(FORCE_CONTROLLER)
        assert set(graph.end().values()) <= IN_ORDER
        said = graph.log(WAVE_TRAJECTORY).read_text()
    assert "/bar/goal: no tensions within the limits hold the bar at rest at [" in said
    assert "/bar/goal: 2e+03 m from the bar's mean position, allowed: at most 1 m" in said
    assert "/bar/goal: frame 'map', allowed: 'world_ned' (z down)" in said
    evidence = Evidence(graph.folder)
    wanted, found = evidence.rows[REFERENCE].rows[:, :3], evidence.rows[TRUTH].rows[:, :3]
    away = np.linalg.norm(wanted - PLACE, axis=1)
    assert away.min() == 0.0
    assert np.linalg.norm(found - PLACE, axis=1).min() < 0.005
    assert wanted[-1] == pytest.approx(wanted[0], abs=1e-6)
    assert found[-1] == pytest.approx(found[0], abs=0.01)


def test_no_goal_in_the_safe_state_and_another_sender_once_the_first_has_left(tmp_path):
    bundle = slow_bundle()
    reference = bundle.testbed.testbed.topics[REFERENCE]
    with (
        Graph(warm_processes(), bundle, tmp_path) as graph,
        Witness(graph.domain, [reference]) as witness,
    ):
        graph.start(goal_duration=1.0)
        witness.until_running(FORCE_CONTROLLER)
        with Witness(graph.domain) as first:
            send = first.publisher(GOAL, (WAVE_TRAJECTORY,))
            first.until_connected()
            witness.emergency_stop(True)
            witness.until_state(FORCE_CONTROLLER, HOLD)
            witness.until_more(REFERENCE, 50)
            send(goal(PLACE))
            until_logged(witness, graph, "the winches are in their safe state")
            witness.emergency_stop(False)
            witness.until_reset(FORCE_CONTROLLER)
            witness.until_running(FORCE_CONTROLLER)
        send = witness.publisher(GOAL, (WAVE_TRAJECTORY,))
        witness.until_connected()
        witness.until_more(REFERENCE, 50)
        send(goal(PLACE))
        witness.until_more(REFERENCE, 200)
        assert set(graph.end().values()) <= IN_ORDER
        said = graph.log(WAVE_TRAJECTORY).read_text()
    assert said.count("/bar/goal: ") == 1
    evidence = Evidence(graph.folder)
    wanted = evidence.rows[REFERENCE].rows[:, :3]
    assert wanted[-1] == pytest.approx(PLACE)


def test_no_goal_while_nobody_says_that_the_winches_run():
    bundle = slow_bundle()
    motion = Motion.still(np.array(bundle.scenario.bar_mean_pose))
    stage = WaveStage({REFERENCE: WaveTrajectory(motion)})
    goals = make_goals(stage, bundle.scenario, bundle.testbed.testbed, 1.0)
    stage.step(0, {}, lambda *_: None)
    trigger = ros_class("std_srvs/srv/Trigger")
    with Session(domain_id=new_domain(), polled=True) as session:
        node = session.node(WAVE_TRAJECTORY)
        GoalPort(node, goals)
        home = node.node.create_client(trigger, f"/{WAVE_TRAJECTORY}/home")
        assert session.spin_until(home.service_is_ready, PATIENCE_S)
        answer = home.call_async(trigger.Request())
        assert session.spin_until(answer.done, PATIENCE_S)
    assert not answer.result().success
    expected = "no /winches/safe for 1 s, allowed: a goal while winches are controlled"
    assert answer.result().message == expected
