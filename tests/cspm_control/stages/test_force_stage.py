"""The guarded force controllers: what they send, when they stop, and what they say about it."""

import numpy as np
import pytest
from run_samples import THESIS_CABLES, bundle_of

from cspm_control.controllers.force_controller import ForceController
from cspm_control.safe_state import balancing_tensions
from cspm_control.stages.make import make_controller
from cspm_model.kernels.cable import RADIUS
from cspm_msgs_py.diagnostics import Level
from cspm_msgs_py.schedule import (
    FORCE_CONTROLLER,
    TENSION,
    TENSION_COMMAND,
    TORQUE_COMMAND,
    WINCH_STATE,
)
from cspm_sim.parameters import plant_parameters

MS = 1_000_000
N = 8
FRESH = {TENSION: MS, TENSION_COMMAND: 9 * MS, WINCH_STATE: MS}
HOLDING = "safe state hold since"


class Bench:
    """A force stage of the thesis's machine with inputs that change nothing until they are set."""

    def __init__(self, *overrides):
        bundle = bundle_of("rest", *overrides)
        self.scenario, self.testbed = bundle.scenario, bundle.testbed.testbed
        self.stage = make_controller(FORCE_CONTROLLER, self.scenario, self.testbed)
        self.radii = plant_parameters(self.testbed).cables[:, RADIUS]
        self.balance = balancing_tensions(self.scenario, self.testbed)
        self.inputs = {
            TENSION_COMMAND: self.balance.copy(),
            TENSION: self.balance.copy(),
            WINCH_STATE: np.zeros(3 * N),
        }
        self.sent = []
        self.now_ms = 0

    def _send(self, topic, row):
        assert topic == TORQUE_COMMAND
        self.sent.append(row.copy())

    def step(self, **rows):
        """Step once, a period after the last; return what was sent then."""
        changed = {
            {"wanted": TENSION_COMMAND, "measured": TENSION, "winches": WINCH_STATE}[k]: v
            for k, v in rows.items()
        }
        before = len(self.sent)
        self.stage.step(self.now_ms * MS, self.inputs | changed, self._send)
        self.now_ms += 1
        return self.sent[before:]

    def watch(self, at_ms=None, **ages_ms):
        """Watch; return what was sent then. Ages of inputs in ms, by the names of `step`."""
        names = {"wanted": TENSION_COMMAND, "measured": TENSION, "winches": WINCH_STATE}
        ages = FRESH | {names[name]: int(age * MS) for name, age in ages_ms.items()}
        before = len(self.sent)
        now = self.now_ms if at_ms is None else at_ms
        self.stage.watch(int(now * MS), ages, self._send, self.inputs)
        return self.sent[before:]

    def controller(self):
        """Return the controllers without guard."""
        gains = self.scenario.control.force.gains
        limits = np.array([cable.torque_limit for cable in self.testbed.cables])
        return ForceController(
            [gains[name] for name in self.testbed.cable_names], self.radii, limits, period=1e-3
        )

    def reason(self):
        return self.stage.status().values["reason"]


@pytest.fixture
def bench():
    return Bench()


def tripped(*overrides):
    bench = Bench(*overrides)
    bench.step()
    bench.stage.trip(MS, "test")
    return bench


def with_one(row, index, value):
    row = row.copy()
    row[index] = value
    return row


# While all is well


def test_unguarded_torques_are_those_of_the_controllers_bit_for_bit(bench):
    rng = np.random.default_rng(4)
    alone = bench.controller()
    for _ in range(200):
        wanted, measured = rng.uniform(2.0, 15.0, (2, N))
        winches = rng.normal(size=3 * N)
        (torque,) = bench.step(wanted=wanted, measured=measured, winches=winches)
        np.testing.assert_array_equal(torque, alone.step(wanted, measured))
    assert not bench.stage.safe
    assert not bench.stage.brake


def test_a_machine_that_does_not_report_its_winches_is_controlled_all_the_same(bench):
    del bench.inputs[WINCH_STATE]
    (torque,) = bench.step()
    np.testing.assert_allclose(torque, bench.radii * bench.balance, rtol=1e-12)
    assert not bench.stage.safe


def test_what_it_says_while_all_is_well(bench):
    bench.step()
    found = bench.stage.status()
    assert found[:3] == (Level.OK, FORCE_CONTROLLER, "ok")
    assert found.values == {
        "limited_share": "0.000",
        "slew_share": "0.000",
        "tension_limited_share": "0.000",
        "state": "running",
        "reason": "",
        "further_reasons": "0",
    }


def test_wanted_tensions_stay_within_the_limits_and_it_says_so(bench):
    low, high = np.array([cable.tension_limits for cable in bench.testbed.cables]).T
    alone = bench.controller()
    for wanted in (low, high):
        (torque,) = bench.step(wanted=wanted)
        np.testing.assert_array_equal(torque, alone.step(wanted, bench.balance))
    assert bench.stage.status().values["tension_limited_share"] == "0.000"
    for wanted, meant in ((low - 1e-6, low), (high + 1e9, high)):
        (torque,) = bench.step(wanted=wanted)
        np.testing.assert_array_equal(torque, alone.step(meant, bench.balance))
        bench.step(wanted=bench.balance)
        alone.step(bench.balance, bench.balance)
    found = bench.stage.status()
    assert found.values["tension_limited_share"] == "0.500"
    assert found.level == Level.WARN
    assert not bench.stage.safe


def test_a_wanted_tension_at_fault_is_the_trouble_where_no_torque_is_at_its_limit(bench):
    bench.step()
    lowest = np.full(N, 2.0)
    bench.step(measured=lowest, wanted=with_one(lowest, 0, 1.99))
    found = bench.stage.status()
    assert found.values["limited_share"] == "0.000"
    assert found.message == "tension command beyond the tension limits"


def test_a_torque_at_its_limit_is_said_as_before(bench):
    bench.step()
    bench.step(measured=np.full(N, 14.0), wanted=np.full(N, 2.0))
    found = bench.stage.status()
    assert found[:3] == (Level.WARN, FORCE_CONTROLLER, "torque at its limit")
    assert found.values["limited_share"] == "0.500"
    # Counted anew from there.
    bench.step(measured=np.full(N, 2.0), wanted=np.full(N, 2.0))
    assert bench.stage.status().values["tension_limited_share"] == "0.000"


def test_without_a_slew_limit_a_torque_reverses_at_once(bench):
    limits = np.array([cable.torque_limit for cable in bench.testbed.cables])
    bench.step()
    (high,) = bench.step(wanted=np.full(N, 15.0), measured=np.full(N, 2.0))
    (low,) = bench.step(wanted=np.full(N, 2.0), measured=np.full(N, 14.0))
    assert (high - low)[4:] == pytest.approx(2.0 * limits[4:])
    assert bench.stage.status().values["slew_share"] == "0.000"


def test_a_slew_limit_holds_and_is_counted():
    bench = Bench("safety.torque_slew=20.0")
    (first,) = bench.step(measured=np.full(N, 9.0), wanted=np.full(N, 3.0))
    np.testing.assert_allclose(first, bench.radii * 9.0)  # the start is free
    for k in range(1, 4):
        (torque,) = bench.step(measured=np.full(N, 3.0), wanted=np.full(N, 15.0))
        np.testing.assert_allclose((torque - first)[2:], 0.020 * k, rtol=1e-9)
    assert bench.stage.status().values["slew_share"] == "0.750"
    found = Bench("safety.torque_slew=1e6")
    found.step()
    found.step(measured=np.full(N, 3.0), wanted=np.full(N, 15.0))
    assert found.stage.status().values["slew_share"] == "0.000"


def test_a_slew_limit_alone_is_the_trouble():
    bench = Bench("safety.torque_slew=1.0")
    bench.step()
    bench.step(measured=bench.balance - 0.1)
    found = bench.stage.status()
    assert found.message == "torque slew at its limit"
    assert found.level == Level.WARN


# Faults of the inputs


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"measured": (2, np.nan)}, "/cables/tension: nan N in surge_1, allowed: finite numbers"),
        ({"measured": (0, np.inf)}, "/cables/tension: inf N in hoist_1, allowed: finite numbers"),
        ({"measured": (0, -np.inf)}, "/cables/tension: -inf N in hoist_1, allowed: finite numbers"),
        ({"measured": (7, 30.01)}, "/cables/tension: 30.0 N in sway_4, allowed: at most 30 N"),
        ({"measured": (3, 70.5)}, "/cables/tension: 70.5 N in surge_2, allowed: at most 70 N"),
        ({"wanted": (1, np.nan)}, "/tension_command: nan N of hoist_2, allowed: finite numbers"),
        ({"wanted": (1, -np.inf)}, "/tension_command: -inf N of hoist_2, allowed: finite numbers"),
        ({"winches": (8, np.nan)}, "/winches/state: nan of hoist_1, allowed: finite numbers"),
    ],
)
def test_a_number_that_cannot_be_trips_at_once(bench, change, reason):
    (before,) = bench.step()
    ((name, (index, value)),) = change.items()
    topic = {"wanted": TENSION_COMMAND, "measured": TENSION, "winches": WINCH_STATE}[name]
    (torque,) = bench.step(**{name: with_one(bench.inputs[topic], index, value)})
    assert bench.stage.safe
    assert bench.reason() == reason
    # The safe torque goes on from the last good tensions.
    np.testing.assert_allclose(torque, before, atol=1e-12)


@pytest.mark.parametrize("index", range(N))
def test_a_tension_at_the_trip_is_no_fault(bench, index):
    highest = 2.0 * bench.testbed.cables[index].tension_limits[1]
    bench.step(measured=with_one(bench.balance, index, highest))
    assert not bench.stage.safe
    bench.step(measured=with_one(bench.balance, index, -3.0))
    assert not bench.stage.safe
    bench.step(measured=with_one(bench.balance, index, np.nextafter(highest, np.inf)))
    assert bench.stage.safe


def test_a_trip_of_ones_own_holds_for_all_cables():
    bench = Bench("safety.tension_trip=12.5")
    bench.step(measured=np.full(N, 12.5))
    assert not bench.stage.safe
    bench.step(measured=with_one(np.full(N, 12.5), 5, 12.6))
    assert bench.reason() == "/cables/tension: 12.6 N in sway_2, allowed: at most 12.5 N"


@pytest.mark.parametrize(
    ("rows", "reason"),
    [
        ({"measured": np.ones(7)}, "/cables/tension: a row of shape (7,), allowed: (8,)"),
        ({"wanted": np.ones(9)}, "/tension_command: a row of shape (9,), allowed: (8,)"),
        ({"wanted": np.ones((2, 4))}, "/tension_command: a row of shape (2, 4), allowed: (8,)"),
        ({"winches": np.ones(8)}, "/winches/state: a row of shape (8,), allowed: (24,)"),
        ({"measured": np.zeros(0)}, "/cables/tension: a row of shape (0,), allowed: (8,)"),
    ],
)
def test_a_row_of_the_wrong_width_trips_at_once(bench, rows, reason):
    bench.step()
    (torque,) = bench.step(**rows)
    assert bench.reason() == reason
    assert np.isfinite(torque).all()


def test_a_fault_in_the_first_row_balances(bench):
    (torque,) = bench.step(measured=np.full(N, np.nan))
    np.testing.assert_allclose(torque, bench.radii * bench.balance, rtol=1e-12)


def test_a_clock_that_goes_back_trips_one_that_stops_does_not(bench):
    bench.now_ms = 5000
    bench.step()
    bench.now_ms = 5000
    bench.step()
    assert not bench.stage.safe
    bench.now_ms = 20
    (torque,) = bench.step()
    assert bench.reason() == "clock went back from 5.000 s to 0.020 s"
    assert np.isfinite(torque).all()
    assert bench.stage.status().message == (
        "safe state hold since 0.020 s: clock went back from 5.000 s to 0.020 s"
    )
    bench.step()
    assert bench.stage.reset(21 * MS) is None


# The safe state


def test_a_trip_acts_at_the_next_step_and_stays(bench):
    start = np.full(N, 9.0)
    bench.inputs[TENSION] = start
    bench.step()
    bench.stage.trip(MS, "somebody said so")
    assert bench.stage.safe
    assert len(bench.sent) == 1
    (first,) = bench.step()
    np.testing.assert_allclose(first, bench.radii * start, rtol=1e-12)
    bench.now_ms = 251
    (half,) = bench.step()
    np.testing.assert_allclose(half, bench.radii * (start + bench.balance) / 2.0, rtol=1e-9)
    bench.now_ms = 2000
    (late,) = bench.step(wanted=np.full(N, 15.0))
    np.testing.assert_allclose(late, bench.radii * bench.balance, rtol=1e-12)
    assert not bench.stage.brake


def test_the_first_reason_stays_and_the_others_are_counted(bench):
    bench.step()
    bench.stage.trip(MS, "first")
    bench.stage.trip(2 * MS, "second")
    bench.step(measured=with_one(bench.balance, 0, np.nan))
    bench.step(measured=with_one(bench.balance, 1, np.nan))
    bench.watch(wanted=80)
    bench.watch(wanted=81)
    found = bench.stage.status()
    assert found.level == Level.ERROR
    assert found.name == FORCE_CONTROLLER
    assert found.message == "safe state hold since 0.001 s: first"
    assert found.values["state"] == "hold"
    assert found.values["reason"] == "first"
    assert found.values["further_reasons"] == "3"
    assert found.values["further"] == (
        "second; /cables/tension: nan N in hoist_1, allowed: finite numbers;"
        " /tension_command stale: 80 ms old, allowed: 50 ms"
    )


def test_brake_is_no_torque_with_the_brakes_set():
    bench = tripped("safety.state=brake")
    assert bench.stage.brake
    (torque,) = bench.step()
    np.testing.assert_array_equal(torque, np.zeros(N))
    assert bench.stage.status().message == "safe state brake since 0.001 s: test"
    assert bench.stage.reset(2 * MS) is None
    # Nothing holds the bar before a torque is commanded.
    assert bench.stage.brake
    (torque,) = bench.step()
    assert torque.all()
    assert not bench.stage.brake


def test_hold_sets_the_brakes_only_where_it_does_not_see_the_winches():
    bench = tripped()
    bench.step()
    assert not bench.stage.brake
    blind = tripped()
    del blind.inputs[WINCH_STATE]
    blind.step()
    assert blind.stage.brake
    broken = tripped()
    broken.step(winches=np.full(3 * N, np.nan))
    assert broken.stage.brake
    # Running it needs no brakes, whatever it sees.
    assert not Bench().stage.brake


def test_hold_pulls_the_winches_back():
    bench = tripped()
    (rest,) = bench.step(winches=np.full(3 * N, 2.0))
    (same,) = bench.step(winches=np.full(3 * N, 2.0))
    # The first speeds damp as well, so both are below rest; the angle is where it was.
    np.testing.assert_allclose(rest, same, atol=1e-3)
    row = np.concatenate([np.full(N, 1.9), np.full(2 * N, 2.0)])
    (paid_out,) = bench.step(winches=row)
    assert (paid_out > same).all()


# Watching


def test_an_input_is_stale_only_beyond_what_is_allowed(bench):
    bench.step()
    assert bench.watch(measured=50, wanted=50, winches=50) == []
    assert not bench.stage.safe
    (torque,) = bench.watch(measured=52.3)
    assert bench.stage.safe
    assert bench.reason() == "/cables/tension stale: 53 ms old, allowed: 50 ms"
    np.testing.assert_allclose(torque, bench.radii * bench.balance, rtol=1e-9)


def test_each_input_may_be_stale():
    for name, topic in (
        ("wanted", TENSION_COMMAND),
        ("measured", TENSION),
        ("winches", WINCH_STATE),
    ):
        bench = Bench("safety.stale_after=0.2")
        bench.step()
        bench.watch(**{name: 200})
        assert not bench.stage.safe
        bench.watch(**{name: 201})
        assert bench.reason() == f"{topic} stale: 201 ms old, allowed: 200 ms"
    assert bench.stage.brake  # it was the winches' state


def test_a_stop_takes_two_periods_at_most(bench):
    """The inputs end at 100 ms; whoever watches every period sees the safe torque by 152 ms."""
    bench.now_ms = 100
    bench.step()
    for ms in range(101, 153):
        if bench.watch(ms, measured=ms - 100 + 0.5, wanted=ms - 100 + 0.5):
            break
    assert ms <= 152
    assert bench.stage.safe


def test_where_no_step_comes_watching_sends_the_safe_torques():
    bench = tripped()
    bench.step()
    at = bench.now_ms
    for k in range(20):
        sent = bench.watch(at + k)
        assert len(sent) == 1
    start, end = bench.sent[1], bench.sent[-1]
    np.testing.assert_allclose(start, end, atol=1e-3)
    # Nothing before it is tripped, however long no step comes.
    idle = Bench()
    idle.step()
    assert idle.watch(40) == []


def test_one_instant_has_one_torque():
    bench = tripped()
    bench.now_ms = 1
    assert len(bench.step()) == 1
    assert bench.watch(1) == []
    assert len(bench.watch(2)) == 1
    assert bench.watch(2) == []
    bench.now_ms = 2
    assert bench.step() == []
    assert len(bench.step()) == 1
    # A command that was sent is not taken back within its own instant.
    bench = Bench()
    bench.step()
    bench.stage.trip(0, "test")
    assert bench.watch(0) == []
    assert len(bench.watch(0.1)) == 1


def test_while_steps_come_watching_is_silent():
    bench = tripped()
    for _ in range(10):
        assert len(bench.step()) == 1
        assert bench.watch(bench.now_ms - 1 + 0.4) == []


def test_watching_without_rows_goes_on_with_those_of_the_last_step_while_they_are_fresh():
    bench = tripped()
    bench.step()
    now = bench.now_ms
    sent = []

    def watch(ms):
        bench.stage.watch(ms * MS, {}, lambda topic, row: sent.append(row))

    watch(now + 10)
    assert not bench.stage.brake
    watch(now + 100)
    assert bench.stage.brake
    assert len(sent) == 2


# Back again


def test_reset_of_what_runs_changes_nothing(bench):
    bench.step()
    assert bench.stage.reset(MS) is None
    alone = bench.controller()
    alone.step(bench.balance, bench.balance)
    wanted = bench.balance + 0.1
    np.testing.assert_array_equal(bench.step(wanted=wanted)[0], alone.step(wanted, bench.balance))


@pytest.mark.parametrize("rows", [{"measured": with_one(np.full(N, 5.0), 0, 121.0)}])
def test_reset_is_refused_while_a_tension_is_above_the_trip(bench, rows):
    bench.step()
    bench.step(**rows)
    refused = "reset refused: /cables/tension: 121.0 N in hoist_1, allowed: at most 120 N"
    assert bench.stage.reset(2 * MS) == refused
    assert bench.stage.safe
    bench.step()
    assert bench.stage.reset(3 * MS) is None
    assert not bench.stage.safe


def test_reset_is_refused_while_an_input_is_stale(bench):
    bench.step()
    bench.watch(wanted=60)
    assert (
        bench.stage.reset(2 * MS)
        == "reset refused: /tension_command stale: 60 ms old, allowed: 50 ms"
    )
    bench.watch(wanted=90, measured=70)
    assert bench.stage.reset(3 * MS) == (
        "reset refused: /tension_command stale: 90 ms old, allowed: 50 ms (and 1 more)"
    )
    bench.watch(wanted=50, measured=50)
    assert bench.stage.reset(4 * MS) is None


def test_reset_is_refused_while_the_emergency_stop_is_set(bench):
    bench.step()
    bench.stage.emergency_stop(MS, False)
    assert not bench.stage.safe
    bench.stage.emergency_stop(MS, True)
    assert bench.stage.safe
    bench.step()
    assert bench.reason() == "emergency stop set"
    assert bench.stage.reset(2 * MS) == "reset refused: emergency stop set"
    bench.stage.emergency_stop(3 * MS, False)
    assert bench.stage.safe
    assert bench.stage.reset(4 * MS) is None


def test_a_reset_goes_on_without_a_jerk():
    bench = tripped("safety.torque_slew=1.0")
    for _ in range(100):
        bench.step()
    assert bench.stage.reset(bench.now_ms * MS) is None
    measured = np.linspace(4.0, 11.0, N)
    (torque,) = bench.step(measured=measured, wanted=np.full(N, 7.0))
    np.testing.assert_allclose(torque, bench.radii * measured, rtol=1e-12)
    assert bench.stage.status().values["state"] == "running"


def test_after_a_reset_it_trips_again(bench):
    bench.step()
    bench.stage.trip(MS, "first")
    bench.step()
    assert bench.stage.reset(2 * MS) is None
    bench.inputs[TENSION] = np.full(N, 11.0)
    bench.step()
    bench.stage.trip(3 * MS, "second")
    (torque,) = bench.step()
    # From the present tensions, not from those of the first time.
    np.testing.assert_allclose(torque, bench.radii * 11.0, rtol=1e-12)
    found = bench.stage.status()
    assert found.message == f"{HOLDING} 0.003 s: second"
    assert found.values["further_reasons"] == "0"


def test_the_names_in_its_reasons_are_the_cables():
    assert Bench().testbed.cable_names == THESIS_CABLES
