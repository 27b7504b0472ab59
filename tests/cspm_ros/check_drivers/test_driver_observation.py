"""What comes under a topic's name: absent, of another type, misnamed, broken, hostile."""

from dataclasses import replace

import numpy as np
import pytest
from driver_samples import BAR, EPOCH_NS, TENSION, WINCHES, Feed, said, steady_feed, wrong
from hypothesis import given
from hypothesis import strategies as st
from run_samples import THESIS_CABLES

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.ros_types import message_class, serialize
from cspm_msgs_py.scenario import Rates
from cspm_msgs_py.schedule import RATE_OF_SENSOR
from cspm_msgs_py.wire import WireReader
from cspm_ros.check_drivers.driver_check import check_drivers
from cspm_ros.check_drivers.driver_observation import Observation, hear

JOINT_STATE, POSE = "sensor_msgs/msg/JointState", "geometry_msgs/msg/PoseStamped"


@pytest.fixture(scope="module")
def feed(thesis):
    return steady_feed(thesis.topics[TENSION], 1000, 0.3)


@pytest.fixture(scope="module")
def pose_feed(thesis):
    feed = steady_feed(thesis.topics[BAR], 100, 3.0)
    rows = np.hstack([feed.rows[:, :3] - 3.0, np.tile([0.0, 0.0, 0.0, 1.0], (300, 1))])
    return replace(feed, rows=rows)


def checked(thesis, observation, rate=1000):
    """What is found about one topic where no other is there."""
    rates = Rates(**{RATE_OF_SENSOR[observation.topic_name]: rate})
    findings = check_drivers(thesis, rates, [observation])
    return [finding for finding in findings if finding.topic == observation.topic_name]


def payloads(observation, change):
    samples = [(time, change(i, payload)) for i, (time, payload) in enumerate(observation.samples)]
    return replace(observation, samples=samples)


def joint_state(names, **parts):
    """Bytes of a JointState with parts of any length."""
    header = message_class("std_msgs/msg/Header")(
        message_class("builtin_interfaces/msg/Time")(EPOCH_NS // 1_000_000_000, 5), ""
    )
    numbers = [
        np.array(parts.get(part, ()), dtype=float) for part in ("position", "velocity", "effort")
    ]
    return serialize(message_class(JOINT_STATE)(header, list(names), *numbers))


class TestPresence:
    def test_nobody_publishes(self, thesis):
        findings = checked(thesis, Observation(TENSION, "", 0))
        assert [(f.check, f.ok, f.text) for f in findings] == [
            ("present", False, f"nobody publishes it, expected {JOINT_STATE}")
        ]

    def test_a_publisher_without_messages(self, thesis):
        findings = checked(thesis, Observation(TENSION, JOINT_STATE, 1))
        assert said(findings, TENSION, "present") == [
            (False, "a publisher, but no message; is its driver running, its QoS reliable?")
        ]
        assert len(findings) == 1

    def test_another_type_under_the_name(self, thesis, feed):
        observation = replace(feed.observation(), ros_type="std_msgs/msg/Float64MultiArray")
        findings = checked(thesis, observation)
        assert [(f.check, f.ok, f.text) for f in findings] == [
            ("type", False, f"type std_msgs/msg/Float64MultiArray, expected {JOINT_STATE}")
        ]

    def test_two_types_under_the_name(self, thesis, feed):
        both = f"{JOINT_STATE}, std_msgs/msg/Float64MultiArray"
        findings = checked(thesis, replace(feed.observation(), ros_type=both, publishers=2))
        assert wrong(findings) == {(TENSION, "type"), (TENSION, "publishers")}

    @pytest.mark.parametrize(("publishers", "expected"), [(0, set()), (1, set()), (2, {TENSION})])
    def test_two_senders_are_one_too_many(self, thesis, feed, publishers, expected):
        findings = checked(thesis, replace(feed.observation(), publishers=publishers))
        assert {topic for topic, _ in wrong(findings)} == expected
        if expected:
            assert said(findings, TENSION, "publishers") == [
                (False, "2 publishers, expected 1: their messages mix")
            ]

    def test_a_silent_machine_lacks_all_its_sensors(self, thesis):
        findings = check_drivers(thesis, Rates(), [])
        assert wrong(findings) == {(name, "present") for name in thesis.sensors}

    def test_a_topic_of_the_wanted_type_elsewhere_is_named(self, thesis):
        elsewhere = Observation("/qualisys/bar", POSE, 1)
        findings = check_drivers(thesis, Rates(), [elsewhere])
        [(_, text)] = said(findings, BAR, "present")
        assert text.endswith("; of that type there is /qualisys/bar: remap it?")
        [(_, text)] = said(findings, TENSION, "present")
        assert "remap" not in text

    def test_only_measured_topics_are_judged(self, thesis):
        wrench = Observation("/wrench_command", "", 0)
        assert check_drivers(thesis, Rates(), [wrench]) == check_drivers(thesis, Rates(), [])


class TestMessages:
    def test_healthy_ones_are_said_to_be(self, thesis, feed):
        findings = checked(thesis, feed.observation())
        assert said(findings, TENSION, "message") == [
            (True, f"300 of {JOINT_STATE}, names as in the test-bed")
        ]

    def test_names_in_another_order_are_put_right(self, thesis, feed):
        turned = feed.described(joint_names=THESIS_CABLES[::-1])
        turned = replace(turned, rows=np.ascontiguousarray(feed.rows[:, ::-1]))
        topic = thesis.topics[TENSION]
        heard, findings = hear(topic, turned.observation())
        np.testing.assert_array_equal(heard.values, feed.rows)
        found, wanted = " ".join(THESIS_CABLES[::-1]), " ".join(THESIS_CABLES)
        assert said(findings, TENSION, "names") == [
            (False, f"all messages: order {found}, expected {wanted}")
        ]

    def test_other_names_are_listed_and_their_numbers_left(self, thesis, feed):
        names = ("winch_9", *THESIS_CABLES[1:])
        heard, findings = hear(
            thesis.topics[TENSION], feed.described(joint_names=names).observation()
        )
        assert len(heard.stamp_ns) == 300
        assert len(heard.values) == 0
        [(ok, text)] = said(findings, TENSION, "names")
        assert ok is False
        assert text.startswith("all messages: names winch_9 hoist_2 surge_1")

    def test_an_empty_part_is_reported_and_the_others_are_read(self, thesis):
        topic = thesis.topics[WINCHES]
        payload = joint_state(THESIS_CABLES, position=range(8), velocity=range(8))
        samples = [(EPOCH_NS + i, payload) for i in range(5)]
        heard, findings = hear(topic, Observation(WINCHES, JOINT_STATE, 1, samples))
        assert said(findings, WINCHES, "parts") == [
            (False, "all messages: effort is empty, expected one number per name")
        ]
        assert heard.part("effort") is None
        np.testing.assert_array_equal(heard.part("velocity"), np.tile(np.arange(8.0), (5, 1)))

    def test_parts_beyond_the_contracts_are_not_looked_at(self, thesis):
        topic = thesis.topics[TENSION]
        payload = joint_state(THESIS_CABLES, position=np.zeros(8), effort=range(8))
        observation = Observation(TENSION, JOINT_STATE, 1, [(EPOCH_NS, payload)] * 3)
        heard, findings = hear(topic, observation)
        assert wrong(findings) == set()
        np.testing.assert_array_equal(heard.values[0], np.arange(8.0))
        np.testing.assert_array_equal(WireReader(topic).decode(payload)[1], np.arange(8.0))

    def test_too_few_numbers_are_counted(self, thesis, feed):
        short = joint_state(THESIS_CABLES, effort=range(7))
        observation = payloads(feed.observation(), lambda i, p: short if i % 10 == 0 else p)
        assert said(checked(thesis, observation), TENSION, "message") == [
            (
                False,
                "30 of 300 messages: effort has 7 values for 8 names, allowed: one each",
            )
        ]

    @pytest.mark.parametrize(
        ("frame", "hint"), [("world", "; z must point down"), ("map_ned", ""), ("", "; z must")]
    )
    def test_another_frame_is_reported_and_read(self, thesis, pose_feed, frame, hint):
        observation = pose_feed.described(frame_id=frame).observation()
        heard, findings = hear(thesis.topics[BAR], observation)
        np.testing.assert_array_equal(heard.values, pose_feed.rows)
        [(ok, text)] = said(findings, BAR, "frame")
        assert ok is False
        assert text.startswith(f"all messages: frame {frame!r}, expected 'world_ned'{hint}")
        assert text.endswith("'world_ned'") or hint

    def test_a_joint_states_frame_has_no_meaning(self, thesis, feed):
        observation = feed.described(frame_id="base_link").observation()
        assert wrong(checked(thesis, observation)) == set()

    def test_bytes_that_some_serialisers_append_do_no_harm(self, thesis, feed):
        observation = payloads(feed.observation(), lambda _, p: p + b"\0" * 8)
        assert wrong(checked(thesis, observation)) == set()

    def test_what_the_nodes_alone_refuse_is_reported(self, thesis, feed):
        seconds = (EPOCH_NS // 10**9).to_bytes(4, "little")
        place = feed.observation().samples[0][1].index(seconds) + 4

        def impossible(_, payload):
            return payload[:place] + b"\xff\xff\xff\x7f" + payload[place + 4 :]

        [*_, (ok, text)] = said(
            checked(thesis, payloads(feed.observation(), impossible)), TENSION, "message"
        )
        assert ok is False
        assert text.startswith("300 of 300 messages would be refused: stamp of 1795000000 s and")


class TestHostileBytes:
    def test_garbage_is_counted(self, thesis, feed):
        observation = payloads(feed.observation(), lambda i, p: b"\x00\x01" if i == 4 else p)
        [(ok, text)] = said(checked(thesis, observation), TENSION, "message")
        assert ok is False
        assert text.startswith(f"1 of 300 messages: 2 bytes that are no {JOINT_STATE}")

    def test_ten_thousand_names_make_a_short_line(self, thesis):
        payload = joint_state([f"n{i}" * 40 for i in range(10_000)], effort=np.zeros(10_000))
        observation = Observation(TENSION, JOINT_STATE, 1, [(EPOCH_NS, payload)] * 3)
        [(ok, text)] = said(checked(thesis, observation), TENSION, "names")
        assert ok is False
        assert "… (10000 in all), expected hoist_1" in text
        assert len(text) < 1000

    def test_many_different_faults_make_few_lines(self, thesis, feed):
        cut = payloads(feed.observation(), lambda i, p: p[: 4 + i % 30])
        found = [f for f in checked(thesis, cut) if f.check == "message"]
        assert len(found) == 6
        assert found[-1].text.startswith("25 other problems in ")

    @given(data=st.data())
    def test_no_bytes_break_the_check(self, thesis, feed, data):
        healthy = [payload for _, payload in feed.only(slice(0, 6)).observation().samples]
        broken = []
        for payload in healthy:
            content = bytearray(payload)
            for _ in range(data.draw(st.integers(0, 4))):
                content[data.draw(st.integers(0, len(content) - 1))] = data.draw(
                    st.integers(0, 255)
                )
            broken.append(bytes(content[: data.draw(st.integers(0, len(content)))]))
        times = [EPOCH_NS + data.draw(st.integers(-(10**9), 10**9)) for _ in broken]
        samples = list(zip(times, broken, strict=True))
        observation = Observation(TENSION, JOINT_STATE, 1, samples)
        findings = check_drivers(thesis, Rates(), [observation])
        refused = 0
        reader = WireReader(thesis.topics[TENSION])
        for payload in broken:
            try:
                reader.decode(payload)
            except InputError:
                refused += 1
        explaining = {"message", "names", "parts", "finite"}
        reported = {check for topic, check in wrong(findings) if topic == TENSION} & explaining
        assert bool(reported) >= bool(refused)


def test_numbers_beyond_all_reason_end_the_judging_of_numbers(thesis, feed):
    huge = feed.scaled(1e300)
    findings = checked(thesis, huge.observation())
    [(ok, text)] = said(findings, TENSION, "finite")
    assert ok is False
    assert text.endswith("NaN, infinite or beyond 1e+12 in 300 of 300 messages")
    assert not said(findings, TENSION, "units")


def test_messages_are_taken_in_the_order_of_reception(thesis, feed):
    turned = Feed(feed.topic, feed.stamps[::-1], feed.receives[::-1], feed.rows[::-1])
    heard, _ = hear(thesis.topics[TENSION], turned.observation())
    np.testing.assert_array_equal(heard.stamp_ns, feed.stamps)
