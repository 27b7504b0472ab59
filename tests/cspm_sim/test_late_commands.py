"""Torque commands that come late, get lost or stop: the plant trips in time and holds the bar.

Plant and controllers as in real time, on a clock of the test's own.
"""

from collections import deque

import numpy as np
import pytest
from run_samples import bundle_of

from bench.performance.slow_machine import slow_overrides
from cspm.analysis.design import analyze_design
from cspm_control.analysis.delay_margin import largest_age
from cspm_control.safety import GuardedStage
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.schedule import CLOCK, FORCE_CONTROLLER, TENSION, TORQUE_COMMAND, WAVE_TRAJECTORY
from cspm_msgs_py.stepping.sample_and_hold import SampleAndHold, WallTrajectory
from cspm_ros.margins.lateness import lateness_ns
from cspm_run.assembly import assemble
from cspm_run.plant_guard import make_watchdog
from cspm_sim.realtime_plant import RealtimePlant
from cspm_sim.simulator import Simulator

MS, SECOND = 1_000_000, 1_000_000_000
START = 1_800_000_000 * SECOND
SAG = 0.1
"""How far `hold` lets the bar go, as the safety page says [m]."""
LOST = None


def at_once(_):
    return 0


class Wall:
    """A run whose torque commands take their time, or get lost, as `way` says of each stamp."""

    def __init__(self, folder, *arguments):
        bundle = bundle_of(*arguments)
        self.parts = assemble(bundle.scenario, bundle.testbed.testbed, folder)
        self.schedule, self.lateness = self.parts.schedule, lateness_ns(bundle)
        self.period, self.way, self.steps = self.schedule.period_ns, at_once, 0
        self.now, self.under_way, self.late = START, deque(), []
        self.oldest = None if self.lateness is None else self.lateness + self.period
        self.dog = make_watchdog(bundle.scenario, self.parts.plant, self.oldest)
        publish = {
            name: (lambda _, stamp, row, name=name: self._deliver(name, START + stamp, row))
            for name in self.schedule.topics
            if name != CLOCK and not any(name in p.outputs for p in self.schedule.nodes.values())
        }
        simulator = Simulator(
            self.parts.plant, self.parts.sensors, publish, period_ns=self.period, controlled=True
        )
        self.plant = RealtimePlant(
            simulator,
            self.schedule,
            10**9,
            self.dog,
            lambda *_: None,
            lateness_ns=self.lateness,
            on_fault=lambda reason: self.force.alarm(self.now, reason),
        )
        self.nodes = {}
        for stage in self.parts.stages:
            self._connect(stage)
        self.force = self.nodes[FORCE_CONTROLLER]
        self.plant.start(START)

    def _connect(self, stage):
        outputs = self.schedule.nodes[stage.node].outputs
        publish = {
            name: (lambda _, stamp, row, name=name: self._deliver(name, stamp, row))
            for name in outputs
        }
        if stage.node == WAVE_TRAJECTORY:
            self.waves = WallTrajectory(stage, self.schedule, publish, lambda *_: None)
            self.waves.start(START)
            return
        guard = stage if isinstance(stage, GuardedStage) else None
        self.nodes[stage.node] = SampleAndHold(
            stage,
            self.schedule,
            0.05,
            publish,
            lambda *_: None,
            guard,
            lateness_ns=self.lateness if guard else None,
            on_fault=lambda reason: self.force.alarm(self.now, reason),
        )

    def _deliver(self, name, stamp, row):
        """Let a message come to all before what they make of it comes to any."""
        self.under_way.append((name, stamp, row.copy()))
        if len(self.under_way) > 1:
            return
        while self.under_way:
            name, stamp, row = self.under_way[0]
            for node, part in self.nodes.items():
                plan = self.schedule.nodes[node]
                if name in (*plan.inputs, *plan.held):
                    part.receive(name, stamp, row, self.now)
            if name == TORQUE_COMMAND and (delay := self.way(stamp)) is not LOST:
                # None overtakes another.
                before = self.late[-1][0] if self.late else 0
                self.late.append((max(before, self.now + delay), stamp, row))
            self.under_way.popleft()
        self._obey()

    def _obey(self):
        for message in [each for each in self.late if each[0] <= self.now]:
            self.late.remove(message)
            try:
                self.plant.receive_torque(message[1], message[2], message[0])
            except InputError as err:
                self.plant.refuse(message[0], str(err))

    def go(self, count):
        """Make steps; return the bar's positions and the tensions on the way."""
        places, tensions = [], []
        for _ in range(count):
            self.now = START + self.steps * self.period
            self._obey()
            self.waves.tick(self.now)
            self.plant.tick(self.now)
            for node in self.nodes.values():
                node.tick(self.now)
                node.note_safe(self.force.safe)
            self.steps += 1
            places.append(self.parts.plant.bar_state[:3].copy())
            tensions.append(self.parts.plant.tensions.copy())
        return np.array(places), np.array(tensions)

    def until_safe(self, most):
        """Step until the drives are in their safe state; return after how many steps."""
        for count in range(1, most + 1):
            self.go(1)
            if self.dog.safe:
                return count
        raise AssertionError(f"no safe state in {most} steps")

    def take_up(self):
        """Let commands come in time again, and leave the safe state."""
        self.way, self.late = at_once, []
        self.go(2)
        assert self.force.reset(self.now) is None
        self.go(2)
        assert self.dog.reset() is None
        self.go(2)
        assert not self.dog.safe
        assert not self.force.safe


def drawn(kind, wall, rng):
    """Return a way that is too late from now on, drawn at random."""
    if kind == "late":
        delay = round(wall.lateness * (1.01 + 10.0 * rng.random()))
        return lambda _: delay
    if kind == "jitter":
        return lambda _: round(wall.lateness * 4.0 * rng.random())
    if kind == "lost":
        return lambda _: LOST if rng.random() < 0.97 else 0
    return lambda _: LOST


@pytest.mark.compiled
@pytest.mark.parametrize("kind", ["late", "jitter", "lost", "stopped"])
def test_whatever_happens_to_commands_the_bar_is_held(tmp_path, kind):
    """At random instants of a sea, at rates of an ordinary computer."""
    wall = Wall(tmp_path, "calm", *slow_overrides(), "safety.watchdog=2", "safety.stale_after=2")
    rng = np.random.default_rng(4)
    wall.go(2000)
    for _ in range(5):
        wall.go(int(rng.integers(100, 400)))
        before = wall.parts.plant.bar_state[:3].copy()
        assert not wall.dog.safe
        wall.way = drawn(kind, wall, rng)
        count = wall.until_safe(200)
        if kind in ("late", "stopped"):
            assert count * wall.period <= wall.oldest + 2 * wall.period
        places, tensions = wall.go(400)
        assert np.abs(places - before).max() < SAG
        assert tensions.max() < 60.0
        reason = wall.dog.status().values["reason"]
        assert reason.startswith("machine too busy: /winches/torque_command ")
        assert "(safety.lateness): lower rates with gains for them, or nodes with -p" in reason
        wall.take_up()


@pytest.mark.compiled
@pytest.mark.slow
def test_at_full_rates_in_the_steep_sea_too(tmp_path):
    wall = Wall(tmp_path, "worst_case_steep")
    rng = np.random.default_rng(2)
    wall.go(4_000)
    for kind in ("late", "stopped", "lost"):
        wall.go(2_000 + int(rng.integers(500, 1500)))
        before = wall.parts.plant.bar_state[:3].copy()
        wall.way = drawn(kind, wall, rng)
        wall.until_safe(300)
        places, _ = wall.go(2000)
        assert np.abs(places - before)[:, 2].max() < SAG
        wall.take_up()


@pytest.mark.compiled
def test_within_the_margin_nothing_trips_and_the_bar_follows(tmp_path):
    wall = Wall(tmp_path, "calm", *slow_overrides())
    assert wall.lateness == pytest.approx(32.4 * MS, rel=0.01)
    wall.way = lambda _: 15 * MS
    places, _ = wall.go(3000)
    assert not wall.dog.safe
    prompt, _ = Wall(tmp_path, "calm", *slow_overrides()).go(3000)
    assert np.ptp(prompt, axis=0).max() > 0.5
    assert np.abs(places - prompt).max() < 0.05


@pytest.mark.compiled
def test_a_late_controller_falls_silent_and_says_so(tmp_path):
    """Of one that gets no tensions: it sends nothing, neither a torque nor that of `hold`."""
    wall = Wall(tmp_path, "rest", *slow_overrides())
    wall.go(50)
    sent = []
    wall.way = lambda stamp: sent.append(stamp) or 0
    receive = wall.force.receive

    def blind(name, stamp, row, now_ns):
        if name != TENSION:
            receive(name, stamp, row, now_ns)

    wall.force.receive = blind
    # Without what the plant says of it.
    wall.plant._on_fault = lambda _: None
    wall.go(6)
    assert not wall.force.safe
    wall.go(3)
    assert wall.force.safe
    assert wall.dog.safe
    assert not sent
    reason = wall.parts.stages[-1].status().values["reason"]
    assert reason.startswith(
        "machine too busy: force_controller answers /cables/tension of 40.0 ms"
    )
    assert "of 40.0 ms ago, allowed: 37.4 ms (safety.lateness): lower rates " in reason
    wall.force.receive = receive
    wall.take_up()


def test_the_margin_is_that_of_the_design():
    """69° at 915 rad/s in `rest`: 1.3 ms; and what a scenario says itself counts."""
    rest = bundle_of("rest")
    least = largest_age(rest.scenario, rest.testbed.testbed)
    assert least == pytest.approx(np.deg2rad(69.0) / 915.0, rel=0.02)
    assert lateness_ns(rest) == round(least * 1e9)
    assert lateness_ns(bundle_of("rest", "safety.lateness=0.2")) == 200 * MS
    assert lateness_ns(bundle_of("one_winch")) is None


def test_drives_that_take_tensions_leave_the_margin_of_the_motion_loops():
    """Some tens of milliseconds, where torques have one."""
    drives = bundle_of("rest", "drive=tension")
    least = largest_age(drives.scenario, drives.testbed.testbed)
    assert 0.04 < least < 0.06
    assert lateness_ns(drives) == round(least * 1e9)
    # `cspm analyze design` says the same of both.
    rest = bundle_of("rest")
    ages = analyze_design("rest").data()["largest_age"]
    assert ages["tension"] == pytest.approx(least)
    assert ages["torque"] == pytest.approx(largest_age(rest.scenario, rest.testbed.testbed))
