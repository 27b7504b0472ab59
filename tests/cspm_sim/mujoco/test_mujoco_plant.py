"""The MuJoCo plant against the plant, which shares none of its equations' code."""

import numpy as np
import pytest
from machines import (
    EXPONENTIAL,
    LINEAR,
    build,
    changed,
    general_content,
    point_content,
    rig_content,
    with_bar,
)
from mujoco_pairs import (
    MS,
    POSE,
    drive,
    gaps,
    pair,
    radii,
    run_free,
    still,
    swinging_torques,
    waving,
)
from scipy.spatial.transform import Rotation

from cspm_model.motion import Motion
from cspm_msgs_py.errors import ConvergenceError, DivergenceError, InputError
from cspm_sim.mujoco.plant import MujocoPlant
from cspm_sim.plant import Plant

# Rest


@pytest.mark.parametrize("name", ["thesis", "general", "point"])
def test_both_find_the_same_rest(request, name):
    testbed = request.getfixturevalue(name)
    ours, theirs = pair(testbed)
    assert gaps(ours, theirs)["tensions"] < 1e-8
    assert gaps(ours, theirs)["unstretched_lengths"] < 1e-11
    np.testing.assert_allclose(theirs.bar_state, ours.bar_state, atol=1e-9)


def test_both_find_the_roll_at_which_gravity_does_not_turn_the_bar(thesis):
    machine = with_bar(thesis, com=(0.01, 0.004, 0.01))
    ours, theirs = pair(machine, pose=[0.0, 0.0, 2.0, 0.0, 0.1, 0.2])
    assert abs(theirs.bar_state[3]) > 0.05
    np.testing.assert_allclose(theirs.bar_state, ours.bar_state, atol=1e-9)
    assert gaps(ours, theirs)["tensions"] < 1e-7


def test_both_find_the_same_rest_with_limits_that_bind(thesis):
    low = [c.model_copy(update={"tension_limits": (2.5, 60.0)}) for c in thesis.cables]
    machine = thesis.model_copy(update={"cables": tuple(low)})
    ours, theirs = pair(machine, pose=[0.1, 0.05, 2.0, 0.0, 0.0, 0.0])
    assert (theirs.tensions < 2.5 + 1e-9).any()
    assert theirs.tensions.min() > 2.5 - 1e-9
    assert gaps(ours, theirs)["tensions"] < 1e-6


def test_rest_stays_at_rest(general):
    plant = MujocoPlant(general, still().at, MS, bar_pose=POSE)
    start, torque = plant.bar_state.copy(), radii(general) * plant.tensions
    for _ in range(500):
        plant.step(torque)
    assert np.abs(plant.bar_state - start).max() < 1e-8
    assert plant.time == 0.5


def test_a_pose_that_cannot_be_held_is_refused(thesis):
    with pytest.raises(ConvergenceError, match="no tensions within the limits hold the bar"):
        MujocoPlant(thesis, still().at, MS, bar_pose=[3.0, 0.0, 1.0, 0.0, 0.0, 0.0])


# Motion


@pytest.mark.compiled
def test_both_fall_freely_when_all_cables_are_slack(general):
    ours, theirs = pair(general)
    for plant in (ours, theirs):
        plant.unstretched_lengths[:] += 3.0
    spin = np.array([0.4, -0.2, -1.0, 1.5, -0.8, 2.0])
    ours.bar_state[6:] = spin
    theirs.bar_state[6:] = theirs._bar_velocity[:] = spin
    worst = drive(ours, theirs, np.zeros((6, 8)), hold=50)
    assert not theirs.tensions.any()
    assert worst["bar_state"] < 1e-9
    # The mass centre follows its parabola.
    centre = POSE[:3] + Rotation.from_euler("ZYX", POSE[:2:-1]).apply(general.bar.com)
    arm = Rotation.from_euler("ZYX", POSE[:2:-1]).apply(np.cross(spin[3:], general.bar.com))
    fallen = centre + (spin[:3] + arm) * 0.3 + [0.0, 0.0, 0.5 * 9.81 * 0.3**2]
    angles = theirs.bar_state[5:2:-1]
    found = theirs.bar_state[:3] + Rotation.from_euler("ZYX", angles).apply(general.bar.com)
    np.testing.assert_allclose(found, fallen, atol=1e-9)


@pytest.mark.compiled
@pytest.mark.parametrize("name", ["thesis", "general", "point"])
def test_both_answer_steps_of_torque_equally(request, name):
    ours, theirs = pair(request.getfixturevalue(name))
    worst = drive(ours, theirs, swinging_torques(ours, 10))
    assert np.abs(ours.bar_state[:3] - POSE[:3]).max() > 1e-3
    assert worst["bar_state"] < 1e-7
    assert worst["tensions"] < 1e-5
    assert worst["speeds"] < 1e-5
    assert worst["angles"] < 1e-7
    assert worst["unstretched_lengths"] < 1e-9


@pytest.mark.compiled
def test_both_answer_equally_through_slack_and_taut(thesis):
    ours, theirs = pair(thesis, waving(2.0))
    torques = swinging_torques(ours, 12, share=0.8)
    slack = 0
    for torque in torques:
        drive(ours, theirs, [torque], hold=50)
        slack += (ours.tensions == 0.0).any()
    assert slack
    assert gaps(ours, theirs)["bar_state"] < 1e-5


@pytest.mark.compiled
def test_both_follow_a_moving_frame_equally_with_locked_winches(general):
    ours, theirs = pair(general, waving(2.0), locked=True)
    worst = drive(ours, theirs, np.zeros((10, 8)))
    assert worst["frame"] < 1e-14
    assert not theirs.angles.any()
    assert np.abs(ours.bar_state[:6] - POSE).max() > 5e-3
    assert worst["bar_state"] < 1e-7
    assert worst["tensions"] < 1e-5


@pytest.mark.compiled
def test_a_frame_that_moves_the_other_way_makes_them_differ(general):
    moving = waving(1.0)
    backwards = Motion(moving.knots * -1.0, moving.spacing)
    ours = Plant(general, moving, MS, bar_pose=POSE, locked=True)
    theirs = MujocoPlant(general, backwards.at, MS, bar_pose=POSE, locked=True)
    assert drive(ours, theirs, np.zeros((3, 8)))["bar_state"] > 1e-3


@pytest.mark.compiled
@pytest.mark.parametrize("stiffness", [EXPONENTIAL, LINEAR])
def test_shorter_steps_bring_them_together(stiffness):
    """Both tend to one trajectory: what is between them goes with the fourth power of the step."""
    testbed = build(general_content(stiffness))
    torques = swinging_torques(pair(testbed)[0], 4)
    reference = Plant(testbed, waving(1.0), MS // 16, bar_pose=POSE)
    for torque in torques:
        for _ in range(16 * 60):
            reference.step(torque)

    def gap(period_ns):
        plant = MujocoPlant(testbed, waving(1.0).at, period_ns, bar_pose=POSE)
        for torque in torques:
            for _ in range(60 * MS // period_ns):
                plant.step(torque)
        return np.abs(plant.bar_state - reference.bar_state).max()

    far, near = gap(6 * MS), gap(3 * MS)
    assert far > 1e-9
    assert near < far / 8.0


@pytest.mark.compiled
def test_substeps_are_shorter_steps(general):
    once = MujocoPlant(general, waving(1.0).at, MS, bar_pose=POSE, substeps=4)
    often = MujocoPlant(general, waving(1.0).at, MS // 4, bar_pose=POSE)
    torque = radii(general) * once.tensions * 1.1
    for _ in range(50):
        once.step(torque)
        for _ in range(4):
            often.step(torque)
    np.testing.assert_allclose(once.bar_state, often.bar_state, atol=1e-13)


@pytest.mark.compiled
def test_both_agree_on_a_winch_without_bar(rig):
    ours, theirs = pair(rig, tensions=[6.0])
    assert theirs.bar_state.shape == (0,)
    assert theirs.tensions[0] == pytest.approx(6.0, abs=1e-9)
    worst = drive(ours, theirs, [[0.3], [0.1], [0.25], [0.0]] * np.ones((4, 1)))
    assert abs(ours.angles[0]) > 0.01
    assert worst["tensions"] < 1e-6
    assert worst["angles"] < 1e-8


def winch_without_cable():
    bare = {"name": "bare", "drum_radius": 0.02, "rotor_inertia": 1e-4, "torque_limit": 0.1}
    return build({"name": "mixed", "cables": [*rig_content()["cables"], bare]})


@pytest.mark.compiled
def test_a_winch_without_cable_turns_equally():
    ours, theirs = pair(winch_without_cable())
    worst = drive(ours, theirs, [[0.01, 0.3]] * np.ones((2, 1)))
    assert theirs.speeds[1] == pytest.approx(0.1 / 1e-4 * 0.2)  # the drive's limit
    assert worst["speeds"] < 1e-6
    assert theirs.tensions[1] == 0.0


def test_applied_torque_is_limited(rig):
    plant = MujocoPlant(rig, still().at, MS)
    for wanted, applied in ((5.0, 2.0), (-5.0, -2.0), (0.3, 0.3)):
        assert plant.applied_torque(np.array([wanted])) == applied


# What it refuses


def test_wrong_calls_are_refused(general, rig):
    with pytest.raises(InputError, match="a pose to start from is required"):
        MujocoPlant(general, still().at, MS)
    with pytest.raises(InputError, match=r"torque: shape \(2,\), allowed: \(1,\), one per cable"):
        MujocoPlant(rig, still().at, MS).step(np.zeros(2))


def test_a_body_that_mujoco_refuses_is_named():
    inertia = {"ixx": 1e-17, "iyy": 1e-17, "izz": 1e-17}
    content = changed(point_content(), "bar.inertia", inertia)
    with pytest.raises(InputError, match=r"test-bed point: MuJoCo refuses it \(.*\), allowed"):
        MujocoPlant(build(content), still().at, MS, bar_pose=POSE)


def test_runaways_end_with_what_ran_away(general, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    plant = MujocoPlant(general, still().at, MS, bar_pose=POSE)
    with pytest.raises(DivergenceError, match=r"t = 0.000 s: torque of c3 is not finite"):
        plant.step(np.array([0.0, 0.0, 0.0, np.nan, 0.0, 0.0, 0.0, 0.0]))
    plant._bar_velocity[0] = 1e10
    with pytest.raises(DivergenceError, match=r"t = 0.000 s: tension of c2 is not finite"):
        plant.step(np.zeros(8))
    plant = MujocoPlant(winch_without_cable(), still().at, MS)
    plant.speeds[1] = 2e9
    with pytest.raises(DivergenceError, match=r"t = 0.001 s: motor speed is not finite"):
        plant.step(np.zeros(2))
    assert not list(tmp_path.iterdir())  # MuJoCo wrote no log of its own


@pytest.mark.parametrize("rate", [4.0, -4.0])
def test_a_pitch_beyond_the_vertical_ends_the_run(thesis, rate):
    plant = MujocoPlant(thesis, still().at, MS, bar_pose=[0.0, 0.0, 2.0, 0.0, 0.0, 0.0])
    plant.unstretched_lengths[:] += 9.0
    plant._bar_velocity[4] = rate
    with pytest.raises(DivergenceError, match="passed ±π/2, where the Euler angles end"):
        run_free(plant, 1000)
    assert plant.bar_state[4] * np.sign(rate) > 1.5


def test_angles_go_on_past_a_half_turn(general):
    plant = MujocoPlant(general.model_copy(update={"gravity": 0.0}), still().at, MS, bar_pose=POSE)
    plant.unstretched_lengths[:] += 9.0
    plant._bar_velocity[5] = -30.0
    before = plant.bar_state.copy()
    for _ in range(200):
        plant.step(np.zeros(8))
        assert np.abs(plant.bar_state - before)[3:6].max() < 0.1
        before = plant.bar_state.copy()
    assert plant.bar_state[5] < -np.pi


def test_an_error_inside_a_step_leaves_mujoco_as_it_was(rig):
    import mujoco

    def failing(time):
        if time > 0.0:
            raise KeyboardInterrupt
        return np.zeros(18)

    plant = MujocoPlant(rig, failing, MS)
    with pytest.raises(KeyboardInterrupt):
        plant.step(np.zeros(1))
    assert mujoco.get_mjcb_control() is None


def test_two_plants_do_not_disturb_each_other(general, rig):
    alone = MujocoPlant(general, still().at, MS, bar_pose=POSE)
    ours = MujocoPlant(general, still().at, MS, bar_pose=POSE)
    other = MujocoPlant(rig, still().at, MS, tensions=[5.0])
    torque = 1.1 * radii(general) * alone.tensions
    for _ in range(20):
        alone.step(torque)
    for _ in range(20):
        ours.step(torque)
        other.step(np.zeros(1))
    np.testing.assert_array_equal(ours.bar_state, alone.bar_state)
