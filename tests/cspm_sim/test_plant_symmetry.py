"""What a mirror, a turn about the vertical and a move of everything must leave as it was."""

import numpy as np
import pytest
from machines import random_poses, with_bar
from plant_samples import plant_derivative, run, swell, torques_about_rest

from cspm_model.kernels.cable import ARM, DIRECTION, SPAN_COLUMNS, TENSION, cable_wrench
from cspm_model.kernels.machine import frame_placement
from cspm_model.kinematics import euler_rate_map, geometry, inverse_kinematics, rotation
from cspm_model.motion import Motion
from cspm_sim.plant import Plant

# Left and right hand swap; so do the cables of each pair. x → −x, then y → −y.
MIRRORS = {
    "surge": (np.array([-1, 1, 1, 1, -1, -1]), [1, 0, 3, 2, 6, 7, 4, 5]),
    "sway": (np.array([1, -1, 1, -1, 1, -1]), [0, 1, 2, 3, 5, 4, 7, 6]),
}
POSE = np.array([0.01, 0.02, 2.0, 0.0, 0.04, -0.05])


def start(testbed, motion, pose=POSE, twist=(0.02, -0.03, 0.01, 0.05, -0.04, 0.03)):
    plant = Plant(testbed, motion, 1_000_000, bar_pose=pose)
    plant.bar_state[6:] = twist
    return plant


@pytest.mark.slow
@pytest.mark.parametrize("name", MIRRORS)
def test_the_mirror_image_of_the_thesis_machine_moves_like_its_mirror_image(thesis, name):
    signs, swap = MIRRORS[name]
    motion = swell()
    image = Motion(motion.knots * np.tile(signs, 3), motion.spacing)
    plant = start(thesis, motion)
    twist = plant.bar_state[6:] * signs
    other = start(thesis, image, plant.bar_state[:6] * signs, twist)
    assert other.tensions == pytest.approx(plant.tensions[swap], rel=1e-12)
    torques = torques_about_rest(plant, 0.2, count=10)
    run(plant, torques, 50_000_000)
    run(other, torques[:, swap], 50_000_000)
    assert np.abs(plant.bar_state[[0, 1, 3, 4, 5]]).min() > 1e-4
    assert other.bar_state == pytest.approx(plant.bar_state * np.tile(signs, 2), abs=1e-10)
    assert other.speeds == pytest.approx(plant.speeds[swap], abs=1e-8)
    assert other.tensions == pytest.approx(plant.tensions[swap], abs=1e-8)


@pytest.mark.parametrize("name", ["thesis", "general"])
@pytest.mark.parametrize("turn", [0.7, -2.5])
def test_a_turn_about_the_vertical_and_a_move_change_nothing(request, name, turn):
    testbed = request.getfixturevalue(name)
    turned = rotation([0, 0, 0, 0, 0, turn])
    place = np.array([3.0, -2.0, 0.7])
    motion = swell()
    knots = motion.knots.copy()
    for first in (0, 6, 12):
        knots[:, first : first + 3] = knots[:, first : first + 3] @ turned.T
    knots[:, :3] += place
    knots[:, 5] += turn
    plant = start(testbed, motion)
    pose = np.concatenate([place + turned @ POSE[:3], np.add(POSE[3:], [0, 0, turn])])
    twist = np.concatenate([turned @ plant.bar_state[6:9], plant.bar_state[9:]])
    other = start(testbed, Motion(knots, motion.spacing), pose, twist)
    torques = torques_about_rest(plant, 0.2, count=8)
    run(plant, torques, 50_000_000)
    run(other, torques, 50_000_000)
    assert other.tensions == pytest.approx(plant.tensions, abs=1e-8)
    assert other.speeds == pytest.approx(plant.speeds, abs=1e-8)
    assert other.bar_state[:3] == pytest.approx(place + turned @ plant.bar_state[:3], abs=1e-10)
    attitude = np.add(plant.bar_state[3:6], [0, 0, turn])
    assert other.bar_state[3:6] == pytest.approx(attitude, abs=1e-10)
    assert other.bar_state[6:9] == pytest.approx(turned @ plant.bar_state[6:9], abs=1e-9)
    assert other.bar_state[9:] == pytest.approx(plant.bar_state[9:], abs=1e-9)


def test_a_frame_in_steady_motion_feels_nothing_of_it(general):
    """Galileo: all moves on at one speed, so cables and attitude see only the rest."""
    speed = np.array([0.4, -0.2, 0.3])
    motion = swell()
    knots = motion.knots.copy()
    knots[:, :3] += speed * motion.spacing * np.arange(len(knots))[:, None]
    knots[:, 6:9] += speed
    plant = start(general, motion)
    twist = np.add(plant.bar_state[6:], [*speed, 0, 0, 0])
    other = start(general, Motion(knots, motion.spacing), POSE, twist)
    torques = torques_about_rest(plant, 0.2, count=8)
    run(plant, torques, 50_000_000)
    run(other, torques, 50_000_000)
    assert other.tensions == pytest.approx(plant.tensions, abs=1e-8)
    assert other.bar_state[:3] - speed * other.time == pytest.approx(plant.bar_state[:3], abs=1e-10)
    assert other.bar_state[3:6] == pytest.approx(plant.bar_state[3:6], abs=1e-10)


def test_the_cables_wrench_is_minus_the_slope_of_their_work(general):
    """−Jᵀt by virtual work: tensions t do the work −t·dl in any small displacement."""
    plant = Plant(general, Motion.still(np.zeros(6)), 1_000_000, bar_pose=[0, 0, 2, 0, 0, 0])
    cables, frame = plant.parameters.cables, np.array([0.1, -0.1, 0.05, 0.2, -0.1, 0.3])
    rng = np.random.default_rng(3)
    for pose in random_poses(5, seed=8):
        tensions = rng.uniform(0.0, 40.0, 8)
        spans = np.zeros((8, SPAN_COLUMNS))
        spans[:, DIRECTION : DIRECTION + 3] = geometry(cables, pose, frame).bar[:, :3]
        spans[:, ARM : ARM + 3] = [rotation(pose) @ c.attachment for c in general.cables]
        spans[:, TENSION] = tensions
        wrench = np.concatenate(cable_wrench(spans))
        for axis in range(3):
            step = 1e-6 * np.eye(6)[axis]
            ends = [inverse_kinematics(cables, pose + s * step, frame) for s in (1, -1)]
            assert wrench[axis] == pytest.approx(-tensions @ (ends[0] - ends[1]) / 2e-6, abs=1e-6)
        # A moment does the work M·ω along Euler rates, whose angular velocity is J_w of (2-7).
        for angle in range(3):
            step = 1e-6 * np.eye(6)[3 + angle]
            ends = [inverse_kinematics(cables, pose + s * step, frame) for s in (1, -1)]
            power = wrench[3:] @ euler_rate_map(pose)[:, angle]
            assert power == pytest.approx(-tensions @ (ends[0] - ends[1]) / 2e-6, abs=1e-6)


def test_the_choice_of_the_bars_origin_changes_nothing(general):
    """All points given from another origin on the bar: the same body, the same motion."""
    shift = np.array([0.05, -0.03, 0.04])
    cables = tuple(
        c.model_copy(update={"attachment": tuple(np.array(c.attachment) + shift)})
        for c in general.cables
    )
    moved = with_bar(general, com=tuple(np.array(general.bar.com) + shift))
    moved = moved.model_copy(update={"cables": cables})
    plant = start(general, swell())
    arm = rotation(plant.bar_state[:6]) @ shift
    rate = rotation(plant.bar_state[:6]) @ plant.bar_state[9:]
    pose = np.concatenate([plant.bar_state[:3] - arm, plant.bar_state[3:6]])
    velocity = plant.bar_state[6:9] - np.cross(rate, arm)
    other = start(moved, swell(), pose, np.concatenate([velocity, plant.bar_state[9:]]))
    torques = torques_about_rest(plant, 0.2, count=8)
    run(plant, torques, 50_000_000)
    run(other, torques, 50_000_000)
    assert other.tensions == pytest.approx(plant.tensions, abs=1e-6)
    found = other.bar_state[:3] + rotation(other.bar_state[:6]) @ shift
    assert found == pytest.approx(plant.bar_state[:3], abs=1e-8)
    assert other.bar_state[3:6] == pytest.approx(plant.bar_state[3:6], abs=1e-8)


def test_the_frame_moves_the_bar_only_through_the_cables(general):
    plant = start(general, swell())
    plant.unstretched_lengths += 0.5
    torque = np.zeros(8)
    rates = [
        plant_derivative(plant, plant.state, torque, swell().at(time)) for time in (0.0, 0.1, 0.3)
    ]
    assert (rates[0] == rates[1])[:12].all()
    assert frame_placement(swell().at(0.1))[0] != frame_placement(swell().at(0.3))[0]
