"""The file's `safety`, the latch, and prescribed torques that may be tripped."""

import numpy as np
import pytest
from run_samples import SCENARIOS, bundle_of

from cspm_control.safety import check_real_time
from cspm_control.stages.make import make_controller
from cspm_msgs_py.diagnostics import Level, Status
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.safety_spec import Safety
from cspm_msgs_py.scenario import parse_scenario
from cspm_msgs_py.schedule import FORCE_CONTROLLER, TORQUE_COMMAND, WINCH_STATE, schedule_of
from cspm_msgs_py.stepping.latch import MOST_LISTED, Latch

MS = 1_000_000
PLAIN = "name: plain\ntestbed: none.yaml\nduration: 1.0\n"


def safety(text):
    return parse_scenario(f"{PLAIN}safety: {text}\n", "my.yaml").safety


# The file


def test_what_a_scenario_does_that_says_nothing_about_safety():
    expected = Safety(state="hold", ramp_time=0.5, stale_after=0.05, watchdog=0.05)
    assert parse_scenario(PLAIN, "my.yaml").safety == expected
    assert expected.tension_trip is None
    assert expected.torque_slew is None


@pytest.mark.parametrize(
    ("key", "good", "bad", "allowed"),
    [
        ("state", ["hold", "brake"], "drop", "'hold' or 'brake'"),
        ("ramp_time", [0.0, 10.0], -0.1, "greater than or equal to 0"),
        ("ramp_time", [0.5], 10.1, "less than or equal to 10"),
        ("stale_after", [0.001, 10.0], 0.0, "greater than 0"),
        ("stale_after", [0.05], 11, "less than or equal to 10"),
        ("watchdog", [0.001, 10.0], 0.0, "greater than 0"),
        ("watchdog", [0.05], 11, "less than or equal to 10"),
        ("lateness", ["null", 0.001, 10.0], 0.0, "greater than 0"),
        ("tension_trip", ["null", 0.1, 1e4], 0.0, "greater than 0"),
        ("torque_slew", ["null", 0.1, 1e4], -1.0, "greater than 0"),
    ],
)
def test_bounds_of_the_file(key, good, bad, allowed):
    for value in good:
        found = getattr(safety(f"{{{key}: {value}}}"), key)
        assert found == (None if value == "null" else value)
    with pytest.raises(InputError) as caught:
        safety(f"{{{key}: {bad}}}")
    shown = f"'{bad}'" if isinstance(bad, str) else bad
    assert str(caught.value) == f"my.yaml: safety.{key}: {shown}, allowed: {allowed}"


def test_a_recorded_scenario_says_its_safe_state():
    text = bundle_of("rest", "safety.state=brake").attachments()["scenario.yaml"]
    text = text.decode() if isinstance(text, bytes) else text
    assert parse_scenario(text, "recorded").safety == Safety(state="brake")


# The latch


def test_a_latch_keeps_the_first_reason_and_lists_the_others():
    latch = Latch()
    assert not latch.open
    latch.trip(5 * MS, "first")
    for reason in ("second", "first", "second", "third"):
        latch.trip(6 * MS, reason)
    assert (latch.open, latch.reason, latch.since_ns, latch.further) == (True, "first", 5 * MS, 4)
    status = latch.status("hold", Status(Level.OK, "part", "ok", {"share": "0"}))
    assert status.level == Level.ERROR
    assert status.name == "part"
    assert status.message == "safe state hold since 0.005 s: first"
    assert status.values == {
        "share": "0",
        "state": "hold",
        "reason": "first",
        "further_reasons": "4",
        "further": "second; third",
    }


def test_a_closed_latch_leaves_a_status_as_it_is():
    found = Latch().status("hold", Status(Level.WARN, "part", "hm", {"share": "1"}))
    assert found[:3] == (Level.WARN, "part", "hm")
    assert found.values == {
        "share": "1",
        "state": "running",
        "reason": "",
        "further_reasons": "0",
    }


def test_a_latch_lists_a_few_reasons_and_counts_all():
    latch = Latch()
    for k in range(100):
        latch.trip(k, f"reason {k}")
    assert latch.further == 99
    listed = latch.status("hold", Status(Level.OK, "part", "ok", {})).values["further"]
    assert listed.split("; ") == [f"reason {k}" for k in range(1, MOST_LISTED + 1)]


def test_a_lasting_fault_counts_once_and_refuses_the_release_while_it_lasts():
    latch = Latch()
    for age in (51, 52, 53):
        latch.stand(age, "a", f"a is {age} ms old")
    assert latch.reason == "a is 51 ms old"
    assert latch.further == 0
    latch.stand(60, "b", "b is wrong")
    assert latch.further == 1
    assert latch.release() == "reset refused: a is 53 ms old (and 1 more)"
    latch.stand(61, "a", None)
    assert not latch.stands("a")
    assert latch.stands("b")
    assert latch.release() == "reset refused: b is wrong"
    assert latch.open
    latch.stand(62, "b", None)
    assert latch.open
    assert latch.release() is None
    assert not latch.open
    # It comes again, and counts again.
    latch.stand(70, "b", "b again")
    assert (latch.reason, latch.further) == ("b again", 0)


# Real time


@pytest.mark.parametrize(
    ("overrides", "line"),
    [
        ([], None),
        (["safety.stale_after=0.02"], None),
        (
            ["safety.stale_after=0.019"],
            "safety.stale_after: 0.019 s, allowed in real time: at least 0.02 s, two periods of"
            " /tension_command",
        ),
        (
            ["rates.load_cells=25"],
            "safety.stale_after: 0.05 s, allowed in real time: at least 0.08 s, two periods of"
            " /cables/tension",
        ),
        (["rates.force_controller=40"], None),
        (
            ["rates.force_controller=25"],
            "safety.watchdog: 0.05 s, allowed in real time: at least 0.08 s, two periods of"
            " /winches/torque_command",
        ),
        (["control={mode: locked_winches}", "safety.watchdog=0.0001"], None),
    ],
)
def test_what_comes_in_time_must_not_count_as_late(overrides, line):
    bundle = bundle_of("rest", *overrides)
    schedule = schedule_of(bundle.scenario, bundle.testbed.testbed)
    if line is None:
        check_real_time(bundle.scenario.safety, schedule)
        return
    with pytest.raises(InputError) as caught:
        check_real_time(bundle.scenario.safety, schedule)
    assert str(caught.value) == line


def test_the_library_runs_in_real_time_with_its_own_settings():
    for path in sorted(SCENARIOS.glob("*.yaml")):
        bundle = bundle_of(path.stem)
        schedule = schedule_of(bundle.scenario, bundle.testbed.testbed)
        check_real_time(bundle.scenario.safety, schedule)


# Prescribed torques


class Sent:
    """Keeps the torques that a stage sends."""

    def __init__(self):
        self.torques = []

    def __call__(self, topic, row):
        assert topic == TORQUE_COMMAND
        self.torques.append(row.copy())


def torque_stage(*overrides):
    bundle = bundle_of("one_winch", *overrides)
    return make_controller(FORCE_CONTROLLER, bundle.scenario, bundle.testbed.testbed)


def winch_row(angle=0.0, speed=0.0):
    return {WINCH_STATE: np.array([angle, speed, 0.0])}


def test_prescribed_torques_end_when_they_are_tripped():
    stage, sent = torque_stage(), Sent()
    for k in range(3):
        stage.step(k * MS, winch_row(), sent)
    status = stage.status()
    assert status[:3] == (Level.OK, FORCE_CONTROLLER, "ok")
    assert status.values["state"] == "running"
    stage.trip(3 * MS, "no reason")
    stage.step(3 * MS, winch_row(), sent)
    # First what it was, then less and less.
    np.testing.assert_allclose(sent.torques[3], sent.torques[2], rtol=1e-12)
    for k in range(4, 600):
        stage.step(k * MS, winch_row(), sent)
    assert (np.diff(np.ravel(sent.torques[3:])) <= 0.0).all()
    assert sent.torques[-1][0] == 0.0
    assert stage.status().message == "safe state hold since 0.003 s: no reason"
    assert stage.reset(600 * MS) is None
    stage.step(600 * MS, winch_row(), sent)
    assert sent.torques[-1][0] > 0.5


def test_prescribed_torques_that_brake():
    stage, sent = torque_stage("safety.state=brake"), Sent()
    stage.step(0, winch_row(), sent)
    assert not stage.brake
    stage.emergency_stop(MS, True)
    stage.step(MS, winch_row(), sent)
    assert stage.brake
    assert sent.torques[0][0] > 0.5
    assert sent.torques[1][0] == 0.0
    assert stage.reset(2 * MS) == "reset refused: emergency stop set"
    stage.emergency_stop(3 * MS, False)
    assert stage.reset(3 * MS) is None
    assert stage.brake
    stage.step(3 * MS, winch_row(), sent)
    assert not stage.brake
    assert sent.torques[-1][0] > 0.5


def test_a_trip_before_the_first_step_holds_without_a_jerk():
    stage, sent = torque_stage(), Sent()
    stage.trip(0, "early")
    stage.watch(0, {}, sent, winch_row())
    assert sent.torques[0][0] == 0.0


def test_an_input_is_stale_after_the_time_that_the_file_says():
    stage, sent = torque_stage("safety.stale_after=0.05"), Sent()
    stage.step(0, winch_row(), sent)
    stage.watch(50 * MS, {WINCH_STATE: 50 * MS}, sent)
    assert not stage.safe
    stage.watch(51 * MS, {WINCH_STATE: 51 * MS}, sent)
    assert stage.safe
    reason = f"{WINCH_STATE} stale: 51 ms old, allowed: 50 ms"
    assert stage.status().message.endswith(reason)


@pytest.mark.parametrize(("age", "known"), [(50, True), (51, False)])
def test_speeds_are_held_against_for_no_longer_than_that(age, known):
    torques = []
    for speed in (-1.0, 1.0):
        stage, sent = torque_stage("safety.stale_after=0.05"), Sent()
        stage.step(0, winch_row(speed=speed), sent)
        stage.trip(0, "no reason")
        stage.watch(age * MS, {}, sent)
        torques.append(sent.torques[-1][0])
    assert (torques[0] > torques[1]) == known
    assert (torques[0] != torques[1]) == known


# The emergency stop that repeats itself


SILENT = "emergency stop silent for 101 ms, allowed: 100 ms"


def test_an_emergency_stop_that_falls_silent_trips_until_it_is_heard_again():
    stage, sent = torque_stage("safety.stop_heartbeat=0.1"), Sent()
    stage.step(0, winch_row(), sent)
    for now in range(0, 301, 50):
        stage.emergency_stop(now * MS, False)
        stage.watch(now * MS, {}, sent, winch_row())
    stage.watch(400 * MS, {}, sent, winch_row())
    assert not stage.safe
    stage.watch(401 * MS, {}, sent, winch_row())
    assert stage.safe
    assert stage.status().message.endswith(SILENT)
    stage.watch(500 * MS, {}, sent, winch_row())
    assert stage.reset(500 * MS).startswith("reset refused: emergency stop silent for 200 ms")
    stage.emergency_stop(510 * MS, False)
    stage.watch(511 * MS, {}, sent, winch_row())
    assert stage.safe
    assert stage.reset(511 * MS) is None


def test_an_emergency_stop_that_was_never_heard_trips_too():
    stage, sent = torque_stage("safety.stop_heartbeat=0.1"), Sent()
    stage.watch(1000 * MS, {}, sent, winch_row())
    stage.watch(1100 * MS, {}, sent, winch_row())
    assert not stage.safe
    stage.watch(1101 * MS, {}, sent, winch_row())
    assert stage.status().message.endswith(SILENT)


def test_without_a_heartbeat_it_may_be_silent():
    stage, sent = torque_stage(), Sent()
    for now in (0, 10_000, 100_000):
        stage.watch(now * MS, {}, sent, winch_row())
    assert not stage.safe
