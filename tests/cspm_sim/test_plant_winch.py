"""The winch: gear, drum, rotor and torque limit, alone and against its cable."""

import numpy as np
import pytest
from machines import WINCH, build, cable, rig_content

from cspm_model.kernels.cable import CABLE_COLUMNS, INERTIA, RADIUS, TORQUE_LIMIT
from cspm_model.motion import Motion
from cspm_sim.kernels.winch import DRY_LIMIT, RESISTANCE, WINCH_SIGNALS, winch_acceleration
from cspm_sim.parameters import plant_parameters
from cspm_sim.plant import Plant

STILL = Motion.still(np.zeros(6))
PERIOD = 1_000_000


def acceleration(torque=0.0, tension=0.0, speed=0.0, resistance=0.0, dry=0.0, period=1e-3):
    """A winch of 2 kg·m² and 0.1 m per radian with a limit of 5 N·m."""
    rows, signals = np.zeros((1, CABLE_COLUMNS)), np.zeros(WINCH_SIGNALS)
    rows[0, RADIUS], rows[0, INERTIA], rows[0, TORQUE_LIMIT] = 0.1, 2.0, 5.0
    signals[RESISTANCE], signals[DRY_LIMIT] = resistance, dry
    return winch_acceleration(torque, tension, speed, period, rows, 0, signals)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"torque": 3.0}, 1.5),
        ({"torque": -3.0}, -1.5),
        ({"torque": 5.0}, 2.5),
        ({"torque": 50.0}, 2.5),
        ({"torque": -50.0}, -2.5),
        ({"tension": 30.0}, -1.5),
        ({"torque": 3.0, "tension": 30.0}, 0.0),
        ({"resistance": 1.0}, -0.5),
        ({"torque": 9.0, "resistance": 1.0}, 2.0),
        # Dry friction against the motion, whatever else acts; its limit counts after the torque's.
        ({"speed": 100.0, "dry": 1.0}, -0.5),
        ({"speed": -100.0, "dry": 1.0}, 0.5),
        ({"speed": 100.0, "torque": 4.0, "dry": 1.0}, 1.5),
        ({"speed": -100.0, "torque": 4.0, "dry": 1.0}, 2.5),
        ({"torque": 0.9, "dry": 1.0}, 0.0),
        ({"torque": -0.9, "dry": 1.0}, 0.0),
        ({"torque": 1.5, "dry": 1.0}, 0.25),
        ({"torque": -1.5, "dry": 1.0}, -0.25),
        # A slow shaft is stopped within the step, not turned back.
        ({"speed": 1e-4, "dry": 1.0}, -0.1),
        ({"speed": -1e-4, "dry": 1.0}, 0.1),
    ],
)
def test_the_sum_of_torques(given, expected):
    assert acceleration(**given) == pytest.approx(expected, abs=1e-12)


def test_drum_and_gear_make_the_radius_at_the_motor():
    cables = [
        cable("a", (0, 0, 0), (0, 0, 2), drum_radius=0.05, gear_ratio=10.0),
        cable("b", (0, 0, 0), (0, 0, 2), drum_radius=0.05),
    ]
    rows = plant_parameters(build({"name": "two", "cables": cables})).cables
    assert rows[:, RADIUS] == pytest.approx([0.005, 0.05])


@pytest.mark.parametrize("gear", [1.0, 10.0])
def test_a_motor_gives_the_cable_the_power_that_it_takes(gear):
    """(r/n)·t·q̇ at the shaft is t times the stretched cable wound per second, thesis (2-16)."""
    content = rig_content()
    content["cables"][0]["gear_ratio"] = gear
    plant = Plant(build(content), STILL, 1_000, tensions=[20.0])
    plant.speeds[:] = 3.0
    plant._observe()
    tension, length = float(plant.tensions[0]), float(plant.lengths[0])
    before = float(plant.unstretched_lengths[0])
    rows = plant.parameters.cables
    plant.step(rows[:, RADIUS] * tension)
    rate = (float(plant.unstretched_lengths[0]) - before) / 1e-6
    stretched = rate * length / before
    shaft = 0.025 / gear * tension * 3.0
    assert -tension * stretched == pytest.approx(shaft, rel=1e-4)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_positive_winds_in(rig, side):
    plant = Plant(rig, STILL, PERIOD, tensions=[20.0])
    hold = plant.parameters.cables[:, RADIUS] * plant.tensions
    length, tension = plant.unstretched_lengths.copy(), plant.tensions.copy()
    for _ in range(20):
        plant.step(hold + side * 0.05)
    assert side * plant.angles[0] > 0.0
    assert side * plant.speeds[0] > 0.0
    assert side * (length - plant.unstretched_lengths)[0] > 0.0
    assert side * (plant.tensions - tension)[0] > 0.0


def test_the_torque_limit_holds(rig):
    plants = [Plant(rig, STILL, PERIOD, tensions=[20.0]) for _ in range(2)]
    limit = WINCH["torque_limit"]
    assert plants[0].applied_torque(np.array([99.0])) == [limit]
    assert plants[0].applied_torque(np.array([-99.0])) == [-limit]
    assert plants[0].applied_torque(np.array([0.5 * limit])) == [0.5 * limit]
    for _ in range(5):
        plants[0].step(np.array([99.0]))
        plants[1].step(np.array([limit]))
    assert (plants[0].state == plants[1].state).all()


def test_the_unstretched_length_falls_exponentially_with_the_angle(rig):
    """l̇0 = −(l0/l)·r·q̇ on a fixed span integrates to l0·exp(−r·q/l)."""
    plant = Plant(rig, STILL, 100_000, tensions=[20.0])
    begin, length = float(plant.unstretched_lengths[0]), float(plant.lengths[0])
    hold = plant.parameters.cables[:, RADIUS] * plant.tensions
    for _ in range(3000):
        plant.step(hold + 0.1)
    turned = float(plant.angles[0])
    assert turned > 0.05
    expected = begin * np.exp(-0.025 * turned / length)
    assert plant.unstretched_lengths[0] == pytest.approx(expected, rel=1e-10)


def test_a_slack_winch_only_turns_its_rotor(rig):
    plant = Plant(rig, STILL, PERIOD)
    plant.unstretched_lengths += 0.1
    for _ in range(100):
        plant.step(np.array([-0.12]))
    assert plant.tensions == [0.0]
    assert plant.speeds[0] == pytest.approx(-0.12 / WINCH["rotor_inertia"] * 0.1, rel=1e-12)
    assert plant.unstretched_lengths[0] > 2.2


def test_a_damper_stiffens_a_cable_that_is_pulled_out_and_slackens_one_that_is_let_go(rig):
    plant = Plant(rig, STILL, PERIOD, tensions=[20.0])
    at_rest = float(plant.tensions[0])
    damping = 20.0 - 1.5 * (float(plant.unstretched_lengths[0]) + 0.3)
    for speed in (4.0, -4.0):
        plant.speeds[:] = speed
        plant._observe()
        wound = float(plant.unstretched_lengths[0] / plant.lengths[0]) * 0.025 * speed
        assert plant.tensions[0] - at_rest == pytest.approx(damping * wound, rel=1e-12)


def test_a_damper_never_has_negative_damping(rig):
    damping = rig.cables[0].damping.model_copy(update={"constant": 1.0, "slope": 5.0})
    cables = (rig.cables[0].model_copy(update={"damping": damping}),)
    plant = Plant(rig.model_copy(update={"cables": cables}), STILL, PERIOD, tensions=[20.0])
    plant.speeds[:] = 4.0
    plant._observe()
    assert plant.tensions == pytest.approx([20.0], abs=1e-9)


@pytest.mark.parametrize("tension", [0.0125, 0.025, 0.04])
def test_below_the_floor_the_damper_fades_with_the_tension(rig, tension):
    plant = Plant(rig, STILL, PERIOD, tensions=[tension])
    damping = 20.0 - 1.5 * (float(plant.unstretched_lengths[0]) + 0.3)
    plant.speeds[:] = 0.5
    plant._observe()
    wound = float(plant.unstretched_lengths[0] / plant.lengths[0]) * 0.025 * 0.5
    expected = tension + damping * tension / 0.05 * wound
    assert plant.tensions[0] == pytest.approx(expected, rel=1e-9)
