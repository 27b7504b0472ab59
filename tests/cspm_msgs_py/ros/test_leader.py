"""Who starts and ends a run in real time, over the real middleware."""

import pytest
from ros_graph import load_ros, new_domain

load_ros()

from cspm_msgs_py.ros.contract_node import ros_class  # noqa: E402 - after ROS is known
from cspm_msgs_py.ros.leader import Leader  # noqa: E402 - after ROS is known to be there
from cspm_msgs_py.ros.rendezvous import FollowerSide  # noqa: E402
from cspm_msgs_py.ros.session import Session  # noqa: E402
from cspm_msgs_py.topics import contract_topics  # noqa: E402

PERIOD = 5_000_000
SECOND = 1_000_000_000
PATIENCE_S = 20.0
TENSION = contract_topics(["a"], has_bar=False, has_winch_frame=False)["/cables/tension"]


@pytest.fixture(scope="module")
def domain():
    return new_domain()


class Follower:
    """A node of a run that notes what it is given."""

    def __init__(self, session, name):
        self.node, self.started, self.ended = session.node(name), [], []
        self.ready = True
        self.side = FollowerSide(
            self.node, PERIOD, self.ended.append, self.started.append, lambda: self.ready
        )


class Run:
    """A leader named `plant`, and followers."""

    def __init__(self, session, others, duration_ns=SECOND // 5, **arguments):
        self.session = session
        self.node = session.node("plant")
        self.started, self.ended = [], []
        self.leader = Leader(
            self.node,
            PERIOD,
            others,
            duration_ns,
            on_start=self.started.append,
            on_end=self.ended.append,
            **arguments,
        )

    def until(self, condition):
        assert self.session.spin_until(condition, PATIENCE_S), self.leader.waiting()


def test_it_waits_for_every_node_by_name_and_reports_start_and_end(domain):
    with Session(domain_id=domain) as session:
        run = Run(session, ["recorder", "force_controller"])
        assert run.leader.waiting() == ["force_controller", "recorder"]
        first = Follower(session, "recorder")
        run.until(lambda: run.leader.waiting() == ["force_controller"])
        assert run.leader.start_ns is None
        second = Follower(session, "force_controller")
        run.until(lambda: run.leader.start_ns is not None)
        start = run.leader.start_ns
        # All learn of it in time.
        assert start > run.node.now_ns() - SECOND
        run.until(lambda: first.started and second.started)
        assert run.started == first.started == second.started == [start]
        run.until(lambda: first.side.end_ns is not None and second.side.end_ns is not None)
        end = run.leader.end_ns
        assert run.ended == [end]
        assert first.side.end_ns == second.side.end_ns == end
        assert end >= start + SECOND // 5
        run.leader.end()
        assert run.ended == [end]


def test_it_waits_for_what_else_is_missing_and_says_what(domain):
    missing = ["/cables/tension", "/bar/pose"]
    with Session(domain_id=domain) as session:
        run = Run(session, ["recorder"], missing=lambda: list(missing))
        assert run.leader.waiting() == ["recorder", *missing]
        Follower(session, "recorder")
        run.until(lambda: run.leader.waiting() == missing)
        missing.clear()
        run.until(lambda: run.leader.start_ns is not None)


def test_it_waits_for_a_node_that_drivers_are_not_connected_to(domain):
    missing = ["/cables/tension"]
    with Session(domain_id=domain) as session:
        run = Run(session, ["force_controller"], missing=lambda: list(missing))
        follower = Follower(session, "force_controller")
        follower.ready = False
        # What nobody sends says it all.
        run.until(lambda: run.leader.waiting() == missing)
        missing.clear()
        run.until(lambda: run.leader.waiting() == ["drivers to reach force_controller"])
        assert not session.spin_until(lambda: run.leader.start_ns is not None, 0.3)
        follower.ready = True
        run.until(lambda: run.leader.start_ns is not None)


def test_it_waits_until_its_own_readers_are_connected(domain):
    with Session(domain_id=domain) as session:
        run = Run(session, ["recorder"])
        run.node.publisher(TENSION, ["recorder"])
        follower = Follower(session, "recorder")
        run.until(lambda: run.leader.waiting() == ["/cables/tension (recorder)"])
        follower.node.subscribe(TENSION, lambda _: None)
        run.until(lambda: run.leader.start_ns is not None)


def test_a_follower_that_left_before_the_start_is_missed_again(domain):
    waits = ["something else"]
    with Session(domain_id=domain) as session:
        run = Run(session, ["recorder"], missing=lambda: list(waits))
        with Session(domain_id=domain) as other:
            Follower(other, "recorder")
            # Two executors of one thread take turns.
            run.until(
                lambda: other.spin_until(lambda: False, 0.02) or run.leader.waiting() == waits
            )
        run.until(lambda: run.leader.waiting() != waits)
        assert run.leader.waiting()[0].endswith("(recorder)")
        waits.clear()
        assert not session.spin_until(lambda: run.leader.start_ns is not None, 0.3)


def test_it_can_be_ended_before_its_time(domain):
    with Session(domain_id=domain) as session:
        run = Run(session, ["recorder"], duration_ns=3600 * SECOND)
        follower = Follower(session, "recorder")
        run.until(lambda: follower.started)
        assert follower.side.end_ns is None
        run.leader.end()
        run.until(lambda: follower.side.end_ns is not None)
        assert follower.side.end_ns == run.leader.end_ns < run.leader.start_ns + SECOND * 60


def asked(session, client):
    """Call a Trigger; return success and message."""
    answer = client.call_async(ros_class("std_srvs/srv/Trigger").Request())
    assert session.spin_until(answer.done, PATIENCE_S)
    return answer.result().success, answer.result().message


def test_others_start_and_stop_it(domain):
    trigger = ros_class("std_srvs/srv/Trigger")
    with Session(domain_id=domain) as session:
        run = Run(session, ["recorder"], duration_ns=1000 * SECOND)
        run.leader.wait_for_call()
        caller = session.node("panel").node
        start, stop = (
            caller.create_client(trigger, f"/plant/{name}") for name in ("start", "stop")
        )
        assert session.spin_until(
            lambda: start.service_is_ready() and stop.service_is_ready(), PATIENCE_S
        )
        follower = Follower(session, "recorder")
        run.until(lambda: run.leader.waiting() == ["a call of /plant/start"])
        assert asked(session, stop) == (False, "not begun: waits for a call of /plant/start")
        assert asked(session, start) == (True, "running")
        run.until(lambda: run.leader.start_ns is not None and run.leader.elapsed > 0.0)
        success, message = asked(session, stop)
        assert success
        assert message == f"ended after {run.leader.elapsed:.3f} s"
        run.until(lambda: follower.side.end_ns == run.leader.end_ns)


def test_a_start_before_all_are_there_says_who_is_missing(domain):
    trigger = ros_class("std_srvs/srv/Trigger")
    with Session(domain_id=domain) as session:
        run = Run(session, ["recorder"])
        run.leader.wait_for_call()
        start = session.node("panel").node.create_client(trigger, "/plant/start")
        assert session.spin_until(start.service_is_ready, PATIENCE_S)
        assert asked(session, start) == (False, "waits for recorder")
        Follower(session, "recorder")
        run.until(lambda: run.leader.start_ns is not None)
