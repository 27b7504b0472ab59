"""The handshake without ROS: whatever order messages come in, the same is computed."""

import random
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lockstep_network import Network, chooser, with_rates
from loops import WILD, Listener
from run_samples import bundle_of
from schedules import MS, delayed, schedule_with

from cspm_msgs_py.diagnostics import Level, Status
from cspm_msgs_py.errors import DivergenceError, InputError
from cspm_msgs_py.schedule import NodePlan, Schedule, Timing
from cspm_msgs_py.stepping.lockstep import (
    ACKNOWLEDGE_EVERY,
    WINDOW,
    Acknowledgement,
    Follower,
    check_end,
)
from cspm_msgs_py.topics import QOS_DEPTH

REST = bundle_of("rest")
SCENARIOS = {name: bundle_of(name) for name in ("rest", "verification_mid", "one_winch")}
DIVISORS = st.sampled_from([10, 40, 50, 100, 125, 200, 500, 1000])
RATES = st.fixed_dictionaries(
    {},
    optional={
        "motion_capture": DIVISORS,
        "load_cells": DIVISORS,
        "winches": DIVISORS,
        "wave_trajectory": DIVISORS,
        "motion_controller": DIVISORS,
        "tension_distribution": DIVISORS,
        "force_controller": DIVISORS,
    },
)
DELAYS = st.dictionaries(
    st.sampled_from(["/bar/pose", "/winches/state", "/cables/tension"]), st.integers(0, 25)
)
# Which queue is next is drawn by a generator of its own, so that the seed is all to shrink.
SEEDS = st.integers(0, 2**32 - 1)


def assert_as_in_process(network, listener):
    """Hold what a network sent to what a loop in one process sends, bit for bit.

    A node may be ahead of the plant by less than a step of its own; nobody asks for that in the
    end.
    """
    last_ns = network.plant.last_step * network.schedule.period_ns
    for name, heard in network.heard.items():
        sent = [message for message in heard if message[0] <= last_ns]
        assert len(heard) - len(sent) <= 1
        expected = listener.messages[name]
        assert [message[:2] for message in sent] == [message[:2] for message in expected]
        for (*_, row), (*_, other) in zip(sent, expected, strict=True):
            np.testing.assert_array_equal(row.view(np.uint64), other.view(np.uint64))
    assert not {name for name, found in listener.messages.items() if found} - set(network.heard)
    order = ["plant", *network.nodes]
    reported = [reported for reported in network.statuses if reported[0] <= last_ns]
    assert (
        sorted(reported, key=lambda reported: (reported[0], order.index(reported[1].name)))
        == listener.statuses
    )


def listened(bundle, scenario, testbed, steps):
    """Return what a loop in one process sends."""
    changed = type(bundle)(scenario, bundle.testbed, bundle.files)
    listener = Listener(changed, testbed.sensors)
    with suppress(DivergenceError):
        listener.run(steps)
    return listener


@settings(max_examples=60)
@given(rates=RATES, delays=DELAYS, seed=SEEDS, steps=st.integers(1, 130))
def test_any_interleaving_computes_what_one_process_computes(rates, delays, seed, steps):
    scenario, testbed = with_rates(REST, **rates)
    testbed = delayed(testbed, delays)
    network = Network(scenario, testbed, steps)
    network.run(chooser(random.Random(seed)))
    assert network.plant.finished
    assert network.plant.failure is None
    assert network.plant.last_step == steps - 1
    assert all(node.completed >= steps - 1 for node in network.nodes.values())
    assert network.lost == 0
    assert_as_in_process(network, listened(REST, scenario, testbed, steps))


@pytest.mark.parametrize("name", ["verification_mid", "one_winch"])
@pytest.mark.parametrize("seed", range(3))
def test_without_a_closed_loop_as_well(name, seed):
    bundle = SCENARIOS[name]
    scenario, testbed = with_rates(bundle)
    network = Network(scenario, testbed, 150)
    network.run(chooser(random.Random(seed)))
    assert network.plant.finished
    assert_as_in_process(network, listened(bundle, scenario, testbed, 150))


def test_the_order_of_delivery_does_differ():
    """The property would hold for nothing if all seeds delivered equally."""
    orders = []
    for seed in range(3):
        network, order = Network(*with_rates(REST), 30), []
        choose = chooser(random.Random(seed))

        def note(waiting, choose=choose, order=order):
            order.append(choose(waiting))
            return order[-1]

        network.run(note)
        orders.append(order)
    assert orders[0] != orders[1] != orders[2]


@pytest.mark.parametrize("depth", [WINDOW + 1, QOS_DEPTH])
def test_the_plant_outruns_no_queue_that_keeps_what_the_contract_keeps(depth):
    """One node is served only when nothing else is left to deliver."""
    rates = {"motion_capture": 1000, "motion_controller": 20, "force_controller": 100}
    scenario, testbed = with_rates(REST, **rates, tension_distribution=50, wave_trajectory=50)
    for slow in (
        "wave_trajectory",
        "motion_controller",
        "tension_distribution",
        "force_controller",
    ):
        network = Network(scenario, testbed, 200, depth=depth)
        network.run(lambda waiting, slow=slow: min(waiting, key=lambda key: key[1] == slow))
        assert network.lost == 0
        assert network.plant.finished


def test_a_queue_too_short_loses_messages_and_the_run_stands_still():
    network = Network(*with_rates(REST), 50, depth=2)
    with pytest.raises(InputError, match=r"is early: messages lost or a second sender"):
        network.run(lambda waiting: min(waiting, key=lambda key: key[1] == "wave_trajectory"))
    assert network.lost > 0


def test_the_plant_may_be_stopped_at_any_time():
    for stop_after in (0, 1, 37, 400):
        network = Network(*with_rates(REST), 1000)
        choose, left = chooser(random.Random(stop_after)), [stop_after]

        def stopping(waiting, network=network, choose=choose, left=left):
            if left[0] == 0:
                network.plant.stop()
            left[0] -= 1
            return choose(waiting)

        network.run(stopping)
        last = network.plant.last_step
        assert network.plant.finished
        assert 0 <= last < 100
        # Everything that belongs to the last step was computed.
        for name, timing in network.schedule.topics.items():
            assert len(network.heard[name]) == timing.count(last + 1)


def test_stopped_before_its_first_step_it_is_finished_at_once():
    network = Network(*with_rates(REST), 1000)
    network.plant.stop()
    assert network.plant.ended
    assert network.plant.finished
    assert network.plant.last_step == -1


def test_a_divergence_ends_the_run_with_the_state_that_led_to_it():
    bundle = bundle_of("rest", *WILD)
    network = Network(bundle.scenario, bundle.testbed.testbed, 20_000)
    network.run(lambda waiting: waiting[0])
    failure, last = network.plant.failure, network.plant.last_step
    assert failure is not None
    assert failure.startswith(f"t = {(last + 1) * 1e-3:.3f} s: ")
    assert "; before it: " in failure
    assert "\n" not in failure
    assert network.plant.finished
    assert all(node.completed >= last for node in network.nodes.values())
    assert_as_in_process(network, listened(bundle, *with_rates(bundle), last + 1))


# A topic's stamps


# A follower


class Recall:
    """A stage that sends what it is given."""

    node = "node"

    def __init__(self):
        self.steps = []

    def step(self, now_ns, inputs, send):
        self.steps.append((now_ns, {name: row[0] for name, row in inputs.items()}))
        send("/out", inputs["/in"])

    def status(self):
        return Status(Level.OK, "node", "ok", {"steps": str(len(self.steps))})


class Follow:
    """A follower of `Recall`, and what it sent."""

    def __init__(self, schedule):
        self.stage, self.sent, self.statuses = Recall(), [], []
        self.follower = Follower(
            self.stage,
            schedule,
            {"/out": lambda log, stamp, row: self.sent.append((log, stamp, row[0]))},
            lambda now, status: self.statuses.append((now, status)),
        )

    def receive(self, step, value=None, topic="/in"):
        self.follower.receive(topic, step * MS, np.array([step if value is None else value]))


def test_a_follower_computes_with_the_stamps_of_the_schedule():
    follow = Follow(schedule_with(first=5, divider=10, delay=5))
    assert follow.follower.waiting() == "node waits for /in of 0.000 s"
    assert follow.follower.completed == 4
    for step in range(0, 110, 10):
        follow.receive(step)
    assert follow.sent == [((step + 5) * MS, (step + 5) * MS, step) for step in range(0, 110, 10)]
    assert follow.follower.completed == 114
    assert follow.follower.waiting() == "node waits for /in of 0.110 s"
    assert follow.follower.now_ns == 105 * MS


def test_statuses_are_sent_where_the_schedule_says():
    follow = Follow(schedule_with(divider=10))
    for step in range(0, 310, 10):
        follow.receive(step)
    assert [now for now, _ in follow.statuses] == [0, 100 * MS, 200 * MS, 300 * MS]
    assert [status.values["steps"] for _, status in follow.statuses] == ["1", "11", "21", "31"]


@pytest.mark.parametrize("stamp", [0, 10, 19, 21, 30, 10**6])
def test_a_follower_refuses_other_stamps_and_goes_on(stamp):
    follow = Follow(schedule_with(divider=10))
    follow.receive(0)
    follow.receive(10)
    with pytest.raises(InputError, match=rf"^/in: stamp {stamp * 1e-3:.6f} s (came|is early)"):
        follow.receive(stamp, value=-1.0)
    assert follow.follower.completed == 19
    follow.receive(20)
    assert [value for *_, value in follow.sent] == [0, 10, 20]


def two_inputs(held):
    """Return a schedule of a node at 100 Hz that reads one topic at 100 Hz and one at 1 kHz."""
    inputs = (("/in",), ("/often",)) if held else (("/in", "/often"), ())
    plan = NodePlan(0, 10, 100, *inputs, ("/out",))
    topics = {"/in": Timing(0, 10), "/often": Timing(4, 1), "/out": Timing(0, 10)}
    return Schedule(MS, topics, {"node": plan}, 100)


def test_what_is_held_is_not_waited_for_until_it_is_there():
    follow = Follow(two_inputs(held=True))
    follow.receive(0)
    assert follow.stage.steps == [(0, {"/in": 0})]
    follow.receive(10)
    assert len(follow.stage.steps) == 1
    assert follow.follower.waiting() == "node waits for /often of 0.010 s"
    for step in range(4, 11):
        follow.receive(step, topic="/often")
    assert follow.stage.steps[1:] == [(10 * MS, {"/in": 10, "/often": 10})]


def test_how_far_a_node_is_counts_what_it_has_not_read():
    """Computed at 0 for 10 steps, it has to be waited for by who sends to it every step."""
    follow = Follow(two_inputs(held=True))
    follow.receive(0)
    assert (follow.follower.completed, follow.follower.reached) == (9, 3)
    for step in range(4, 8):
        follow.receive(step, topic="/often")
        assert (follow.follower.completed, follow.follower.reached) == (9, step)
    for step in (8, 9, 10, 11):
        follow.receive(step, topic="/often")
    assert (follow.follower.completed, follow.follower.reached) == (9, 9)
    follow.receive(10)
    assert (follow.follower.completed, follow.follower.reached) == (19, 11)


# Telling how far one is


@given(steps=st.lists(st.integers(0, 6), max_size=40), ahead=st.integers(0, 10), when=SEEDS)
def test_the_plant_is_notified_every_few_steps_and_the_last(steps, ahead, when):
    acknowledgement, reached, reported = Acknowledgement(), -1, [-1]
    last = sum(steps) - 1 - ahead
    for i, step in enumerate(steps):
        reached += step
        if i == when % len(steps):
            acknowledgement.last = last
        if acknowledgement.due(reached):
            assert reached > reported[-1]
            reported.append(reached)
        assert reached - reported[-1] < ACKNOWLEDGE_EVERY
    acknowledgement.last = last
    if acknowledgement.due(reached):
        reported.append(reached)
    assert reported[-1] >= last
    assert not acknowledgement.due(reached)


# The end of a run


@pytest.mark.parametrize("last", [3, 7])
def test_an_end_within_reach_is_accepted(last):
    check_end(last, 3, 7)


@pytest.mark.parametrize("last", [2, 8, -1, 10**9])
def test_an_end_out_of_reach_is_another_runs(last):
    with pytest.raises(InputError) as caught:
        check_end(last, 3, 7)
    assert str(caught.value) == f"the last step is {last}, allowed: 3 to 7; another run's end"


def test_a_follower_knows_an_end_that_cannot_be_its_own():
    follow = Follow(schedule_with(divider=10))
    # The plant may be stopped before anything came.
    follow.follower.check_end(-1)
    with pytest.raises(InputError, match=r"^the last step is 2000, allowed: -1 to"):
        follow.follower.check_end(2000)
    for step in range(0, 60, 10):
        follow.receive(step)
    for last in (0, 49, 59, 60, 159):
        follow.follower.check_end(last)
    for last in (-100, 160, 1000):
        with pytest.raises(InputError, match=r"; another run's end$"):
            follow.follower.check_end(last)


# The plant


@pytest.fixture
def plant():
    """A plant that waits for its first torque."""
    network = Network(*with_rates(REST), 100)
    network.plant.start()
    return network.plant


def test_a_torque_that_is_not_due_is_refused(plant):
    torque = np.zeros(8)
    assert plant.waiting() == "plant waits for /winches/torque_command of 0.000 s"
    for stamp, why in ((MS, "is early"), (-MS, "came already")):
        with pytest.raises(InputError, match=rf"^/winches/torque_command: stamp \S+ s {why}"):
            plant.receive_torque(stamp, torque)
        assert plant.last_step == 0
    plant.receive_torque(0, torque)
    assert plant.last_step == 1
    with pytest.raises(
        InputError, match=r"^/winches/torque_command: stamp 0.000000 s came already"
    ):
        plant.receive_torque(0, torque)


def test_the_plant_waits_for_who_is_behind():
    network = Network(*with_rates(REST), 100)
    plant = network.plant
    plant.start()

    def not_the_waves(waiting):
        left = [key for key in waiting if key[1] != "wave_trajectory"]
        return left[0] if left else None

    network.deliver(("/clock", "wave_trajectory"))
    while plant.last_step < 8 and (
        key := not_the_waves([k for k, q in network.queues.items() if q])
    ):
        network.deliver(key)
    plant.receive_torque(8 * MS, np.zeros(8))
    assert plant.last_step <= WINDOW
    assert "plant waits for" in plant.waiting()


def test_progress_beyond_what_was_sent_is_refused(plant):
    allowed = 0 + 10  # the slowest topic's next message is due then
    with pytest.raises(InputError) as caught:
        plant.receive_progress("wave_trajectory", allowed + 1)
    assert str(caught.value) == f"wave_trajectory at step {allowed + 1}, allowed: at most {allowed}"
    plant.receive_progress("wave_trajectory", allowed)
    plant.receive_progress("nobody", 0)
    assert plant.last_step == 0
