"""Slopes over the cables' ends, against moved ends, and against MuJoCo's tendons."""

import mujoco
import numpy as np
import pytest
from machines import build, general_content, pulley_content, random_poses, route_content
from scipy.spatial.transform import Rotation

from cspm_model.end_slopes import end_slopes
from cspm_model.kernels.cable import ATTACHMENT, EXIT
from cspm_model.kinematics import geometry
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import InputError

BARS = random_poses(4, seed=31)
FRAMES = random_poses(4, seed=32, centre=(0.1, -0.2, 0.05), reach=0.2, angle=0.3)
TENSIONS = np.linspace(5.0, 40.0, 8)
STEP = 1e-6
MACHINES = {
    name: nominal_parameters(build(content)).cables
    for name, content in (
        ("points", general_content()),
        ("pulleys", pulley_content()),
        ("routes", route_content()),
    )
}


def lengths_and_wrench(rows, k):
    """By another road: the Jacobian of a machine whose ends are elsewhere."""
    found = geometry(rows, BARS[k], FRAMES[k])
    return np.concatenate([found.lengths, -found.bar.T @ TENSIONS])


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("column", [EXIT, ATTACHMENT])
def test_they_are_the_slopes_of_a_machine_with_moved_ends(name, column):
    rows = MACHINES[name]
    found = end_slopes(rows, BARS, FRAMES)
    lengths, wrenches = (found[0], found[2]) if column == EXIT else (found[1], found[3])
    for k, i, axis in np.ndindex(len(BARS), len(rows), 3):
        ends = []
        for sign in (1.0, -1.0):
            moved = rows.copy()
            moved[i, column + axis] += sign * STEP
            ends.append(lengths_and_wrench(moved, k))
        slope = (ends[0] - ends[1]) / (2.0 * STEP)
        own = lengths[k, i, axis] * np.eye(len(rows))[i]
        assert slope[: len(rows)] == pytest.approx(own, abs=1e-8)
        wrench = TENSIONS[i] * wrenches[k, i, :, axis]
        assert slope[len(rows) :] == pytest.approx(wrench, abs=3e-7)


def by_mujoco(exits, attachments, k):
    """Lengths of tendons between sites of two bodies."""

    def body(pose, points, name):
        quaternion = Rotation.from_euler("ZYX", pose[:2:-1]).as_quat()[[3, 0, 1, 2]]
        sites = "".join(
            f'<site name="{name}{i}" pos="{" ".join(repr(float(v)) for v in point)}"/>'
            for i, point in enumerate(points)
        )
        place, turn = (" ".join(repr(float(v)) for v in part) for part in (pose[:3], quaternion))
        return f'<body pos="{place}" quat="{turn}">{sites}</body>'

    tendons = "".join(
        f'<spatial><site site="a{i}"/><site site="b{i}"/></spatial>' for i in range(len(exits))
    )
    model = mujoco.MjModel.from_xml_string(
        f"<mujoco><worldbody>{body(FRAMES[k], exits, 'a')}{body(BARS[k], attachments, 'b')}"
        f"</worldbody><tendon>{tendons}</tendon></mujoco>"
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return np.array(data.ten_length)


def test_lengths_change_as_those_of_tendons():
    rows, step = MACHINES["points"], 1e-5
    exits, attachments = rows[:, EXIT : EXIT + 3], rows[:, ATTACHMENT : ATTACHMENT + 3]
    found = end_slopes(rows, BARS, FRAMES)
    for axis in range(3):
        shift = step * np.eye(3)[axis]
        of_exit = [by_mujoco(exits + s * shift, attachments, 1) for s in (1, -1)]
        of_attachment = [by_mujoco(exits, attachments + s * shift, 1) for s in (1, -1)]
        slope = (of_exit[0] - of_exit[1]) / (2 * step)
        assert found.exit_lengths[1, :, axis] == pytest.approx(slope, abs=1e-8)
        slope = (of_attachment[0] - of_attachment[1]) / (2 * step)
        assert found.attachment_lengths[1, :, axis] == pytest.approx(slope, abs=1e-8)


def test_a_missing_pose_leaves_nothing_known_at_its_instant_alone():
    bars = BARS.copy()
    bars[2, 4] = np.nan
    for found, whole in zip(
        end_slopes(MACHINES["points"], bars, FRAMES),
        end_slopes(MACHINES["points"], BARS, FRAMES),
        strict=True,
    ):
        assert np.isnan(found[2]).any()
        np.testing.assert_array_equal(np.delete(found, 2, axis=0), np.delete(whole, 2, axis=0))


def test_a_winch_without_cable_has_none():
    winch = {"name": "w", "drum_radius": 0.02, "rotor_inertia": 1e-4, "torque_limit": 1.0}
    rows = nominal_parameters(build({"name": "bare", "cables": [winch]})).cables
    for found in end_slopes(rows, np.zeros((1, 6)), np.zeros((1, 6))):
        np.testing.assert_array_equal(found, 0.0)


def test_poses_of_another_shape_are_refused():
    with pytest.raises(InputError, match=r"poses of shapes \(6,\) and \(4, 6\), allowed: both"):
        end_slopes(MACHINES["points"], BARS[0], FRAMES)
