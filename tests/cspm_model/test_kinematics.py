import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import build, general_content, random_poses
from scipy.spatial.transform import Rotation

from cspm_model.kinematics import (
    SMALLEST_COSINE,
    euler_jacobian,
    euler_rate_map,
    euler_rates,
    forward_kinematics,
    geometry,
    inverse_kinematics,
    rotation,
)
from cspm_msgs_py.errors import ConvergenceError, InputError, SingularityError
from cspm_sim.parameters import plant_parameters

ORIGIN = np.zeros(6)
FRAMES = random_poses(6, seed=21, centre=(0.1, -0.2, 0.05), reach=0.2, angle=0.3)


@pytest.fixture(scope="module")
def cables(thesis, point, general):
    machines = {"thesis": thesis, "point": point, "general": general}
    return {name: plant_parameters(testbed).cables for name, testbed in machines.items()}


def vectors(testbed, pose, frame):
    """Thesis (2-2) with scipy's rotations, from exits to attachments."""
    bar, base = (Rotation.from_euler("ZYX", p[:2:-1]).as_matrix() for p in (pose, frame))
    ends = [(pose[:3] + bar @ c.attachment, frame[:3] + base @ c.exit) for c in testbed.cables]
    return np.array([end - start for end, start in ends])


@pytest.mark.parametrize("frame", FRAMES)
def test_lengths_are_distances_from_exit_to_attachment(general, cables, frame):
    for pose in random_poses(5, seed=3):
        expected = np.linalg.norm(vectors(general, pose, frame), axis=1)
        found = inverse_kinematics(cables["general"], pose, frame)
        assert found == pytest.approx(expected, abs=1e-14)


def moved(pose, twist, step):
    """The pose after a short time of a twist in world axes."""
    turned = Rotation.from_rotvec(step * twist[3:]) * Rotation.from_euler("ZYX", pose[:2:-1])
    return np.concatenate([pose[:3] + step * twist[:3], turned.as_euler("ZYX")[::-1]])


@pytest.mark.parametrize("axis", range(6))
@pytest.mark.parametrize("name", ["thesis", "point", "general"])
def test_jacobians_are_the_slopes_of_the_lengths(cables, name, axis):
    step, twist = 1e-6, np.eye(6)[axis]
    for pose, frame in zip(random_poses(6, seed=5), FRAMES, strict=True):
        rows = cables[name]
        found = geometry(rows, pose, frame)
        of_bar = [inverse_kinematics(rows, moved(pose, twist, s * step), frame) for s in (1, -1)]
        of_frame = [inverse_kinematics(rows, pose, moved(frame, twist, s * step)) for s in (1, -1)]
        slope = (of_bar[0] - of_bar[1]) / (2 * step)
        frame_slope = (of_frame[0] - of_frame[1]) / (2 * step)
        assert found.bar[:, axis] == pytest.approx(slope, abs=1e-8)
        assert found.frame[:, axis] == pytest.approx(frame_slope, abs=1e-8)


@pytest.mark.parametrize("name", ["thesis", "general"])
def test_the_euler_jacobian_is_the_slope_over_the_pose_itself(cables, name):
    step = 1e-6
    for pose, frame in zip(random_poses(6, seed=6), FRAMES, strict=True):
        found = euler_jacobian(cables[name], pose, frame)
        for dof in range(6):
            change = step * np.eye(6)[dof]
            ends = [inverse_kinematics(cables[name], pose + s * change, frame) for s in (1, -1)]
            assert found[:, dof] == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-8)


def test_moving_everything_together_changes_no_length(cables):
    for pose, frame in zip(random_poses(6, seed=7), FRAMES, strict=True):
        both = geometry(cables["general"], pose, frame)
        for axis in range(3):
            assert both.bar[:, axis] == pytest.approx(-both.frame[:, axis], abs=1e-15)
        # A common turn about the world's origin moves each body's origin too.
        turn = np.array([0.3, -0.2, 0.5])
        for body, place in ((both.bar, pose), (both.frame, frame)):
            body[:, 0] = body[:, :3] @ np.cross(turn, place[:3]) + body[:, 3:] @ turn
        assert both.bar[:, 0] == pytest.approx(-both.frame[:, 0], abs=1e-14)


def test_the_euler_rate_map_is_the_rotation_in_motion():
    step = 1e-6
    for pose in random_poses(10, seed=9, angle=1.2):
        found = euler_rate_map(pose)
        for dof in range(3):
            change = step * np.eye(6)[3 + dof]
            ahead, behind = (rotation(pose + s * change) for s in (1, -1))
            spin = (ahead - behind) / (2 * step) @ rotation(pose).T
            expected = [spin[2, 1], spin[0, 2], spin[1, 0]]
            assert found[:, dof] == pytest.approx(expected, abs=1e-9)


def test_euler_rates_invert_the_map():
    for pose in random_poses(10, seed=9, angle=1.2):
        rates = np.array([0.3, -0.7, 1.1])
        body_rate = rotation(pose).T @ euler_rate_map(pose) @ rates
        assert euler_rates(pose, body_rate) == pytest.approx(rates, abs=1e-12)


@pytest.mark.parametrize("sign", [1, -1])
def test_euler_rates_are_refused_at_their_singularity_and_not_before(sign):
    edge = np.arccos(SMALLEST_COSINE)
    near, at = (sign * np.array([0, 0, 0, 0, edge + d, 0]) for d in (-1e-6, 1e-6))
    assert np.isfinite(euler_rates(near, [0.1, 0.2, 0.3])).all()
    with pytest.raises(SingularityError) as caught:
        euler_rates(at, [0.1, 0.2, 0.3])
    assert str(caught.value) == (
        f"pitch {at[4]:.6g} rad: Euler rates do not exist at ±π/2, allowed: |cos θ| ≥ 0.001"
    )
    with pytest.raises(SingularityError, match=r"^pitch -?1\.5708 rad: Euler rates do not exist"):
        euler_rates([0, 0, 0, 0, sign * np.pi / 2, 0], [0, 0, 0])


small = st.floats(-0.25, 0.25)


@settings(max_examples=60, deadline=None)
@given(pose=st.tuples(*[small] * 6), frame=st.sampled_from(range(len(FRAMES))))
def test_poses_come_back_from_their_lengths(cables, pose, frame):
    pose = np.add(pose, [0, 0, 2, 0, 0, 0])
    lengths = inverse_kinematics(cables["general"], pose, FRAMES[frame])
    guess = pose + 0.03 * np.array([1, -1, 1, -1, 1, -1])
    found = forward_kinematics(cables["general"], lengths, FRAMES[frame], guess)
    assert found == pytest.approx(pose, abs=1e-9)


@settings(max_examples=40, deadline=None)
@given(pose=st.tuples(*[small] * 6))
def test_the_thesis_machine_finds_its_pose_when_its_roll_is_known(cables, pose):
    pose = np.add(pose, [0, 0, 2, 0, 0, 0])
    lengths = inverse_kinematics(cables["thesis"], pose, ORIGIN)
    guess = [0, 0, 2.0, 0.3, 0, 0]
    found = forward_kinematics(cables["thesis"], lengths, ORIGIN, guess, {"roll": pose[3]})
    assert found == pytest.approx(pose, abs=1e-9)


def test_a_point_finds_its_place_when_its_angles_are_known(cables):
    pose = np.array([0.1, -0.2, 1.7, 0.1, 0.2, 0.3])
    lengths = inverse_kinematics(cables["point"], pose, ORIGIN)
    angles = {"roll": 0.1, "pitch": 0.2, "yaw": 0.3}
    found = forward_kinematics(cables["point"], lengths, ORIGIN, [0, 0, 2, 0, 0, 0], angles)
    assert found == pytest.approx(pose, abs=1e-10)


@pytest.mark.parametrize(
    ("name", "known", "loose", "rank"),
    [
        ("thesis", {}, ["roll"], "5 of 6"),
        ("point", {}, ["roll", "pitch", "yaw"], "3 of 6"),
        ("point", {"roll": 0.0, "yaw": 0.0}, ["pitch"], "3 of 4"),
    ],
)
def test_what_the_lengths_do_not_fix_is_named(cables, name, known, loose, rank):
    lengths = inverse_kinematics(cables[name], [0, 0, 2, 0, 0, 0], ORIGIN)
    with pytest.raises(ConvergenceError) as caught:
        forward_kinematics(cables[name], lengths, ORIGIN, [0.01, 0.01, 2, 0, 0.01, 0.02], known)
    assert str(caught.value) == (
        f"forward kinematics: the lengths do not fix {', '.join(loose)} near the guess (rank"
        f" {rank}), allowed: give it as known"
    )


def test_lengths_that_no_pose_has_are_refused(cables):
    lengths = inverse_kinematics(cables["general"], [0, 0, 2, 0, 0, 0], ORIGIN)
    lengths[0] += 0.05
    with pytest.raises(ConvergenceError) as caught:
        forward_kinematics(cables["general"], lengths, ORIGIN, [0, 0, 2, 0, 0, 0])
    assert re.fullmatch(
        r"forward kinematics: lengths differ by 0\.0\d+ m at the nearest pose, allowed: lengths"
        r" that one pose has",
        str(caught.value),
    )


@pytest.fixture(scope="module")
def flat_cables():
    """All cables in one plane when the bar's origin is in it: singular there, and worse near it."""
    content = general_content()
    for cable in content["cables"]:
        cable["exit"][2] = cable["attachment"][2] = 0.0
    return plant_parameters(build(content)).cables


@pytest.mark.parametrize("height", [0.2, -0.2, 1e-2, 1e-3, 1e-5])
@pytest.mark.parametrize("guess", [1.1, 3.0])
def test_poses_come_back_close_to_a_singularity(flat_cables, height, guess):
    pose = np.array([0, 0, height, 0, 0, 0])
    lengths = inverse_kinematics(flat_cables, pose, ORIGIN)
    found = forward_kinematics(flat_cables, lengths, ORIGIN, pose * guess)
    assert found == pytest.approx(pose, abs=1e-9)


@pytest.mark.parametrize("height", [0.0, 1e-8, 1e-7, -1e-7])
@pytest.mark.parametrize("guess", [0.0, 0.05])
def test_a_pose_too_close_to_a_singularity_is_refused(flat_cables, height, guess):
    lengths = inverse_kinematics(flat_cables, [0, 0, height, 0, 0, 0], ORIGIN)
    with pytest.raises(ConvergenceError, match=r"do not fix heave, roll, pitch near the guess"):
        forward_kinematics(flat_cables, lengths, ORIGIN, [0, 0, guess, 0, 0, 0])


def test_a_tolerance_admits_measured_lengths(cables):
    pose = np.array([0.1, 0.05, 2.1, 0.05, -0.1, 0.08])
    noise = 1e-5 * np.random.default_rng(1).normal(size=8)
    measured = inverse_kinematics(cables["general"], pose, ORIGIN) + noise
    with pytest.raises(ConvergenceError, match=r"lengths differ by \S+e-0[56] m"):
        forward_kinematics(cables["general"], measured, ORIGIN, pose)
    found = forward_kinematics(cables["general"], measured, ORIGIN, pose, tolerance=1e-4)
    assert found == pytest.approx(pose, abs=1e-4)
    assert found != pytest.approx(pose, abs=1e-7)


@pytest.mark.parametrize(
    ("lengths", "text"),
    [
        ([2.0] * 7, "lengths: shape (7,), allowed: (8,), one per cable"),
        ([2.0] * 7 + [float("nan")], "lengths: not finite, allowed: finite numbers"),
        ([2.0] * 7 + [-1.0], "lengths: -1 m, allowed: > 0"),
    ],
)
def test_what_are_no_lengths_is_refused(cables, lengths, text):
    with pytest.raises(InputError) as caught:
        forward_kinematics(cables["general"], lengths, ORIGIN, [0, 0, 2, 0, 0, 0])
    assert str(caught.value) == text


def test_knowing_everything_leaves_nothing_to_find(cables):
    known = dict.fromkeys(("surge", "sway", "heave", "roll", "pitch", "yaw"), 0.0)
    with pytest.raises(InputError) as caught:
        forward_kinematics(cables["general"], [2.0] * 8, ORIGIN, ORIGIN, known)
    assert str(caught.value) == "known: all six DOFs, allowed: at least one left to be found"


def test_unknown_names_of_known_values_are_refused(cables):
    with pytest.raises(InputError) as caught:
        forward_kinematics(cables["thesis"], [2.0] * 8, ORIGIN, [0, 0, 2, 0, 0, 0], {"rol": 0.0})
    assert str(caught.value) == (
        "known: no DOF 'rol', allowed: surge, sway, heave, roll, pitch, yaw"
    )


@pytest.mark.parametrize("pose", [[0] * 5, [0] * 7, [0, 0, np.nan, 0, 0, 0], [[0] * 6]])
def test_what_is_no_pose_is_refused_in_one_line(cables, pose):
    with pytest.raises(InputError, match=r"^pose .*: allowed: six finite numbers x y z φ θ ψ$"):
        geometry(cables["thesis"], pose, ORIGIN)
    with pytest.raises(InputError, match=r"^pose "):
        geometry(cables["thesis"], ORIGIN, pose)


def test_a_cable_without_length_has_no_direction(point):
    rows = plant_parameters(point).cables
    place = [*point.cables[1].exit, 0, 0, 0]
    with pytest.raises(SingularityError) as caught:
        geometry(rows, place, ORIGIN)
    assert str(caught.value) == "cable 1: length 0 m, its direction does not exist"
    assert geometry(rows, np.add(place, [0, 0, 1e-6, 0, 0, 0]), ORIGIN).lengths[1] > 0
