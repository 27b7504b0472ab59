import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import build, pulley_content, random_poses
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from cspm_model.kinematics import (
    SMALLEST_COSINE,
    euler_rate_map,
    euler_rates,
    geometry,
    inverse_kinematics,
    rotation,
)
from cspm_msgs_py.errors import SingularityError
from cspm_sim.parameters import plant_parameters

ORIGIN = np.zeros(6)
FRAMES = random_poses(6, seed=21, centre=(0.1, -0.2, 0.05), reach=0.2, angle=0.3)


@pytest.fixture(scope="module")
def cables(thesis, point, general):
    machines = {"thesis": thesis, "point": point, "general": general}
    machines["pulleys"] = build(pulley_content())
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
@pytest.mark.parametrize("name", ["thesis", "point", "general", "pulleys"])
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


@pytest.mark.parametrize("name", ["thesis", "general", "pulleys"])
def test_the_euler_jacobian_is_the_slope_over_the_pose_itself(cables, name):
    step = 1e-6
    for pose, frame in zip(random_poses(6, seed=6), FRAMES, strict=True):
        jacobian = geometry(cables[name], pose, frame).bar
        found = np.hstack([jacobian[:, :3], jacobian[:, 3:] @ euler_rate_map(pose)])
        for dof in range(6):
            change = step * np.eye(6)[dof]
            ends = [inverse_kinematics(cables[name], pose + s * change, frame) for s in (1, -1)]
            assert found[:, dof] == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-8)


@pytest.mark.parametrize("name", ["general", "pulleys"])
def test_moving_everything_together_changes_no_length(cables, name):
    for pose, frame in zip(random_poses(6, seed=7), FRAMES, strict=True):
        both = geometry(cables[name], pose, frame)
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


def pose_from_lengths(testbed, lengths, frame, guess):
    """Forward kinematics by least squares over distances that scipy's rotations give."""

    def residual(pose):
        return np.linalg.norm(vectors(testbed, pose, frame), axis=1) - lengths

    tolerances = dict.fromkeys(("xtol", "ftol", "gtol"), 1e-15)
    return least_squares(residual, guess, **tolerances).x


small = st.floats(-0.25, 0.25)


@settings(max_examples=30, deadline=None)
@given(pose=st.tuples(*[small] * 6), frame=st.sampled_from(range(len(FRAMES))))
def test_poses_come_back_from_their_lengths(general, cables, pose, frame):
    pose = np.add(pose, [0, 0, 2, 0, 0, 0])
    lengths = inverse_kinematics(cables["general"], pose, FRAMES[frame])
    guess = pose + 0.03 * np.array([1, -1, 1, -1, 1, -1])
    found = pose_from_lengths(general, lengths, FRAMES[frame], guess)
    assert found == pytest.approx(pose, abs=1e-8)


@pytest.mark.parametrize(("name", "rank"), [("general", 6), ("thesis", 5), ("point", 3)])
def test_lengths_fix_as_many_coordinates_as_the_attachments_allow(cables, name, rank):
    """Attachments on one line leave the turn about it free; at one point, all three angles."""
    bar = geometry(cables[name], [0.01, 0.02, 2, 0.01, 0.02, 0.03], ORIGIN).bar
    assert np.linalg.matrix_rank(bar, tol=1e-6) == rank
