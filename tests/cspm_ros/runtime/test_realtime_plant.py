"""The simulated plant by the wall: in time it is as in lockstep, late it holds and counts."""

from collections import deque

import numpy as np
import pytest
from run_samples import bundle_of

from cspm_control.safety import GuardedStage
from cspm_msgs_py.diagnostics import Level
from cspm_msgs_py.schedule import CLOCK, TORQUE_COMMAND, WAVE_TRAJECTORY
from cspm_msgs_py.stepping.sample_and_hold import SampleAndHold, WallTrajectory
from cspm_run.assembly import assemble
from cspm_run.loop import Loop
from cspm_run.plant_guard import make_watchdog
from cspm_sim.realtime_plant import RealtimePlant
from cspm_sim.simulator import Simulator

MS = 1_000_000
START = 1_800_000_000_000 * MS
FAST = "rates={motion_capture: 1000, motion_controller: 1000, tension_distribution: 1000}"
QUIET = "rates={plant: 200, winches: 200, load_cells: 200, wave_trajectory: 200,"
QUIET += " force_controller: 200}"


def parts_of(tmp_path, *arguments):
    bundle = bundle_of(*arguments)
    return assemble(bundle.scenario, bundle.testbed.testbed, tmp_path)


def lockstep(parts, steps):
    """Return stamps and rows by topic as the loop without ROS makes them."""
    found = {name: [] for name in parts.schedule.topics}

    def keep(name):
        return lambda _, stamp, row: found[name].append((stamp, row.copy()))

    loop = Loop(parts, {name: keep(name) for name in found}, lambda *_: None)
    for _ in range(steps):
        loop.step()
    return found


class Bench:
    """The plant in real time, on a clock of the test's own."""

    def __init__(self, parts, steps, watchdog=None):
        self.parts, self.schedule = parts, parts.schedule
        self.period = self.schedule.period_ns
        self.sent = {name: [] for name in self.schedule.topics if name != CLOCK}
        self.listeners, self.under_way = [], deque()
        self.reported = []
        publish = {
            name: self._publisher(name)
            for name in self.sent
            if not any(name in plan.outputs for plan in self.schedule.nodes.values())
        }
        self.simulator = Simulator(
            parts.plant,
            parts.sensors,
            publish,
            period_ns=self.period,
            controlled=parts.controlled,
        )
        self.dog = watchdog or make_watchdog(parts.scenario, parts.plant)
        self.plant = RealtimePlant(
            self.simulator,
            self.schedule,
            steps,
            self.dog,
            lambda stamp, status: self.reported.append((stamp, status)),
        )
        self.now = START
        self.hanging = self.simulator.torque.copy()

    def _publisher(self, name):
        def send(_, stamp, row):
            self.deliver(name, START + stamp, row)

        return send

    def deliver(self, name, stamp, row):
        """Let a message come to all before what they make of it comes to any."""
        self.sent[name].append((stamp - START, row.copy()))
        self.under_way.append((name, stamp, row.copy()))
        if len(self.under_way) > 1:
            return
        while self.under_way:
            for listener in self.listeners:
                listener(*self.under_way[0])
            self.under_way.popleft()

    def at(self, step, late_ns=0):
        """Let the wall be at a step; return the plant."""
        self.now = START + step * self.period + late_ns
        self.plant.tick(self.now)
        return self.plant

    def command(self, step, torque=None, late_ns=0):
        """Let the command of a step come."""
        stamp = START + step * self.period
        row = self.hanging if torque is None else torque
        self.plant.receive_torque(stamp, row, self.now + late_ns)


def connect(bench):
    """Give the bench its controllers, each with its part of a real-time run."""
    parts, schedule = bench.parts, bench.schedule
    nodes = []
    for stage in parts.stages:
        plan = schedule.nodes[stage.node]
        publish = {
            name: (lambda _, stamp, row, name=name: bench.deliver(name, stamp, row))
            for name in plan.outputs
        }
        if stage.node == WAVE_TRAJECTORY:
            waves = WallTrajectory(stage, schedule, publish, lambda *_: None)
            waves.start(START)
            continue
        guard = stage if isinstance(stage, GuardedStage) else None
        part = SampleAndHold(stage, schedule, 0.05, publish, lambda *_: None, guard)
        nodes.append(part)

        def listen(name, stamp, row, part=part, reads=(*plan.inputs, *plan.held)):
            if name in reads:
                part.receive(name, stamp, row, bench.now)

        bench.listeners.append(listen)

    def obey(name, stamp, row):
        if name == TORQUE_COMMAND:
            bench.plant.receive_torque(stamp, row, bench.now)

    bench.listeners.append(obey)
    return waves, nodes


@pytest.mark.parametrize(
    "scenario",
    [("rest",), ("worst_case",), ("worst_case", FAST)],
)
def test_with_all_deadlines_met_every_message_is_that_of_lockstep(tmp_path, scenario):
    steps = 400
    expected = lockstep(parts_of(tmp_path, *scenario), steps)
    bench = Bench(parts_of(tmp_path, *scenario), steps)
    waves, nodes = connect(bench)
    bench.plant.start(START)
    for k in range(steps + 1):
        # Any jitter below a period, the same for all.
        bench.now = START + k * bench.period + (37 * k) % 900_000
        waves.tick(bench.now)
        bench.plant.tick(bench.now)
        for node in nodes:
            node.tick(bench.now)
    assert bench.plant.ended
    del expected[CLOCK]
    for name, messages in expected.items():
        found = bench.sent[name][: len(messages)]
        assert [stamp for stamp, _ in found] == [stamp for stamp, _ in messages], name
        for (_, row), (_, wanted) in zip(found, messages, strict=True):
            np.testing.assert_array_equal(row, wanted, err_msg=name)
    assert (bench.plant.missed, bench.plant.late) == (0, 0)
    assert [node.late for node in nodes] == [0, 0, 0]
    assert not bench.dog.safe


def quiet(tmp_path, steps=100, *overrides, **arguments):
    bench = Bench(parts_of(tmp_path, "rest", QUIET, *overrides), steps, **arguments)
    bench.plant.start(START)
    return bench


def test_before_the_start_nothing_happens(tmp_path):
    bench = Bench(parts_of(tmp_path, "rest", QUIET), 100)
    bench.at(5)
    assert bench.plant.step == -1
    bench.plant.start(START)
    bench.at(0, late_ns=-1)
    assert bench.plant.step == -1
    bench.at(0)
    assert bench.plant.step == 0
    assert len(bench.sent["/truth/bar/pose"]) == 1
    assert bench.parts.plant.steps == 0


def test_each_state_is_published_once_at_its_instant(tmp_path):
    bench = quiet(tmp_path)
    for k in range(10):
        bench.at(k)
        bench.command(k)
        bench.at(k, late_ns=bench.period // 2)
    assert [stamp for stamp, _ in bench.sent["/truth/bar/pose"]] == [5 * MS * k for k in range(10)]
    assert bench.parts.plant.steps == 9


def test_a_late_command_is_held_counted_and_followed_when_it_comes(tmp_path):
    bench = quiet(tmp_path)
    changed = 1.5 * bench.hanging
    bench.at(0)
    bench.command(0)
    bench.at(1)
    # The command of step 1 comes in step 2: the plant has held that of step 0.
    bench.at(2)
    assert bench.plant.missed == 1
    np.testing.assert_array_equal(bench.simulator.torque, bench.hanging)
    bench.command(1, changed)
    bench.at(3)
    # Used, but not the command of its own step.
    np.testing.assert_array_equal(bench.simulator.torque, changed)
    assert bench.plant.missed == 2
    bench.command(3)
    bench.at(4)
    assert bench.plant.missed == 2


def test_missed_commands_are_reported(tmp_path):
    bench = quiet(tmp_path)
    for k in range(41):
        bench.at(k)
        if k < 19:
            bench.command(k)
    mine = [status for _, status in bench.reported if status.name == "plant"]
    assert [status.values["deadlines_missed"] for status in mine] == ["0", "1", "21"]
    assert (mine[0].level, mine[0].message) == (Level.OK, "ok")
    assert (mine[1].level, mine[1].message) == (Level.WARN, "torque commands came too late")


def test_where_commands_come_seldom_only_theirs_are_missed(tmp_path):
    rates = "rates={plant: 200, winches: 200, load_cells: 200, wave_trajectory: 200,"
    bench = Bench(parts_of(tmp_path, "rest", rates + " force_controller: 100}"), 100)
    bench.plant.start(START)
    for k in range(20):
        bench.at(k)
        if k % 2 == 0:
            bench.command(k)
    assert bench.plant.missed == 0
    for k in range(20, 31):
        bench.at(k)
    # Those of 20, 22, 24, 26 and 28; that of 30 may still come.
    assert bench.plant.missed == 5


def test_it_catches_up_two_steps_at_a_time(tmp_path):
    bench = quiet(tmp_path)
    bench.at(0)
    found = [bench.at(10).step for _ in range(6)]
    assert found == [2, 4, 6, 8, 10, 10]
    # Steps 1 to 9 were made more than a period after they were due.
    assert bench.plant.late == 9
    assert len(bench.sent["/truth/bar/pose"]) == 11


def test_steps_within_their_period_are_not_late(tmp_path):
    bench = quiet(tmp_path)
    for k in range(10):
        bench.at(k, late_ns=bench.period - 1)
    assert bench.plant.late == 0


def test_it_ends_after_the_last_step(tmp_path):
    bench = quiet(tmp_path, steps=3)
    for k in range(3):
        bench.at(k)
        assert not bench.plant.ended
    bench.at(3)
    assert bench.plant.ended
    assert bench.parts.plant.steps == 3
    bench.at(4)
    assert bench.parts.plant.steps == 3
    # The state after the last step is nobody's any more, as in lockstep.
    assert len(bench.sent["/truth/bar/pose"]) == 3


@pytest.mark.parametrize("state", ["hold", "brake"])
def test_its_watchdog_takes_over_when_commands_end(tmp_path, state):
    bench = quiet(tmp_path, 400, f"safety={{state: {state}}}")
    start = bench.parts.plant.bar_state[2]
    for k in range(400):
        bench.at(k)
        if k < 100:
            bench.command(k)
        # Of 100 on, commands are missing: that of 99 is 50 ms old at 109, older at 110.
        assert bench.dog.safe == (k > 109)
    assert bench.parts.plant.locked == (state == "brake")
    assert abs(bench.parts.plant.bar_state[2] - start) < 1e-3
    said = [status for _, status in bench.reported if status.name == "plant/watchdog"]
    assert said[5].message == "ok"
    assert said[-1].level == Level.ERROR
    assert said[-1].values["reason"] == f"no {TORQUE_COMMAND} for 55 ms, allowed: 50 ms"


def test_a_watchdog_with_patience_lets_the_plant_hold_the_last_command(tmp_path):
    bench = quiet(tmp_path, 400, "safety={watchdog: 10.0}")
    falling = 0.8 * bench.hanging
    for k in range(200):
        bench.at(k)
        if k < 10:
            bench.command(k, falling)
    assert not bench.dog.safe
    np.testing.assert_array_equal(bench.simulator.torque, falling)
    # Nobody holds the bar: it sinks.
    assert bench.parts.plant.bar_state[2] > 2.1


def test_the_brake_topic_sets_and_releases_the_brakes(tmp_path):
    bench = quiet(tmp_path)
    bench.at(0)
    for wanted in (True, False):
        bench.plant.receive_brake(wanted)
        assert bench.parts.plant.locked is wanted
    bench.plant.receive_brake(True)
    slack = np.zeros_like(bench.hanging)
    angles = bench.parts.plant.angles.copy()
    for k in range(1, 50):
        bench.at(k)
        bench.command(k, slack)
    np.testing.assert_array_equal(bench.parts.plant.angles, angles)


def test_refused_commands_are_counted_and_reported(tmp_path):
    bench = quiet(tmp_path)
    bench.at(0)
    bench.plant.refuse(bench.now, "a reason")
    for k in range(1, 21):
        bench.command(k - 1)
        bench.at(k)
    said = [status for _, status in bench.reported if status.name == "plant"]
    assert [status.values["refused"] for status in said] == ["0", "1"]
    assert (said[1].level, said[1].message) == (Level.WARN, "refused: a reason")


def test_a_plant_that_leaves_its_equations_says_so_and_ends(tmp_path):
    bench = quiet(tmp_path, 10_000, "safety={watchdog: 10.0}")
    wild = np.array([0.5, -0.5, 2.0, -2.0, 1.0, -1.0, 1.0, -1.0])
    for k in range(2000):
        bench.at(k)
        bench.command(k, wild)
        if bench.plant.ended:
            break
    assert bench.plant.ended
    assert bench.plant.failure.startswith("t = ")
    assert "; before it: " in bench.plant.failure
    steps = bench.parts.plant.steps
    bench.at(2500)
    assert bench.parts.plant.steps == steps


def test_the_watchdogs_torques_are_what_the_plant_does(tmp_path):
    """Two plants, one commanded with the safe state's torques, one left to its watchdog."""
    bench = quiet(tmp_path, 200)
    other = parts_of(tmp_path, "rest", QUIET).plant
    for k in range(100):
        bench.at(k)
        if k == 0:
            bench.command(0)
        if k:
            other.step(bench.simulator.torque)
    assert bench.dog.safe
    np.testing.assert_array_equal(other.bar_state, bench.parts.plant.bar_state)


def test_delays_are_those_of_commands_that_answer_a_state(tmp_path):
    bench = Bench(parts_of(tmp_path, "rest"), 50)
    bench.plant.start(START)
    bench.at(0)
    bench.command(0, late_ns=400_000)
    bench.at(1)
    bench.command(1, late_ns=1)
    # A period and a half after its state, and in the safe state at a time of its own.
    bench.at(3)
    bench.command(2, late_ns=MS // 2)
    bench.plant.receive_torque(bench.now + 1_234, bench.hanging, bench.now + 9_999)
    counts = bench.plant.delays.counts
    assert (counts[0], counts[1], counts[3], sum(counts)) == (1, 1, 1, 3)
    bench.at(100)
    assert bench.reported[0][1].values["torque_delays"] == "0 0 0 0 0 0 0 0 0 0"
