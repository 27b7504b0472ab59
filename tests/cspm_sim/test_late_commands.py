"""Torque commands that come late, get lost or stop: the plant trips in time and holds the bar.

Plant and controllers as in real time, on a clock of the test's own.
"""

import numpy as np
import pytest
from run_samples import bundle_of

from bench.faults.held_trips import drawn
from bench.faults.wall_run import WallRun
from bench.performance.slow_machine import slow_overrides
from cspm.analysis.design import analyze_design
from cspm_control.analysis.delay_margin import largest_age
from cspm_msgs_py.schedule import TENSION
from cspm_ros.margins.lateness import lateness_ns

MS = 1_000_000
SAG = 0.1
"""How far `hold` lets the bar go, as the safety page says [m]."""


def wall_of(folder, *arguments):
    return WallRun(folder, bundle_of(*arguments))


@pytest.mark.compiled
@pytest.mark.parametrize("kind", ["late", "jitter", "lost", "stopped"])
def test_whatever_happens_to_commands_the_bar_is_held(tmp_path, kind):
    """At random instants of a sea, at rates of an ordinary computer."""
    wall = wall_of(tmp_path, "calm", *slow_overrides(), "safety.watchdog=2", "safety.stale_after=2")
    rng = np.random.default_rng(4)
    wall.go(2000)
    for _ in range(5):
        wall.go(int(rng.integers(100, 400)))
        before = wall.parts.plant.bar_state[:3].copy()
        assert not wall.dog.safe
        wall.way = drawn(kind, wall.lateness, rng)
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
def test_of_a_force_controller_in_its_safe_state_late_torques_are_not_needed(tmp_path):
    """Of a scenario that allows any age; torques of `hold` that are 0.1 s late fling the bar."""
    waits = [f"safety.{key}=10" for key in ("stale_after", "watchdog", "lateness")]
    ways = {}
    for told in (True, False):
        wall = wall_of(tmp_path, "calm", *slow_overrides(), *waits)
        wall.way = lambda _: 100 * MS
        if not told:
            wall.plant.receive_safe = lambda _: None
        wall.go(2000)
        before = wall.parts.plant.bar_state[:3].copy()
        wall.force.alarm(wall.now, "emergency stop set")
        places, _ = wall.go(600)
        ways[told] = np.linalg.norm(places - before, axis=1).max()
        # The plant has no reason of its own.
        assert not wall.dog.safe
    assert ways[True] < SAG < ways[False]


@pytest.mark.compiled
@pytest.mark.slow
def test_at_full_rates_in_the_steep_sea_too(tmp_path):
    wall = wall_of(tmp_path, "worst_case_steep")
    rng = np.random.default_rng(2)
    wall.go(4_000)
    for kind in ("late", "stopped", "lost"):
        wall.go(2_000 + int(rng.integers(500, 1500)))
        before = wall.parts.plant.bar_state[:3].copy()
        wall.way = drawn(kind, wall.lateness, rng)
        wall.until_safe(300)
        places, _ = wall.go(2000)
        assert np.abs(places - before)[:, 2].max() < SAG
        wall.take_up()


@pytest.mark.compiled
def test_within_the_margin_nothing_trips_and_the_bar_follows(tmp_path):
    wall = wall_of(tmp_path, "calm", *slow_overrides())
    assert wall.lateness == pytest.approx(32.4 * MS, rel=0.01)
    wall.way = lambda _: 15 * MS
    places, _ = wall.go(3000)
    assert not wall.dog.safe
    prompt, _ = wall_of(tmp_path, "calm", *slow_overrides()).go(3000)
    assert np.ptp(prompt, axis=0).max() > 0.5
    assert np.abs(places - prompt).max() < 0.05


@pytest.mark.compiled
def test_a_late_controller_falls_silent_and_says_so(tmp_path):
    """Of one that gets no tensions: it sends nothing, neither a torque nor that of `hold`."""
    wall = wall_of(tmp_path, "rest", *slow_overrides())
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
