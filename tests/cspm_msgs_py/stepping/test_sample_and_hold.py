"""A node's part in real time: when it computes, on what, and what it says of lateness."""

import numpy as np
import pytest
from run_samples import bundle_of

from cspm_control.safety import GuardedStage
from cspm_control.stages.make import make_controller
from cspm_msgs_py.diagnostics import Level, Status
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.schedule import (
    BAR_POSE,
    BAR_REFERENCE,
    DIAGNOSTICS_RATE,
    FORCE_CONTROLLER,
    FRAME_POSE,
    MOTION_CONTROLLER,
    TENSION,
    TENSION_COMMAND,
    TENSION_DISTRIBUTION,
    TORQUE_COMMAND,
    WAVE_TRAJECTORY,
    WINCH_STATE,
    WRENCH,
    schedule_of,
)
from cspm_msgs_py.stepping.admission import AHEAD_NS
from cspm_msgs_py.stepping.sample_and_hold import SampleAndHold, WallTrajectory

MS = 1_000_000
# A wall clock's present, far from the zero at which lockstep begins.
NOW = 1_800_000_000_000 * MS
N = 8


def at(ms):
    """Return the time [ns] so many ms after `NOW`."""
    return NOW + round(ms * MS)


class Recorder:
    """A stage that notes what it is given, and a guard that notes what it is given."""

    brake = safe = False

    def __init__(self, node, output):
        self.node, self.output = node, output
        self.steps, self.trips, self.watched = [], [], []

    def step(self, now_ns, inputs, send):
        self.steps.append((now_ns, {name: row.copy() for name, row in inputs.items()}))
        send(self.output, np.zeros(1))

    def status(self):
        return Status(Level.OK, self.node, "ok", {"own": "1"})

    def trip(self, now_ns, reason):
        self.trips.append((now_ns, reason))

    def watch(self, now_ns, ages_ns, send, inputs=None):
        self.watched.append((now_ns, dict(ages_ns), set(inputs)))


class Part:
    """A node's part with a noting stage; times in ms after `NOW`."""

    def __init__(
        self,
        node,
        *overrides,
        output=None,
        guarded=False,
        stale_after=0.05,
        stage=None,
        plausibility=None,
    ):
        bundle = bundle_of("rest", *overrides)
        self.schedule = schedule_of(bundle.scenario, bundle.testbed.testbed)
        plan = self.schedule.nodes[node]
        self.stage = stage or Recorder(node, plan.outputs[0])
        self.sent, self.reported = [], []
        self.part = SampleAndHold(
            self.stage,
            self.schedule,
            stale_after,
            {plan.outputs[0]: lambda log, stamp, row: self.sent.append((stamp, row))},
            lambda stamp, status: self.reported.append((stamp, status)),
            self.stage if guarded else None,
            plausibility=plausibility,
        )

    def receive(self, topic, at_ms, late_ms=0.0, row=None):
        stamp = at(at_ms)
        row = np.zeros(N) if row is None else row
        self.part.receive(topic, stamp, row, stamp + round(late_ms * MS))

    def tick(self, at_ms):
        self.part.tick(at(at_ms))

    @property
    def stamps_ms(self):
        return [(stamp - NOW) / MS for stamp, _ in self.sent]

    def status(self, at_ms):
        """Return what it says when it is asked to at a time."""
        self.part._status_due = 0
        self.tick(at_ms)
        return self.reported[-1][1]


def motion(*overrides, **arguments):
    return Part(MOTION_CONTROLLER, *overrides, **arguments)


def test_it_hears_what_came_lately_enough_to_compute_on():
    part = motion(stale_after=0.05)
    assert part.part.hears([], at(0.0))
    part.receive(BAR_POSE, 0.0)
    assert part.part.hears([BAR_POSE], at(59.9))
    # As old as a period of the topic and 50 ms.
    assert not part.part.hears([BAR_POSE], at(60.1))
    assert not part.part.hears([BAR_POSE, FRAME_POSE], at(0.0))
    part.receive(BAR_POSE, 60.0)
    assert part.part.hears([BAR_POSE], at(60.1))


class Doubt:
    """Believes no row that begins with a negative number, and notes whether the run was on."""

    def __init__(self):
        self.running = []

    def fault(self, topic, stamp_ns, row, rows, *, running):
        self.running.append(running)
        return f"{topic}: {row[0]:g}" if row[0] < 0 else None


def test_what_cannot_be_true_is_refused_and_not_heard():
    part = motion(plausibility=Doubt())
    part.receive(BAR_POSE, 0.0)
    with pytest.raises(InputError, match=r"^/bar/pose: -1$"):
        part.receive(BAR_POSE, 10.0, row=np.full(7, -1.0))
    assert not part.part.hears([BAR_POSE], at(10.0))
    part.receive(BAR_REFERENCE, 11.0)
    assert part.sent == []
    part.receive(BAR_POSE, 20.0)
    assert part.part.hears([BAR_POSE], at(20.0))
    assert part.stamps_ms == [20.0]


def test_the_guard_holds_by_no_state_that_cannot_be_true():
    part = Part(FORCE_CONTROLLER, guarded=True, plausibility=Doubt())
    part.receive(WINCH_STATE, 0.0)
    part.tick(1.0)
    assert WINCH_STATE in part.stage.watched[-1][2]
    with pytest.raises(InputError, match=r"^/winches/state: -1$"):
        part.receive(WINCH_STATE, 2.0, row=np.full(3 * N, -1.0))
    part.tick(3.0)
    assert WINCH_STATE not in part.stage.watched[-1][2]
    part.receive(WINCH_STATE, 4.0)
    part.tick(5.0)
    assert WINCH_STATE in part.stage.watched[-1][2]


def test_numbers_are_judged_by_whether_the_run_is_on():
    doubt = Doubt()
    part = motion(plausibility=doubt)
    part.receive(BAR_POSE, 0.0)
    part.part.start(at(1.0))
    part.receive(BAR_POSE, 10.0)
    part.part.note_safe(True)
    part.receive(BAR_POSE, 20.0)
    assert doubt.running == [False, True, False]


# When it computes


def test_the_first_input_triggers_once_all_are_there():
    part = motion()
    part.receive(BAR_POSE, 0.0)
    assert part.sent == []
    part.receive(BAR_REFERENCE, 1.0)
    # The reference does not trigger: the pose does.
    assert part.sent == []
    part.receive(BAR_POSE, 10.0, late_ms=0.3)
    assert part.stamps_ms == [10.0]
    now, rows = part.stage.steps[0]
    assert now == at(10.3)
    assert set(rows) == {BAR_POSE, BAR_REFERENCE}


def test_force_controllers_follow_the_tensions_not_what_is_wanted():
    part = Part(FORCE_CONTROLLER)
    part.receive(TENSION, 0.0)
    part.receive(TENSION_COMMAND, 0.5)
    part.receive(WINCH_STATE, 0.6)
    assert part.sent == []
    part.receive(TENSION, 1.0)
    part.receive(TENSION_COMMAND, 1.5)
    part.receive(TENSION, 2.0)
    assert part.stamps_ms == [1.0, 2.0]
    assert set(part.stage.steps[-1][1]) == {TENSION, TENSION_COMMAND, WINCH_STATE}


def test_it_computes_on_the_latest_and_holds_what_does_not_come():
    part = motion()
    part.receive(BAR_REFERENCE, 0.0, row=np.array([1.0]))
    part.receive(BAR_POSE, 0.0, row=np.array([2.0]))
    part.receive(BAR_REFERENCE, 1.0, row=np.array([3.0]))
    part.receive(BAR_POSE, 10.0, row=np.array([4.0]))
    part.receive(BAR_POSE, 20.0, row=np.array([5.0]))
    seen = [(rows[BAR_REFERENCE][0], rows[BAR_POSE][0]) for _, rows in part.stage.steps]
    assert seen == [(1.0, 2.0), (3.0, 4.0), (3.0, 5.0)]


@pytest.mark.parametrize("sensor", [100, 200, 500, 1000])
@pytest.mark.parametrize("jitter", [0.0, 0.2])
def test_a_faster_sensor_is_decimated_to_the_controllers_rate(sensor, jitter):
    part = motion(f"rates={{motion_capture: {sensor}}}")
    rng = np.random.default_rng(sensor)
    interval = 1e3 / sensor
    times = np.arange(sensor) * interval + jitter * interval * rng.uniform(-1.0, 1.0, sensor)
    part.receive(BAR_REFERENCE, times[0])
    for time in times:
        part.receive(BAR_REFERENCE, time)
        part.receive(BAR_POSE, time)
    # A second of messages, of which the controller's 100 Hz are computed.
    assert len(part.sent) == 100
    assert np.diff(part.stamps_ms).min() > 10.0 - (0.5 + 2.0 * jitter) * interval
    assert part.part.late == 0


def test_where_the_sensor_is_slower_a_timer_computes():
    part = motion("rates={motion_capture: 50}")
    part.receive(BAR_REFERENCE, 0.0)
    part.tick(0.0)
    assert part.sent == []
    part.receive(BAR_POSE, 0.0)
    assert part.sent == []
    for time in (1.0, 11.0, 21.0):
        part.tick(time)
    # Stamped with the instant of computing: the pose is 21 ms old by then.
    assert part.stamps_ms == [1.0, 11.0, 21.0]


def test_where_a_message_triggers_the_timer_does_not():
    part = motion()
    part.receive(BAR_REFERENCE, 0.0)
    part.receive(BAR_POSE, 0.0)
    part.tick(5.0)
    part.tick(15.0)
    assert part.stamps_ms == [0.0]


def test_equal_stamps_are_ignored():
    part = motion()
    part.receive(BAR_REFERENCE, 0.0)
    part.receive(BAR_POSE, 0.0, row=np.array([1.0]))
    part.receive(BAR_POSE, 0.0, row=np.array([2.0]))
    assert len(part.sent) == 1
    part.receive(BAR_POSE, 10.0, row=np.array([3.0]))
    assert [rows[BAR_POSE][0] for _, rows in part.stage.steps] == [1.0, 3.0]
    assert part.part.refused == (0, "")


# Late


@pytest.mark.parametrize(("late_ms", "late"), [(0.0, 0), (9.9, 0), (10.0, 0), (10.1, 1), (35.0, 1)])
def test_what_begins_more_than_a_period_late_is_counted(late_ms, late):
    part = motion()
    part.receive(BAR_REFERENCE, 0.0)
    part.receive(BAR_POSE, 0.0, late_ms=late_ms)
    assert len(part.sent) == 1
    assert part.part.late == late
    found = part.status(50.0)
    assert found.values["deadlines_missed"] == str(late)
    assert found.values["worst_latency_ms"] == f"{late_ms:.3f}"
    # The worst since the last time that it was reported.
    assert part.status(51.0).values["worst_latency_ms"] == "0.000"


@pytest.mark.parametrize(("at_ms", "late"), [(10.0, 0), (14.0, 0), (20.0, 1), (50.0, 4)])
def test_periods_without_computation_are_counted(at_ms, late):
    part = motion()
    part.receive(BAR_REFERENCE, 0.0)
    part.receive(BAR_POSE, 0.0)
    part.receive(BAR_REFERENCE, at_ms)
    part.receive(BAR_POSE, at_ms)
    assert part.part.late == late


def test_the_sensors_own_delay_is_not_late():
    # 20 ms of processing in the cameras, twice the controller's period.
    testbed = bundle_of("rest").testbed.testbed
    slow = testbed.sensors[BAR_POSE].model_copy(update={"delay": 0.02})
    delayed = testbed.model_copy(update={"sensors": testbed.sensors | {BAR_POSE: slow}})
    bundle = bundle_of("rest")
    schedule = schedule_of(bundle.scenario, delayed)
    stage, sent = Recorder(MOTION_CONTROLLER, WRENCH), []
    part = SampleAndHold(
        stage, schedule, 0.05, {WRENCH: lambda *reported: sent.append(reported)}, lambda *_: None
    )
    reference = NOW + 100 * MS
    part.receive(BAR_REFERENCE, reference, np.zeros(1), reference)
    part.receive(BAR_POSE, NOW + 80 * MS, np.zeros(1), NOW + 110 * MS)
    assert (len(sent), part.late) == (1, 0)
    part.receive(BAR_POSE, NOW + 90 * MS, np.zeros(1), NOW + 121 * MS)
    assert (len(sent), part.late) == (2, 1)
    # Stale from 50 ms after the next was due: 80 ms after the stamp.
    late = at(200)
    part.receive(BAR_REFERENCE, late, np.zeros(1), late)
    part.receive(BAR_POSE, late - 80 * MS, np.zeros(1), late)
    assert (len(sent), part.stale) == (3, 0)
    part.receive(BAR_POSE, late - 70 * MS, np.zeros(1), late + 11 * MS)
    assert (len(sent), part.stale) == (3, 1)


# Stale


@pytest.mark.parametrize(("age_ms", "stale"), [(0.0, 0), (51.0, 0), (51.1, 1), (500.0, 1)])
def test_on_a_stale_input_nothing_is_computed(age_ms, stale):
    part = motion()
    # References come every millisecond: one is stale 50 ms after the next was due.
    part.receive(BAR_REFERENCE, 0.0)
    part.receive(BAR_POSE, age_ms)
    assert len(part.sent) == 1 - stale
    assert part.part.stale == stale
    found = part.status(age_ms)
    assert found.values["stale_inputs"] == str(stale)
    said = (Level.STALE, f"stale input: {BAR_REFERENCE}") if stale else (Level.OK, "ok")
    assert (found.level, found.message) == said


def test_a_stale_pose_stops_the_timer_too():
    part = motion("rates={motion_capture: 50}")
    part.receive(BAR_REFERENCE, 0.0)
    part.receive(BAR_POSE, 0.0)
    for time in range(1, 201, 10):
        part.receive(BAR_REFERENCE, time)
        part.tick(time)
    # Every 20 ms it is due, 50 ms it may be late.
    assert part.stamps_ms == [1.0, 11.0, 21.0, 31.0, 41.0, 51.0, 61.0]
    assert part.part.stale == 13


def test_it_goes_on_when_the_input_comes_again():
    part = motion()
    for time in (0.0, 100.0):
        part.receive(BAR_REFERENCE, 0.0)
        part.receive(BAR_POSE, time)
    assert len(part.sent) == 1
    part.receive(BAR_REFERENCE, 110.0)
    part.receive(BAR_POSE, 110.0)
    assert part.stamps_ms == [0.0, 110.0]


def test_only_inputs_that_it_cannot_do_without_silence_it():
    part = Part(TENSION_DISTRIBUTION)
    part.receive(FRAME_POSE, 0.0)
    for time in (500.0, 510.0):
        part.receive(BAR_POSE, time)
        part.receive(WRENCH, time)
    assert part.stamps_ms == [500.0, 510.0]
    assert part.part.stale == 0


# Stamps that cannot be


def test_stamps_that_go_back_are_refused():
    part = motion()
    part.receive(BAR_REFERENCE, 0.0)
    part.receive(BAR_POSE, 20.0)
    with pytest.raises(InputError) as error:
        part.receive(BAR_POSE, 10.0)
    assert str(error.value) == (
        f"{BAR_POSE}: stamp went back from {(NOW + 20 * MS) * 1e-9:.3f} s to"
        f" {(NOW + 10 * MS) * 1e-9:.3f} s: a restarted clock or a second sender"
    )
    assert part.stamps_ms == [20.0]
    # The good ones go on, and each topic has its own clock.
    part.receive(BAR_REFERENCE, 15.0)
    part.receive(BAR_POSE, 30.0)
    assert part.stamps_ms == [20.0, 30.0]


@pytest.mark.parametrize("ahead_ms", [0.0, 50.0])
def test_clocks_may_differ_a_little(ahead_ms):
    part = motion()
    part.receive(BAR_REFERENCE, 0.0)
    part.receive(BAR_POSE, 0.0, late_ms=-ahead_ms)
    assert len(part.sent) == 1
    # Never a negative age.
    assert part.status(0.0).values["worst_latency_ms"] == "0.000"


def test_stamps_of_the_future_are_refused():
    part = motion()
    part.receive(BAR_REFERENCE, 0.0)
    with pytest.raises(InputError) as error:
        part.receive(BAR_POSE, 1000.0, late_ms=-1000.0)
    assert str(error.value) == f"{BAR_POSE}: stamp 1.000 s in the future, allowed: 0.05 s"
    assert AHEAD_NS == 50 * MS
    assert part.sent == []
    # It did not spoil what comes after.
    part.receive(BAR_POSE, 10.0)
    assert part.stamps_ms == [10.0]


def test_what_was_refused_is_reported():
    part = motion()
    part.receive(BAR_REFERENCE, 0.0)
    part.receive(BAR_POSE, 0.0)
    assert part.status(1.0)[:3] == (Level.OK, MOTION_CONTROLLER, "ok")
    part.part.refuse(NOW, "one reason")
    part.part.refuse(NOW, "another reason")
    found = part.status(2.0)
    assert (found.level, found.message) == (Level.WARN, "refused: another reason")
    assert found.values["refused"] == "2"


# The guard


def force(**arguments):
    part = Part(FORCE_CONTROLLER, guarded=True, **arguments)
    part.receive(TENSION_COMMAND, 0.0)
    part.receive(WINCH_STATE, 0.0)
    part.receive(TENSION, 0.0)
    return part


def test_the_guard_is_called_in_every_period_with_the_ages_and_the_rows():
    part = force()
    part.tick(0.0)
    part.receive(TENSION, 1.0)
    part.tick(3.5)
    assert part.stage.watched == [
        (NOW, dict.fromkeys(part.part._rows, 0), set(part.part._rows)),
        (
            at(3.5),
            {TENSION: 2_500_000, TENSION_COMMAND: 3_500_000, WINCH_STATE: 3_500_000},
            {TENSION, TENSION_COMMAND, WINCH_STATE},
        ),
    ]


def test_before_anything_was_commanded_no_input_is_missed():
    part = Part(FORCE_CONTROLLER, guarded=True)
    part.receive(TENSION, 0.0)
    part.receive(WINCH_STATE, 0.0)
    part.tick(5000.0)
    assert part.stage.watched == [(NOW + 5000 * MS, {}, {TENSION, WINCH_STATE})]
    found = part.status(5001.0)
    assert (found.level, found.message) == (Level.STALE, f"waits for {TENSION_COMMAND}")


def test_a_guarded_stage_computes_on_stale_inputs_and_is_given_their_age():
    part = force()
    part.receive(TENSION, 500.0)
    assert len(part.stage.steps) == 2
    assert part.part.stale == 0
    part.tick(500.0)
    assert part.stage.watched[-1][1][TENSION_COMMAND] == 500 * MS
    found = part.status(501.0)
    assert (found.level, found.message) == (Level.STALE, f"stale input: {TENSION_COMMAND}")


def test_what_cannot_be_used_trips_the_guard():
    part = force()
    part.part.refuse(NOW + 7 * MS, "a reason")
    assert part.stage.trips == [(NOW + 7 * MS, "a reason")]
    assert part.part.refused == (1, "a reason")


@pytest.mark.parametrize("by", ["tick", "message"])
@pytest.mark.parametrize(("still_ms", "trips"), [(1, 0), (50, 0), (51, 1), (5000, 1)])
def test_a_standstill_of_the_node_itself_trips_the_guard(by, still_ms, trips):
    part = force()
    part.tick(0.5)
    if by == "tick":
        part.tick(0.5 + still_ms)
    else:
        # What waited in its queue looks good, from one instant to the next.
        part.receive(TENSION_COMMAND, 1.0, late_ms=still_ms - 0.5)
        part.receive(TENSION, 1.0, late_ms=still_ms - 0.5)
    assert len(part.stage.trips) == trips
    if trips:
        assert part.stage.trips[0][1] == f"stood still for {still_ms} ms, allowed: 50 ms"
        # Once it is awake it goes on.
        part.tick(1.5 + still_ms)
        assert len(part.stage.trips) == 1


def test_before_it_commanded_a_node_may_stand_still():
    part = Part(FORCE_CONTROLLER, guarded=True)
    part.tick(0.0)
    part.tick(5000.0)
    assert part.stage.trips == []


def test_without_a_guard_nothing_is_watched():
    part = motion()
    part.receive(BAR_POSE, 0.0)
    part.tick(1.0)
    part.part.refuse(NOW, "a reason")
    assert part.stage.watched == part.stage.trips == []


def test_an_error_of_the_stage_is_not_covered():
    part = force()
    part.stage.status = lambda: Status(Level.ERROR, FORCE_CONTROLLER, "safe state", {})
    part.tick(900.0)
    found = part.status(1000.0)
    assert (found.level, found.message) == (Level.ERROR, "safe state")


def test_the_real_guard_holds_within_a_period_of_staleness_and_its_stamps_never_go_back():
    bundle = bundle_of("rest")
    stage = make_controller(FORCE_CONTROLLER, bundle.scenario, bundle.testbed.testbed)
    assert isinstance(stage, GuardedStage)
    part = Part(FORCE_CONTROLLER, guarded=True, stage=stage)
    rows = {TENSION_COMMAND: np.full(N, 5.0), TENSION: np.full(N, 5.0)}
    rows[WINCH_STATE] = np.zeros(3 * N)
    for topic in (TENSION_COMMAND, WINCH_STATE):
        part.receive(topic, 0.0, row=rows[topic])
    # Wanted tensions end at 0 ms; tensions come late, between the guard's ticks.
    for k in range(100):
        part.receive(WINCH_STATE, k + 0.01, row=rows[WINCH_STATE])
        part.receive(TENSION, k + 0.01, late_ms=0.7, row=rows[TENSION])
        part.tick(k + 0.99)
    assert (np.diff([stamp for stamp, _ in part.sent]) > 0).all()
    assert stage.safe
    reason = stage.status().values["reason"]
    assert reason == f"{TENSION_COMMAND} stale: 51 ms old, allowed: 50 ms"
    assert stage._latch.since_ns == at(50.99)
    # A torque in every period before and after.
    assert np.diff(part.stamps_ms).max() < 1.5


# Diagnostics


def test_it_reports_ten_times_a_second():
    part = motion()
    for time in range(1000):
        part.tick(time)
    assert len(part.reported) == DIAGNOSTICS_RATE
    assert {status.message for _, status in part.reported} == {
        f"waits for {BAR_POSE}, {BAR_REFERENCE}"
    }
    assert part.reported[0][1].values["own"] == "1"


# Prescribed torques


def rig(*overrides):
    bundle = bundle_of("one_winch", *overrides)
    testbed = bundle.testbed.testbed
    stage = make_controller(FORCE_CONTROLLER, bundle.scenario, testbed)
    schedule = schedule_of(bundle.scenario, testbed)
    sent = []
    part = SampleAndHold(
        stage,
        schedule,
        0.05,
        {TORQUE_COMMAND: lambda log, stamp, row: sent.append((stamp, row))},
        lambda *_: None,
        stage,
    )
    return bundle, stage, part, sent


def test_prescribed_torques_follow_the_time_since_the_start():
    bundle, stage, part, sent = rig()
    part.tick(NOW)
    assert sent == []
    start = NOW + 200 * MS
    stage.start(start)
    part.start(start)
    part.tick(start - 1)
    assert sent == []
    for k in range(500):
        part.tick(start + k * MS)
    assert [stamp for stamp, _ in sent] == [start + k * MS for k in range(500)]
    signal = bundle.scenario.control.torque["surge"]
    for k in (0, 137, 499):
        expected = signal.offset + sum(
            s.amplitude * np.sin(2.0 * np.pi * s.frequency * k * 1e-3 + s.phase)
            for s in signal.sines
        )
        assert sent[k][1] == pytest.approx([expected], rel=1e-12)
    assert part.late == 0
    # Six periods pass without a call.
    part.tick(start + 506 * MS)
    assert part.late == 6


def test_prescribed_torques_end_in_the_safe_state_when_the_winches_fall_silent():
    _, stage, part, sent = rig()
    stage.start(NOW)
    part.start(NOW)
    part.receive(WINCH_STATE, NOW, np.zeros(3), NOW)
    for k in range(51):
        part.tick(NOW + k * MS)
    assert not stage.safe
    part.tick(NOW + 51 * MS)
    assert stage.safe
    assert len(sent) == 52


# The wave trajectory


class Waves:
    node = WAVE_TRAJECTORY

    def step(self, now_ns, inputs, send):
        send(BAR_REFERENCE, np.array([now_ns]))

    def status(self):
        return Status(Level.OK, self.node, "ok", {})


def wall(*overrides):
    bundle = bundle_of("rest", *overrides)
    schedule = schedule_of(bundle.scenario, bundle.testbed.testbed)
    sent, reported = [], []
    publish = {BAR_REFERENCE: lambda log, stamp, row: sent.append((stamp, row[0]))}
    part = WallTrajectory(Waves(), schedule, publish, lambda _, status: reported.append(status))
    return part, sent, reported


def test_references_begin_at_the_start_and_carry_the_instants_due():
    part, sent, reported = wall("rates={wave_trajectory: 100}")
    part.tick(NOW)
    assert reported[-1].message == "waits for the start"
    part.start(NOW + 100 * MS)
    part.tick(NOW + 99 * MS)
    assert sent == []
    for k in range(200):
        part.tick(NOW + 100 * MS + k * 5 * MS + 2 * MS)
    assert [stamp for stamp, _ in sent] == [NOW + (100 + 10 * k) * MS for k in range(100)]
    assert [at for _, at in sent] == [10 * MS * k for k in range(100)]
    assert part.late == 0
    assert reported[-1].message == "ok"
    assert reported[-1].values["worst_latency_ms"] == "2.000"


def test_references_that_are_late_are_left_out_and_counted():
    part, sent, reported = wall("rates={wave_trajectory: 100}")
    part.start(NOW)
    for time in (0, 10, 57, 60):
        part.tick(at(time))
    assert [(stamp - NOW) // MS for stamp, _ in sent] == [0, 10, 50, 60]
    assert part.late == 3
    part.tick(NOW + 100 * MS)
    assert reported[-1].values["deadlines_missed"] == "6"


def test_motions_that_run_are_not_started_again():
    part, sent, _ = wall("rates={wave_trajectory: 100}")
    part.start(NOW)
    part.tick(NOW)
    part.start(NOW - 5000 * MS)
    part.tick(NOW + 10 * MS)
    assert sent == [(NOW, 0), (NOW + 10 * MS, 10 * MS)]
