"""Prescribed motor angles: paths, servos, and the stage that guards them."""

import numpy as np
import pytest
from machines import rig_content
from run_samples import bundle_of, run_to

from cspm_control.controllers.angle_servo import AngleGenerator, AngleServo
from cspm_control.stages.make import make_controller
from cspm_msgs_py.diagnostics import Level
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import AnglePath, AngleProfile, parse_scenario
from cspm_msgs_py.schedule import FORCE_CONTROLLER, TENSION, WINCH_STATE, schedule_of
from cspm_msgs_py.testbed import parse_testbed
from cspm_msgs_py.yaml_file import dump_yaml

MS = 1_000_000
CABLES = ["a", "b"]
POINTS = ((0.0, 0.0), (1.0, 0.0), (3.0, 4.0), (3.5, 4.0), (4.0, 0.0))
SENSORS = {
    "/winches/state": {"noise": [0.0, 0.01, 0.0], "resolution": [1e-3, 0.0, 0.0], "rate": 1000},
    "/cables/tension": {"noise": 0.02, "resolution": 0.005, "rate": 1000},
}


def generator(cycles=1):
    return AngleGenerator({"b": AnglePath(points=POINTS, cycles=cycles)}, CABLES)


@pytest.mark.parametrize(
    ("time", "angle", "rate"),
    [(0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (2.0, 2.0, 2.0), (3.2, 4.0, 0.0), (3.75, 2.0, -8.0)],
)
def test_lines_join_the_points(time, angle, rate):
    for cycles, start in ((1, 0.0), (3, 0.0), (3, 4.0), (3, 8.0)):
        angles, rates = generator(cycles).step(round((start + time) * 1e9))
        np.testing.assert_allclose(angles, [0.0, angle], atol=1e-9)
        np.testing.assert_allclose(rates, [0.0, rate], atol=1e-9)


def test_the_last_angle_stays():
    one = AngleGenerator({"a": AnglePath(points=((0.0, 1.0), (2.0, 3.0)))}, CABLES)
    for time in (2.0, 100.0):
        angles, rates = one.step(round(time * 1e9))
        np.testing.assert_array_equal(angles, [3.0, 0.0])
        np.testing.assert_array_equal(rates, [0.0, 0.0])


def test_a_path_for_no_cable_is_refused():
    with pytest.raises(InputError) as caught:
        AngleGenerator({"c": AnglePath(points=POINTS)}, CABLES)
    assert str(caught.value) == "control.angle.c: no such cable, allowed: a, b"


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (
            {"points": [[0.0, 0.0], [1.0, 1.0], [1.0, 2.0]]},
            "points: times [0.0, 1.0, 1.0], allowed: from 0, each later than the last",
        ),
        ({"points": [[1.0, 0.0]]}, "points: times [1.0], allowed: from 0, each later than"),
        (
            {"points": [[0.0, 0.0], [1.0, 2.0]], "cycles": 2},
            "cycles: 2 of points from 0 to 2 rad, allowed: 1, or points that end where they began",
        ),
        ({"points": []}, "points: "),
        ({"points": [[0.0, 0.0]], "cycles": 0}, "cycles: 0, allowed: greater than 0"),
        ({"points": [[0.0, 0.0]], "tension": -1.0}, "tension: -1.0, allowed: "),
    ],
)
def test_a_path_that_cannot_be_is_one_line(path, line):
    content = {
        "name": "s",
        "testbed": "t.yaml",
        "duration": 1.0,
        "control": {"mode": "angle", "angle": {"only": path}},
    }
    with pytest.raises(InputError) as caught:
        parse_scenario(dump_yaml(content), "s.yaml")
    assert str(caught.value).startswith(f"s.yaml: control.angle.only.{line}")
    assert "\n" not in str(caught.value)


def servo(bandwidth, inertia=2.0e-4, limit=10.0):
    return AngleServo(np.array([inertia]), np.array([limit]), bandwidth, period=1e-3)


def response(bandwidth, stiffness, steps=4000, inertia=2.0e-4):
    """Angle of a rotor on a spring to a step of 1 rad, by exact steps of the held torque."""
    one, rate = servo(bandwidth), np.sqrt(stiffness / inertia)
    angle = speed = 0.0
    found = []
    for _ in range(steps):
        torque = one.step(*(np.array([x]) for x in (1.0, 0.0, angle, speed)))[0]
        if rate:
            rest = torque / stiffness
            c, s = np.cos(rate * 1e-3), np.sin(rate * 1e-3)
            angle, speed = (
                rest + (angle - rest) * c + speed / rate * s,
                speed * c - (angle - rest) * rate * s,
            )
        else:
            angle += 1e-3 * speed + 0.5e-6 * torque / inertia
            speed += 1e-3 * torque / inertia
        found.append(angle)
    return np.array(found)


@pytest.mark.parametrize("bandwidth", [30.0, 60.0, 200.0])
@pytest.mark.parametrize("stiffness", [0.0, 0.05, 3.0])
def test_the_servo_arrives_whatever_the_cable(bandwidth, stiffness):
    """Up to the bandwidth that is allowed at 1 kHz, from no cable to a stiff one."""
    angle = response(bandwidth, stiffness)
    # The slowest pole is at least ω³/(3ω² + K/J), 1.5 rad/s for ω = 30 and the stiff cable.
    slowest = bandwidth**3 / (3.0 * bandwidth**2 + stiffness / 2.0e-4)
    assert abs(angle[-1] - 1.0) < max(1e-3, 3.0 * np.exp(-0.9 * slowest * 4.0))
    assert np.abs(angle).max() < 2.0


def test_a_servo_of_the_wrong_sign_runs_away():
    one = servo(60.0)
    torque = one.step(*(np.array([x]) for x in (1.0, 0.0, 0.0, 0.0)))
    assert torque[0] > 0.0
    assert one.step(*(np.array([x]) for x in (1.0, 0.0, 1.0, 2.0)))[0] < torque[0]


def test_the_integral_stops_at_the_limit():
    one = servo(60.0, limit=1e-3)
    zero = np.zeros(1)
    for _ in range(5000):
        one.step(np.ones(1), zero, zero, zero)
        assert one.saturated == 1
    # Beyond the wanted angle it turns back at once.
    assert one.step(np.ones(1), zero, np.full(1, 1.1), zero)[0] < 0.0
    one.step(zero, zero, zero, zero)
    assert one.saturated == 0


def test_a_servo_faster_than_its_samples_is_refused():
    servo(200.0)
    with pytest.raises(InputError) as caught:
        servo(201.0)
    assert str(caught.value) == (
        "control.bandwidth: 201 rad/s, allowed with a force controller at 1000 Hz: at most 200"
        " rad/s"
    )


def rig_scenario(tmp_path, path=None, sensors=SENSORS, **changes):
    """Write a rig and a scenario that moves it; return the scenario's file."""
    (tmp_path / "rig.yaml").write_text(dump_yaml(rig_content() | {"sensors": sensors}))
    path = path or {
        "points": [[0.0, 0.0], [0.2, 0.0], [1.2, 0.4], [1.5, 0.4]],
        "tension": 3.0,
    }
    content = {
        "name": "moved",
        "testbed": "rig.yaml",
        "duration": 2.0,
        "control": {"mode": "angle", "angle": {"only": path}},
    }
    file = tmp_path / "moved.yaml"
    file.write_text(dump_yaml(content | changes))
    return file


@pytest.mark.compiled
def test_the_motor_goes_where_it_is_commanded(tmp_path):
    """It starts at rest with its tension, follows the ramp, and stays at its end."""
    result, rows = run_to(tmp_path / "bag", rig_scenario(tmp_path))
    assert result.failure is None
    state = rows["/truth/winches/state"].rows
    angle, speed = state[:, 0], state[:, 1]
    tension = rows["/truth/cables/tension"].rows[:, 0]
    assert tension[0] == pytest.approx(3.0, rel=1e-6)
    # The noise of speed and load cell turns it by counts of the encoder, 10⁻³ rad, at most.
    assert np.abs(angle[:200]).max() < 3e-3
    assert np.abs(angle[1700:] - 0.4).max() < 3e-3
    assert np.abs(speed[1700:]).max() < 0.1
    assert tension[-1] > 10.0
    time = np.arange(len(angle)) / 1000.0
    wanted = np.interp(time, [0.2, 1.2], [0.0, 0.4])
    assert np.abs(angle - wanted).max() < 0.03


def stage_of(tmp_path, *overrides, **changes):
    bundle = bundle_of(rig_scenario(tmp_path, **changes), *overrides)
    return make_controller(FORCE_CONTROLLER, bundle.scenario, bundle.testbed.testbed)


class Sent:
    def __init__(self):
        self.torques = []

    def __call__(self, topic, row):
        assert topic == "/winches/torque_command"
        self.torques.append(row.copy())


def inputs(angle=0.0, speed=0.0, tension=3.0):
    return {WINCH_STATE: np.array([angle, speed, 0.0]), TENSION: np.array([tension])}


def test_angles_count_from_the_first_and_the_tension_is_held_at_once(tmp_path):
    """An encoder's zero is anywhere."""
    for first in (0.0, 57.0):
        stage, sent = stage_of(tmp_path), Sent()
        stage.step(0, inputs(angle=first), sent)
        assert sent.torques[0][0] == pytest.approx(0.025 * 3.0, rel=1e-9)
        stage.step(MS, inputs(angle=first - 0.1), sent)
        assert sent.torques[1][0] > sent.torques[0][0]
        assert stage.status()[:3] == (Level.OK, FORCE_CONTROLLER, "ok")


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        (inputs(angle=np.nan), "/winches/state: nan of only, allowed: finite numbers"),
        (inputs(tension=121.0), "/cables/tension: 121.0 N in only, allowed: at most 120 N"),
        (inputs(tension=np.nan), "/cables/tension: nan N in only, allowed: finite numbers"),
        (
            inputs() | {WINCH_STATE: np.zeros(6)},
            "/winches/state: a row of shape (6,), allowed: (3,)",
        ),
        (inputs() | {TENSION: np.zeros(2)}, "/cables/tension: a row of shape (2,), allowed: (1,)"),
    ],
)
def test_what_cannot_be_right_trips(tmp_path, changed, reason):
    stage, sent = stage_of(tmp_path), Sent()
    stage.step(0, inputs(), sent)
    assert not stage.safe
    stage.step(MS, changed, sent)
    assert stage.safe
    assert stage.status().message == f"safe state hold since 0.001 s: {reason}"
    assert np.isfinite(sent.torques).all()
    # A reset takes it on from where the motor is, without a jump.
    assert stage.reset(2 * MS) is None
    stage.step(2 * MS, inputs(angle=0.05), sent)
    assert sent.torques[-1][0] == pytest.approx(0.025 * 3.0, rel=1e-9)


def test_a_torque_at_its_limit_is_reported(tmp_path):
    stage, sent = stage_of(tmp_path), Sent()
    stage.step(0, inputs(), sent)
    stage.step(MS, inputs(angle=-50.0), sent)
    assert sent.torques[1][0] == 2.0
    assert stage.status()[1:3] == (FORCE_CONTROLLER, "torque at its limit")
    assert stage.status().message == "ok"


def test_the_schedule_reads_angles_and_tensions(tmp_path):
    bundle = bundle_of(rig_scenario(tmp_path))
    plan = schedule_of(bundle.scenario, bundle.testbed.testbed).nodes[FORCE_CONTROLLER]
    assert plan.inputs == (WINCH_STATE, TENSION)
    assert plan.held == ()
    assert isinstance(bundle.scenario.control, AngleProfile)


def test_a_machine_that_does_not_measure_its_angles_is_refused():
    testbed = parse_testbed(dump_yaml(rig_content()), "rig.yaml").testbed
    scenario = parse_scenario(
        dump_yaml({"name": "s", "testbed": "t", "duration": 1.0, "control": {"mode": "angle"}}),
        "s.yaml",
    )
    with pytest.raises(InputError) as caught:
        schedule_of(scenario, testbed)
    assert str(caught.value) == (
        "sensors: /winches/state missing, allowed in mode angle: /winches/state"
    )
