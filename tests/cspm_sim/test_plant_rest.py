"""Hanging, falling, slackening and catching: what the plant does where the answer is known."""

import numpy as np
import pytest
from machines import THESIS, build, general_content, point_content, rig_content, with_bar
from plant_samples import plant_derivative

from cspm_model.kernels.cable import RADIUS
from cspm_model.kinematics import rotation
from cspm_model.motion import Motion
from cspm_msgs_py.errors import DivergenceError, InputError
from cspm_msgs_py.testbed import load_testbed
from cspm_sim.plant import Plant

ORIGIN = np.zeros(6)
CENTRE = [0.0, 0.0, 2.0, 0.0, 0.0, 0.0]
PERIOD = 1_000_000
G = 9.81


def still(testbed, pose=CENTRE, **options):
    return Plant(testbed, Motion.still(ORIGIN), PERIOD, bar_pose=pose, **options)


def slacken(plant, by=0.6):
    plant.unstretched_lengths += by
    plant._observe()
    assert (plant.tensions == 0.0).all()


REST = {
    "thesis": CENTRE,
    "thesis aside": [0.03, 0.0, 1.6, 0.0, 0.3, 0.1],
    "thesis heavy side": [0.0, 0.0, 2.0, 0.0, 0.02, 0.0],
    "general": [0.01, 0.02, 2.0, 0.0, 0.04, -0.05],
    "point": [0.1, -0.1, 1.8, 0.0, 0.0, 0.0],
}


@pytest.mark.parametrize("name", REST)
@pytest.mark.parametrize("locked", [True, False])
def test_hanging_at_rest_stays_at_rest(request, name, locked):
    testbed = request.getfixturevalue(name.split()[0])
    if name == "thesis heavy side":
        testbed = with_bar(testbed, com=(0.02, 0.008, 0.01))
    plant = still(testbed, REST[name], locked=locked)
    begin = plant.state.copy()
    torque = plant.parameters.cables[:, RADIUS] * plant.tensions
    assert np.abs(plant_derivative(plant, plant.state, torque, plant.frame)).max() < 1e-7
    for _ in range(1000):
        plant.step(torque)
    assert plant.state == pytest.approx(begin, abs=1e-6)
    if name == "thesis heavy side":
        assert abs(plant.bar_state[3]) > 0.1


def test_hanging_on_a_moved_and_tilted_frame_stays_at_rest(general):
    frame = np.array([1.0, -2.0, 0.5, 0.01, -0.02, 0.9])
    pose = [1.0, -2.0, 2.5, 0.0, 0.0, 0.9]
    plant = Plant(general, Motion.still(frame), PERIOD, bar_pose=pose, locked=True)
    for _ in range(500):
        plant.step(np.zeros(8))
    assert plant.bar_state[:6] == pytest.approx(pose, abs=1e-7)


def test_a_bar_on_slack_cables_falls_with_g_down_the_z_axis(thesis):
    plant = still(thesis, locked=True)
    begin = plant.bar_state.copy()
    slacken(plant)
    for _ in range(200):
        plant.step(np.zeros(8))
        assert (plant.tensions == 0.0).all()
    assert plant.time == pytest.approx(0.2)
    fallen = plant.bar_state - begin
    assert fallen[2] == pytest.approx(0.5 * G * 0.2**2, abs=1e-12)
    assert fallen[8] == pytest.approx(G * 0.2, abs=1e-12)
    assert np.delete(fallen, [2, 8]) == pytest.approx(0.0, abs=1e-15)


def test_a_centre_of_mass_beside_the_origin_falls_on_its_parabola(general):
    plant = still(general, locked=True)
    slacken(plant)
    plant.bar_state[6:] = [0.5, -0.3, 0.2, 2.0, -1.5, 1.0]
    com = np.array(general.bar.com)

    def centre():
        turned = rotation(plant.bar_state[:6])
        return plant.bar_state[:3] + turned @ com, plant.bar_state[6:9] + turned @ np.cross(
            plant.bar_state[9:], com
        )

    (place, velocity), time = centre(), 0.15
    for _ in range(150):
        plant.step(np.zeros(8))
    expected = place + velocity * time + np.array([0, 0, 0.5 * G * time**2])
    assert centre()[0] == pytest.approx(expected, abs=1e-10)
    assert centre()[1] == pytest.approx(np.add(velocity, [0, 0, G * time]), abs=1e-9)


@pytest.mark.parametrize("spin", [(3.0, 0.5, -0.4), (0.2, 4.0, 0.3), (0.5, -0.3, 5.0)])
def test_a_free_body_tumbles_at_constant_angular_momentum_and_energy(spin):
    """An asymmetric body; the second spin starts about its middle axis, where it is unstable."""
    content = {**general_content(), "gravity": 0.0}
    plant = Plant(build(content), Motion.still(ORIGIN), 500_000, bar_pose=CENTRE, locked=True)
    slacken(plant, by=3.0)
    plant.bar_state[9:] = spin
    inertia = plant.testbed.bar.inertia.matrix

    def momentum():
        return rotation(plant.bar_state[:6]) @ inertia @ plant.bar_state[9:]

    start, energy = momentum(), plant.bar_state[9:] @ inertia @ plant.bar_state[9:]
    changed = 0.0
    for _ in range(2000):
        plant.step(np.zeros(8))
        changed = max(changed, np.abs(plant.bar_state[9:] - spin).max())
        if abs(plant.bar_state[4]) > 1.3:
            break
    assert plant.steps > 200
    assert changed > 0.1
    assert momentum() == pytest.approx(start, rel=1e-8, abs=1e-8)
    found = plant.bar_state[9:] @ inertia @ plant.bar_state[9:]
    assert found == pytest.approx(energy, rel=1e-8)


def test_a_cable_pulls_towards_its_exit_and_never_pushes(point):
    plant = still(point, locked=True)
    pulling = plant.tensions.copy()
    for i in range(3):
        alone = plant.state.copy()
        alone[12:15] += 0.5
        alone[12 + i] -= 0.5
        rate = plant_derivative(plant, alone, np.zeros(3), plant.frame)
        force = 2.0 * (rate[6:9] - [0, 0, G])
        towards = np.array(point.cables[i].exit) - alone[:3]
        expected = pulling[i] * towards / np.linalg.norm(towards)
        assert force == pytest.approx(expected, rel=1e-9)
    plant.unstretched_lengths += 0.001 + plant.lengths - plant.unstretched_lengths
    plant.bar_state[6:9] = [0, 0, 3.0]
    plant._observe()
    assert (plant.tensions == 0.0).all()
    rate = plant_derivative(plant, plant.state, np.zeros(3), plant.frame)
    assert rate[6:9] == pytest.approx([0, 0, G], abs=0.0)


@pytest.mark.parametrize("speed", [0.2, 2.0])
def test_tension_has_no_jump_where_a_moving_cable_becomes_taut(speed):
    """A ball thrown downwards into its cables: the largest rise per step shrinks with the step."""
    testbed = build(point_content())
    rises, peaks = [], []
    for period_ns in (100_000, 10_000, 1_000):
        plant = Plant(testbed, Motion.still(ORIGIN), period_ns, bar_pose=CENTRE, locked=True)
        plant.unstretched_lengths += plant.lengths - plant.unstretched_lengths + 1e-4
        plant.bar_state[8] = speed
        plant._observe()
        before, rise = plant.tensions.copy(), 0.0
        for _ in range(2_000_000 // period_ns):
            plant.step(np.zeros(3))
            rise = max(rise, (plant.tensions - before).max())
            before = plant.tensions.copy()
        rises.append(rise)
        peaks.append(before.max())
    assert peaks[2] > 0.1
    assert rises[1] < 0.25 * rises[0]
    assert rises[2] < 0.15 * rises[1]


def test_a_catch_and_a_release_leave_the_state_finite_and_the_cables_pulling(general):
    plant = still(general, locked=True)
    slacken(plant, by=0.05)
    caught = False
    for _ in range(1500):
        plant.step(np.zeros(8))
        assert (plant.tensions >= 0.0).all()
        caught |= plant.tensions.max() > 30.0
    assert caught
    assert np.abs(plant.bar_state[:3] - CENTRE[:3]).max() < 0.3


def test_locked_winches_do_not_turn_and_keep_their_cable(general):
    plant = still(general, locked=True)
    lengths = plant.unstretched_lengths.copy()
    plant.bar_state[6:9] = [0.2, 0.1, -0.1]
    for _ in range(300):
        plant.step(np.full(8, 0.7))
    assert (plant.angles == 0.0).all()
    assert (plant.speeds == 0.0).all()
    assert (plant.unstretched_lengths == lengths).all()
    free = still(general)
    for _ in range(30):
        free.step(np.full(8, 0.7))
    assert (free.angles > 0.0).all()


def test_a_plant_that_diverges_says_when_and_which_state(thesis):
    plant = still(thesis)
    plant.step(np.zeros(8))
    torque = np.zeros(8)
    torque[3] = np.nan
    with pytest.raises(DivergenceError) as caught:
        plant.step(torque)
    assert str(caught.value).startswith("t = 0.002 s: ")
    assert str(caught.value).endswith(" is not finite")


@pytest.mark.parametrize("side", [1, -1])
def test_a_pitch_past_its_end_is_refused(general, side):
    plant = still(general, locked=True)
    slacken(plant, by=2.0)
    plant.bar_state[4] = side * 1.5
    plant.step(np.zeros(8))
    plant.bar_state[6:] = 0.0
    plant.bar_state[10] = side * 20.0

    def turn_on():
        for _ in range(20):
            plant.step(np.zeros(8))

    with pytest.raises(DivergenceError) as caught:
        turn_on()
    assert "rad passed ±π/2, where the Euler angles end" in str(caught.value)
    assert f"pitch {side * 1.5:.1f}"[:-1] in str(caught.value)


def test_names_of_the_states(thesis, rig):
    plant = still(thesis)
    assert [plant.state_name(i) for i in (0, 3, 6, 11)] == [
        "bar surge",
        "bar roll",
        "bar surge rate",
        "bar yaw rate",
    ]
    assert plant.state_name(12) == "unstretched length of hoist_1"
    assert plant.state_name(27) == "motor angle of sway_4"
    assert plant.state_name(28) == "motor speed of hoist_1"
    assert plant.state_name(35) == "motor speed of sway_4"
    assert len(plant.state) == 36
    assert Plant(rig, Motion.still(ORIGIN), PERIOD).state_name(0) == "unstretched length of only"


def test_a_bar_needs_a_pose_to_start_from(thesis):
    with pytest.raises(InputError) as caught:
        Plant(thesis, Motion.still(ORIGIN), PERIOD)
    line = "plant: this test-bed has a bar, a pose to start from is required"
    assert str(caught.value) == line


@pytest.mark.parametrize("shape", [(7,), (9,), (8, 1), ()])
def test_torques_of_another_shape_are_refused(thesis, shape):
    plant = still(thesis)
    with pytest.raises(InputError) as caught:
        plant.step(np.zeros(shape))
    assert str(caught.value) == f"torque: shape {shape}, allowed: (8,), one per cable"


def test_a_rig_without_bar_starts_with_the_tension_it_is_given(rig):
    plant = Plant(rig, Motion.still(ORIGIN), PERIOD, tensions=[12.0])
    assert plant.tensions == pytest.approx([12.0], abs=1e-9)
    assert len(plant.bar_state) == 0
    assert Plant(rig, Motion.still(ORIGIN), PERIOD).tensions == pytest.approx([0.0], abs=0.0)


def test_winches_without_cable_turn_freely():
    content = rig_content()
    winch = {"name": "bare", "drum_radius": 0.025, "rotor_inertia": 1e-3, "torque_limit": 1.0}
    plant = Plant(build({**content, "cables": [winch]}), Motion.still(ORIGIN), PERIOD)
    for _ in range(1000):
        plant.step(np.array([0.4]))
    assert plant.speeds == pytest.approx([400.0], rel=1e-12)
    assert plant.angles == pytest.approx([200.0], rel=1e-12)
    assert (plant.tensions == 0.0).all()
    assert (plant.unstretched_lengths == 0.0).all()


def test_time_counts_whole_steps(rig):
    plant = Plant(rig, Motion.still(ORIGIN), 250_000)
    for _ in range(8):
        plant.step(np.zeros(1))
    assert plant.steps == 8
    assert plant.time == 0.002


def test_the_frame_is_where_its_motion_says(general):
    knots = np.random.default_rng(1).normal(size=(5, 18)) * 0.01
    motion = Motion(knots, 0.02)
    plant = Plant(general, motion, PERIOD, bar_pose=CENTRE, locked=True)
    assert plant.frame == pytest.approx(motion.at(0.0), abs=0.0)
    for _ in range(33):
        plant.step(np.zeros(8))
    assert plant.frame == pytest.approx(motion.at(0.033), abs=1e-15)


def test_the_file_of_the_thesis_machine_damps_its_roll(thesis):
    damped = load_testbed(THESIS).testbed
    peaks = []
    for testbed in (thesis, damped):
        plant = still(testbed, locked=True)
        plant.bar_state[3] = 0.05
        swing = []
        for _ in range(2000):
            plant.step(np.zeros(8))
            swing.append(abs(plant.bar_state[3]))
        peaks.append(max(swing[1700:]))
    assert peaks[1] < 0.2 * peaks[0]
