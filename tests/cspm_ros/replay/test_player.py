"""Playing against the time, what is chosen of a bag, and what comes back held against it."""

import os
import pty
import termios
from collections import Counter
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from bag_samples import CONTRACT, FLAG, TYPES, sample_messages, write_mcap
from hypothesis import given
from hypothesis import strategies as st
from run_samples import bundle_of

from cspm.commands.replay_command import obey, state_of
from cspm_msgs_py.bag import BagMessage, open_bag
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.message import message_of
from cspm_msgs_py.ros_types import serialize
from cspm_msgs_py.schedule import schedule_of
from cspm_ros.replay.bag_selection import Selection, check_clock, is_topic_name
from cspm_ros.replay.player import (
    MOST_AT_ONCE,
    UNLIMITED,
    Instant,
    Player,
    check_rate,
    instants,
    neighbour_rate,
)
from cspm_ros.replay.recorded_steps import recorded_steps
from cspm_ros.replay.reproduction import Reproduction
from cspm_ros.replay.terminal_keys import RIGHT, TerminalKeys, split_keys
from cspm_ros.runtime.discovery import Discovery
from cspm_run.recorded_run import run

SECOND = 1_000_000_000
FAR = 2**62


def played_by(logs, rate=1.0, **options):
    """A player of instants at these log times, already begun at 0 s, and what it plays."""
    played = []
    found = iter([Instant(log, [BagMessage(log, "/a", b"")]) for log in logs])
    player = Player(found, lambda instant: played.append(instant.log_ns), logs[0], rate, **options)
    player.begin(0.0)
    return player, played


def refused(call, *arguments, **options):
    with pytest.raises(InputError) as caught:
        call(*arguments, **options)
    return str(caught.value)


@given(st.lists(st.tuples(st.integers(0, 5), st.sampled_from("abc")), max_size=40))
def test_instants_hold_messages_of_one_log_time_in_the_bags_order(entries):
    entries = sorted(entries, key=lambda entry: entry[0])
    messages = [BagMessage(log, topic, bytes([i])) for i, (log, topic) in enumerate(entries)]
    found = list(instants(messages, 3))
    assert [m for instant in found for m in instant.messages] == [
        message for message in messages if message.log_ns <= 3
    ]
    assert [instant.log_ns for instant in found] == sorted(
        {m.log_ns for m in messages} & {*range(4)}
    )


@given(
    gaps=st.lists(st.integers(1, 3 * SECOND), min_size=1, max_size=20),
    rate=st.sampled_from([0.01, 0.5, 1.0, 3.0, 100.0]),
    looks=st.lists(st.floats(0.0, 4.0), max_size=20),
)
def test_at_every_look_exactly_what_is_due_is_played(gaps, rate, looks):
    logs = np.cumsum([1_700_000_000 * SECOND, *gaps]).tolist()
    player, played = played_by(logs, rate)
    now = 0.0
    for pause in looks:
        now += pause
        before = len(played)
        player.advance(now)
        due = [log for log in logs if log <= logs[0] + int(now * rate * 1e9)]
        assert played == due[: before + MOST_AT_ONCE]
        assert player.finished == (played == logs)
        assert player.messages == len(played)
        assert player.position_ns == (played or logs)[-1 if played else 0]


def test_nothing_is_played_before_time_runs_or_while_paused():
    played = []
    found = iter([Instant(0, []), Instant(SECOND, [])])
    player = Player(found, lambda instant: played.append(instant.log_ns), 0, 1.0, paused=True)
    player.advance(100.0)
    player.resume(100.0)
    player.advance(100.0)
    assert played == []
    player.begin(100.0)
    player.advance(100.0)
    assert played == [0]
    player.pause(100.25)
    player.advance(200.0)
    assert played == [0]
    player.resume(200.0)
    player.advance(200.74)
    assert played == [0]
    player.advance(200.751)
    assert played == [0, SECOND]
    assert (player.finished, player.ended_early) == (True, False)


def test_a_second_pause_or_resume_changes_nothing():
    player, played = played_by([0, SECOND])
    player.advance(0.5)
    player.resume(0.6)
    player.pause(0.75)
    player.pause(5.0)
    player.resume(10.0)
    player.resume(10.2)
    player.advance(10.24)
    assert played == [0]
    player.advance(10.26)
    assert played == [0, SECOND]


def test_a_step_pauses_and_plays_one_instant():
    player, played = played_by([0, SECOND, 2 * SECOND, 9 * SECOND])
    player.advance(0.0)
    assert player.step(0.1)
    assert (played, player.paused) == ([0, SECOND], True)
    player.advance(50.0)
    assert player.step(50.0)
    assert played == [0, SECOND, 2 * SECOND]
    player.resume(60.0)
    # Time goes on from the instant that was stepped to.
    player.advance(66.9)
    assert played == [0, SECOND, 2 * SECOND]
    player.advance(67.1)
    assert player.finished
    assert not player.step(68.0)


def test_the_rate_changes_without_a_jump():
    player, played = played_by([0, SECOND, 2 * SECOND])
    player.advance(0.0)
    player.set_rate(0.1, 0.5)
    player.advance(5.49)
    assert played == [0]
    player.advance(5.51)
    assert played == [0, SECOND]
    player.set_rate(UNLIMITED, 5.6)
    player.advance(5.6)
    assert player.finished


def test_leaving_the_unlimited_rate_goes_on_from_what_was_played():
    logs = [i * SECOND for i in range(3 * MOST_AT_ONCE)]
    player, played = played_by(logs, UNLIMITED)
    player.advance(0.0)
    assert played == logs[:MOST_AT_ONCE]
    player.set_rate(1.0, 7.0)
    player.advance(7.9)
    assert played == logs[:MOST_AT_ONCE]
    player.advance(8.1)
    assert played == logs[: MOST_AT_ONCE + 1]


def test_held_up_time_is_not_made_up_for_after_a_pause():
    ready = [False]
    player, played = played_by([0, SECOND, 9 * SECOND], ready=lambda: ready[0])
    player.advance(30.0)
    assert (played, player.blocked) == ([], True)
    player.pause(30.0)
    player.resume(30.0)
    ready[0] = True
    player.advance(30.5)
    assert (played, player.blocked) == ([0], False)


def test_steps_wait_until_readers_are_ready():
    ready = [False]
    player, played = played_by([0, 1, 2], ready=lambda: ready[0])
    assert player.step(0.0)
    assert player.step(0.0)
    assert (played, player.blocked) == ([], True)
    ready[0] = True
    player.advance(0.0)
    player.advance(9.0)
    assert played == [0, 1]


def test_an_ended_player_plays_no_more():
    player, played = played_by([0, SECOND])
    player.advance(0.0)
    player.end()
    player.advance(9.0)
    assert (played, player.finished, player.ended_early) == ([0], True, True)


def test_the_keys_steer():
    player, played = played_by([0, 1, 2, 3])
    for key, state in [
        ("x", "× 1"),
        ("+", "× 2"),
        ("-", "× 1"),
        ("−", "× 0.5"),
        (" ", "paused"),
        ("s", "paused"),
        (RIGHT, "paused"),
        (" ", "× 0.5"),
    ]:
        obey(key, player, 0.0)
        assert state_of(player) == state
    assert played == [0, 1]
    player.set_rate(UNLIMITED, 0.0)
    assert state_of(player) == "as fast as possible"
    obey("q", player, 0.0)
    assert player.ended_early


def test_rates_are_neighbours_within_bounds():
    rates = [0.001]
    while (faster := neighbour_rate(rates[-1], faster=True)) != rates[-1]:
        rates.append(faster)
    assert rates[-1] == 1000.0
    assert {0.5, 1.0, 2.0} < set(rates)
    assert rates == sorted(rates)
    for slow, fast in pairwise(rates):
        assert 2.0 <= fast / slow <= 2.5 + 1e-12
        assert neighbour_rate(fast, faster=False) == slow
    assert neighbour_rate(0.001, faster=False) == 0.001
    assert (neighbour_rate(0.7, faster=True), neighbour_rate(0.7, faster=False)) == (1.0, 0.5)
    assert (neighbour_rate(0.0, faster=True), neighbour_rate(0.0, faster=False)) == (0.0, 1.0)


@pytest.mark.parametrize("rate", [0.0, 0.001, 1.0, 1000.0])
def test_a_rate_within_bounds_is_taken(rate):
    assert check_rate(rate) == rate


@pytest.mark.parametrize("rate", [-1.0, 1e-4, 1001.0, float("nan"), float("inf")])
def test_a_rate_outside_bounds_is_refused(rate):
    text = f"rate {rate:g}: allowed: 0.001 to 1000, or 0 with nodes in step"
    assert refused(check_rate, rate) == text


@pytest.mark.parametrize(
    ("name", "possible"),
    [
        ("/bar/pose", True),
        ("/_a1", True),
        ("bar", False),
        ("/bar/", False),
        ("//bar", False),
        ("/1bar", False),
        ("/größe", False),
        ("/a-b", False),
        ("", False),
        ("/" + "a" * 246, True),
        ("/" + "a" * 247, False),
    ],
)
def test_names_that_a_topic_can_have(name, possible):
    assert is_topic_name(name) is possible


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    path = write_mcap(tmp_path_factory.mktemp("bag") / "bag.mcap", sample_messages(400))
    with open_bag(path) as opened:
        yield opened


def test_everything_is_chosen_by_default(bag):
    assert Selection().names(bag) == {name: name for name in TYPES}
    assert Selection().unplayable(bag) == {}
    assert Selection().span_ns(bag) == (bag.start_ns, bag.end_ns)


def test_chosen_topics_bring_the_clock(bag):
    assert list(Selection(["/bar/pose"]).names(bag)) == ["/clock", "/bar/pose"]
    left = Selection(left_out=["/bar/pose", "/clock"]).names(bag)
    assert set(left) == set(TYPES) - {"/bar/pose", "/clock"}


def test_topics_change_names(bag):
    swapped = {"/bar/pose": "/winches/state", "/winches/state": "/bar/pose", FLAG: "/flag"}
    names = Selection(remap=swapped).names(bag)
    assert names == {name: swapped.get(name, name) for name in TYPES}


def test_a_span_of_time_is_chosen(bag):
    start = bag.start_ns + 20_000_000
    assert Selection(start_s=0.02).span_ns(bag) == (start, bag.end_ns)
    # So many seconds hold as many periods: the instant that ends them is the next one's.
    assert Selection(start_s=0.02, duration_s=0.01).span_ns(bag) == (start, start + 9_999_999)
    assert Selection(duration_s=1e6).span_ns(bag) == (bag.start_ns, bag.end_ns)


def test_what_the_bag_does_not_have_is_refused(bag):
    has = f"it has: {', '.join(TYPES)}"
    for selection in (
        Selection(["/nope"]),
        Selection(left_out=["/nope"]),
        Selection(remap={"/nope": "/a"}),
    ):
        assert refused(selection.names, bag) == f"{bag.path}: no topic /nope, {has}"
    both = Selection(["/bar/pose"], ["/clock"])
    assert refused(both.names, bag).startswith("topics: chosen as well as left out, allowed: one")
    reported = refused(Selection(remap={"/bar/pose": "a b"}).names, bag)
    assert reported == "/bar/pose: renamed to 'a b', allowed: a name like /bar/pose"
    reported = refused(Selection(remap={"/bar/pose": "/clock"}).names, bag)
    assert reported == "/clock, /bar/pose: all named /clock, allowed: one topic of a name"
    length = (bag.end_ns - bag.start_ns) * 1e-9
    for start in (-1.0, length + 1.0, float("nan")):
        reported = refused(Selection(start_s=start).span_ns, bag)
        assert reported == f"start {start:g} s: allowed: 0 to {length:g} s, {bag.path}"
    for duration in (0.0, -1.0, float("nan")):
        reported = refused(Selection(duration_s=duration).span_ns, bag)
        assert reported == f"duration {duration:g} s: allowed: more than 0 s"


def test_a_topic_that_cannot_be_played_is_reported_or_refused(tmp_path):
    def schema(kind):
        return ("ros2msg", "int32 other") if kind == TYPES[FLAG] else ("ros2msg", "")

    path = write_mcap(tmp_path / "bag.mcap", sample_messages(40), schema=schema)
    with open_bag(path) as bag:
        assert FLAG in bag.unplayable
        assert Selection().unplayable(bag) == bag.unplayable
        assert FLAG not in Selection(left_out=[FLAG]).unplayable(bag)
        reported = refused(Selection([FLAG]).names, bag)
        assert reported == f"{path}: {FLAG}: {bag.unplayable[FLAG]}"


def test_log_times_must_fit_a_clock():
    class Bag:
        path, end_ns = Path("bag"), 2**31 * SECOND - 1

    check_clock(Bag)
    Bag.end_ns += 1
    assert refused(check_clock, Bag) == (
        f"bag: log times up to {Bag.end_ns} ns, allowed for /clock: up to 2147483647 s"
    )


def test_discovery_waits_for_all_readers_and_for_calm():
    discovery = Discovery()
    assert not discovery.complete([(0, 0)], 10.0)
    assert not discovery.complete([(0, 0)], 10.4)
    assert not discovery.complete([(1, 0)], 10.6)
    assert not discovery.complete([(1, 0)], 12.0)
    assert not discovery.complete([(1, 1)], 12.1)
    assert not discovery.complete([(1, 1)], 12.5)
    assert discovery.complete([(1, 1)], 12.7)
    assert not Discovery().complete([], 3.0)


def test_discovery_does_not_wait_for_ever():
    discovery = Discovery()
    assert not discovery.complete([(2, 1)], 0.0)
    assert not discovery.complete([(2, 1)], 4.9)
    assert discovery.complete([(2, 1)], 5.0)


def test_keys_are_split():
    assert list(split_keys("s \x1b[C+\x1bOCq")) == ["s", " ", RIGHT, "+", RIGHT, "q"]
    assert list(split_keys("a\x1b[Aq")) == ["a"]
    assert list(split_keys("")) == []


def test_keys_are_read_without_a_line_and_the_terminal_is_restored():
    ours, terminal = pty.openpty()
    try:
        keys = TerminalKeys(terminal)
        # Reading a terminal that is not this process's own would stop the process.
        assert not keys.usable
        keys.usable = True
        before = termios.tcgetattr(terminal)
        with keys:
            assert keys.read() == []
            os.write(ours, b" s")
            assert keys.read() == [" ", "s"]
            assert termios.tcgetattr(terminal) != before
        assert termios.tcgetattr(terminal) == before
        assert keys.read() == []
    finally:
        os.close(ours)
        os.close(terminal)


def test_no_terminal_gives_no_keys():
    reading, writing = os.pipe()
    os.write(writing, b"q")
    with TerminalKeys(reading) as keys:
        assert (keys.usable, keys.read()) == (False, [])
    os.close(reading)
    os.close(writing)


TENSION = CONTRACT["/cables/tension"]


def test_equal_messages_are_identical():
    compared = Reproduction(TENSION)
    for i in range(3):
        compared.expect(i, np.array([i, np.nan]))
        compared.take(i, np.array([i, np.nan]))
    assert (compared.compared, compared.different, compared.identical) == (3, 0, True)
    assert str(compared) == "/cables/tension: 3 messages, identical bit for bit"


def test_the_first_and_the_largest_difference_are_reported():
    compared = Reproduction(TENSION)
    for i, row in enumerate([(1.0, 0.0), (1.0, -0.0), (1.5, 0.0), (1.25, 0.0)]):
        compared.expect(i * 1_000_000, np.array([1.0, 0.0]))
        compared.take(i * 1_000_000, np.array(row))
    assert (compared.compared, compared.different, compared.identical) == (4, 3, False)
    first = compared.first
    assert (first.index, first.stamp_ns, first.field) == (1, 1_000_000, "effort/surge_1")
    assert compared.largest == (0.5, "effort/hoist_1")
    assert str(compared) == (
        "/cables/tension: 3 of 4 messages differ, by at most 0.5 (effort/hoist_1); first:"
        " /cables/tension message 1 at 0.001000000 s: effort/surge_1 0.0 against -0.0"
    )


def test_stamps_are_compared_and_what_was_not_recorded_is_refused():
    compared = Reproduction(TENSION)
    compared.expect(1, np.zeros(2))
    compared.take(2, np.zeros(2))
    assert compared.first.field == "stamp"
    assert str(compared).startswith("/cables/tension: 1 of 1 messages differ; first: ")
    reported = refused(compared.take, 3_000_000, np.zeros(2))
    assert reported == "/cables/tension: a message of 0.003000 s, allowed: those recorded"


@pytest.fixture(scope="module")
def lockstep(tmp_path_factory):
    """Schedule, topics and instants of a short run with several rates."""
    bundle = bundle_of("calm", "rates.motion_controller=100", "rates.tension_distribution=500")
    folder = tmp_path_factory.mktemp("run") / "bag"
    run(bundle, folder, steps=40)
    testbed = bundle.testbed.testbed
    with open_bag(folder) as bag:
        found = list(instants(bag.messages(), FAR))
    return schedule_of(bundle.scenario, testbed), testbed.topics, found


def steps_of(lockstep, found):
    schedule, topics, _ = lockstep
    return list(recorded_steps(found, schedule, topics, "bag"))


def without(found, step, topic):
    return [
        instant._replace(messages=[m for m in instant.messages if m.topic != topic])
        if i == step
        else instant
        for i, instant in enumerate(found)
    ]


def test_a_recorded_run_is_its_steps(lockstep):
    found = lockstep[2]
    assert steps_of(lockstep, found) == found
    assert len(found) == 40
    counts = Counter(message.topic for instant in found for message in instant.messages)
    assert (counts["/clock"], counts["/wrench_command"], counts["/tension_command"]) == (40, 4, 20)


def test_a_last_instant_that_was_cut_is_left_out(lockstep):
    found = lockstep[2]
    assert steps_of(lockstep, without(found, 39, "/clock")) == found[:39]
    # Where a topic is not due, it is not missing.
    same = without(found, 39, "/wrench_command")
    assert steps_of(lockstep, same) == same


def test_messages_that_are_missing_inside_are_refused(lockstep):
    for topic in ("/clock", "/wrench_command", "/bar/pose"):
        reported = refused(steps_of, lockstep, without(lockstep[2], 20, topic))
        assert reported == (
            f"bag: no {topic} at 0.020000 s, allowed: all that the scenario's rates require"
        )


def test_a_recording_that_is_not_in_lockstep_is_refused(lockstep):
    late = [instant._replace(log_ns=instant.log_ns + 7) for instant in lockstep[2]]
    assert refused(steps_of, lockstep, late) == (
        "bag: messages logged at 7 ns, allowed: one instant every 1000000 ns, as a run in lockstep"
        " leaves them"
    )
    twice = [i._replace(messages=[*i.messages, *i.messages]) for i in lockstep[2]]
    assert "came already" in refused(steps_of, lockstep, twice)
    topic = lockstep[1]["/bar/pose"]
    wild = serialize(message_of(topic, 0, np.zeros(7)))
    wrong = [i._replace(messages=[BagMessage(0, "/bar/pose", wild)]) for i in lockstep[2]]
    assert refused(steps_of, lockstep, wrong).startswith("bag: /bar/pose: a quaternion of length 0")
