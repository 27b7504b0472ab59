"""Structure matrices of the tension distribution."""

import numpy as np
from scipy.spatial.transform import Rotation

from cspm_model.kernels.rows import pose_row

WEIGHT = 4.06 * 9.81
HOLD = np.array([0.0, 0.0, -WEIGHT, 0.0, 0.0, 0.0])
HOME = np.array([0.0, 0.0, 2.0, 0.0, 0.0, 0.0])


def row(pose):
    out = np.empty(7)
    pose_row(np.asarray(pose, dtype=float), out)
    return out


def structure(testbed, bar_pose, frame_pose):
    """The 6 rows of wrench per tension, from the file's points: each cable pulls at the bar."""
    place, turn = bar_pose[:3], Rotation.from_euler("ZYX", bar_pose[:2:-1])
    base, base_turn = frame_pose[:3], Rotation.from_euler("ZYX", frame_pose[:2:-1])
    columns = []
    for cable in testbed.cables:
        arm = turn.apply(cable.attachment)
        pull = base + base_turn.apply(cable.exit) - (place + arm)
        pull = pull / np.linalg.norm(pull)
        columns.append(np.concatenate([pull, np.cross(arm, pull)]))
    return np.array(columns).T
