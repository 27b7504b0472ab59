"""What drivers send over real ROS topics is heard, whatever their quality of service."""

from functools import partial

import numpy as np
import pytest
from driver_samples import BAR, FRAME, TENSION, WINCHES, lab_of
from ros_graph import load_ros, new_domain

load_ros()

from driver_publisher import RATE, Drivers, slowed  # noqa: E402 - ROS is there

from cspm_msgs_py.ros.session import Session  # noqa: E402
from cspm_msgs_py.schedule import TORQUE_COMMAND  # noqa: E402
from cspm_ros.check_drivers.driver_listener import DriverListener  # noqa: E402
from cspm_ros.check_drivers.driver_observation import hear  # noqa: E402

SECONDS = 1.0
SIM_START_NS = 5_000_000_000
YEAR_S = 3.2e7


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    return slowed(lab_of(tmp_path_factory.mktemp("rest") / "r", "rest", "duration=1.0"))


@pytest.fixture(autouse=True)
def short_search(monkeypatch):
    monkeypatch.setattr("cspm_ros.runtime.discovery.Discovery.LONGEST_S", 3.0)


def listened(lab, *, sim_time=False, seconds=SECONDS, **options):
    """Return observations by topic and all findings, and whether anything was there."""
    domain = new_domain()
    with Drivers(lab, domain, **options), Session(domain_id=domain) as session:
        listener = DriverListener(session, lab.testbed, sim_time=sim_time)
        there = listener.find()
        assert listener.listen(seconds)
        found = {each.topic_name: each for each in listener.observations()}
        return found, listener.findings(commanded=True, braked=True), there


def reported(findings, topic):
    return [
        (finding.check, finding.ok, finding.text) for finding in findings if finding.topic == topic
    ]


def ages(observation, topic):
    """Reception minus stamp [s]."""
    heard, _ = hear(topic, observation)
    return (heard.receive_ns - heard.stamp_ns) * 1e-9


def test_every_message_is_heard_with_its_time_of_reception(lab):
    found, findings, there = listened(lab)
    assert there
    assert set(lab.feeds) <= set(found)
    for name, feed in lab.feeds.items():
        each = found[name]
        assert (each.ros_type, each.publishers) == (feed.topic.ros_type, 1)
        heard, _ = hear(feed.topic, each)
        assert heard.fits.all()
        assert len(heard.rows) >= 0.5 * RATE * SECONDS
        assert (np.diff(heard.stamp_ns) == 1_000_000_000 // RATE).all()
        assert set(map(tuple, heard.rows)) <= set(map(tuple, feed.rows))
        assert np.abs(ages(each, feed.topic)).max() < 10.0
        assert reported(findings, name) == [
            ("qos", True, "reliable, from lab"),
            ("losses", True, "none lost on the way"),
        ]
    assert reported(findings, TORQUE_COMMAND) == [
        ("hearers", True, "heard by drive"),
        ("publishers", True, "nobody gives it now"),
    ]
    assert reported(findings, "/winches/brake") == [("hearers", True, "heard by drive")]


@pytest.mark.slow
def test_misfits_are_heard_and_reported(lab):
    lab = lab.without(FRAME).but(TENSION, lambda feed: feed.described(name="/lab/tension"))
    found, findings, there = listened(lab, best_effort=[BAR], doubled=[WINCHES], drive=False)
    assert there
    assert (TENSION in found, FRAME in found) == (False, False)
    assert (found["/lab/tension"].publishers, found["/lab/tension"].samples) == (1, [])
    text = "best effort (from lab), expected reliable: no controller hears it"
    assert reported(findings, BAR)[0] == ("qos", False, text)
    assert len(found[BAR].samples) >= 0.5 * RATE * SECONDS
    assert found[WINCHES].publishers == 2
    assert reported(findings, TORQUE_COMMAND)[0][:2] == ("hearers", False)
    assert reported(findings, "/winches/brake")[0][:2] == ("hearers", False)


def test_with_a_clock_of_its_own_a_simulation_is_heard_on_that_clock(lab):
    found, findings, _ = listened(lab, sim_time=True, sim_start_ns=SIM_START_NS)
    [(check, ok, text)] = reported(findings, "/clock")
    assert (check, ok) == ("ticks", True)
    assert text.endswith(" messages, from lab")
    for name, feed in lab.feeds.items():
        assert len(found[name].samples) >= 0.4 * RATE * SECONDS
        assert np.abs(ages(found[name], feed.topic)).max() < 10.0


@pytest.mark.slow
def test_a_clock_that_is_not_asked_for_leaves_the_wall_clock(lab):
    found, findings, _ = listened(lab, sim_start_ns=SIM_START_NS)
    [(check, ok, text)] = reported(findings, "/clock")
    assert (check, ok) == ("ticks", None)
    assert text.startswith("given by lab: ")
    assert ages(found[BAR], lab.feeds[BAR].topic).min() > YEAR_S


@pytest.mark.slow
def test_a_clock_that_is_missing_is_reported(lab):
    _, findings, _ = listened(lab, sim_time=True)
    assert [reported(findings, "/clock")[0][:2]] == [("ticks", False)]


@pytest.mark.slow
def test_where_there_is_nobody_nothing_is_heard(lab):
    found, findings, there = listened(
        lab.without(BAR).without(FRAME).without(TENSION).without(WINCHES)
    )
    assert not there
    assert not any(each.samples for each in found.values())
    assert {finding.topic for finding in findings} == {TORQUE_COMMAND, "/winches/brake"}


@pytest.mark.slow
def test_drivers_that_begin_late_and_lose_their_reliability_are_heard(lab):
    domain = new_domain()
    with Session(domain_id=domain) as session:
        listener = DriverListener(session, lab.testbed)
        for best_effort in ([], [TENSION]):
            with Drivers(lab, domain, best_effort=best_effort):
                enough = partial(more, listener, TENSION, len(samples_of(listener, TENSION)) + 5)
                assert session.spin_until(enough, 30.0)


def more(listener, name, count):
    return len(samples_of(listener, name)) > count


def samples_of(listener, name):
    return next((each.samples for each in listener.observations() if each.topic_name == name), [])
