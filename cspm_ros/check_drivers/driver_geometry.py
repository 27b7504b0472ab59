"""The machine's geometry over time, from measured poses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cspm_model.kernels.rotation import euler_from_quaternion
from cspm_model.kinematics import geometry, rotation
from cspm_msgs_py.testbed import Testbed
from cspm_ros.check_drivers.driver_observation import Array, Heard, seconds
from cspm_sim.parameters import plant_parameters

INSTANTS = 200


class Geometry(NamedTuple):
    """The machine at some instants.

    Attributes:
        start_ns: the first stamp [ns], from which times count.
        times: shape (k,) [s].
        lengths: of the cables, shape (k, n) [m].
        lift: upward force on the bar per newton of each cable's tension, shape (k, n).
        com_z: world z of the bar's centre of mass, shape (k,) [m].
        depth: world z of the bar's origin below the mean exit, shape (k,) [m].
    """

    start_ns: int
    times: Array
    lengths: Array
    lift: Array
    com_z: Array
    depth: Array


def geometry_over_time(testbed: Testbed, bar: Heard, frame: Heard | None) -> Geometry:
    """Return the geometry at up to 200 of the bar's stamps, evenly chosen.

    Args:
        testbed: a machine with a bar.
        bar: `/bar/pose`, finite.
        frame: `/winch_frame/pose`, finite, of which the last sample at each stamp counts; None
            where exits are points of the world.

    Raises:
        SingularityError: an exit and its attachment coincide.
    """
    cables = plant_parameters(testbed).cables
    com = np.array(testbed.bar.com if testbed.bar else np.zeros(3))
    exits = np.mean([cable.exit or (0.0, 0.0, 0.0) for cable in testbed.cables], axis=0)
    count = min(INSTANTS, len(bar.values))
    chosen = np.linspace(0, len(bar.values) - 1, count).astype(int)
    stamps = bar.value_stamp_ns[chosen]
    lengths, lift = np.empty((count, len(cables))), np.empty((count, len(cables)))
    com_z, depth = np.empty(count), np.empty(count)
    for i, (stamp, row) in enumerate(zip(stamps, bar.values[chosen], strict=True)):
        pose, base = pose_of(row), _frame_pose(frame, int(stamp))
        found = geometry(cables, pose, base)
        lengths[i], lift[i] = found.lengths, found.bar[:, 2]
        com_z[i] = pose[2] + (rotation(pose) @ com)[2]
        depth[i] = pose[2] - (base[:3] + rotation(base) @ exits)[2]
    return Geometry(int(stamps[0]), seconds(stamps - stamps[0]), lengths, lift, com_z, depth)


def pose_of(row: Array) -> Array:
    """Return x y z φ θ ψ of the row x y z qx qy qz qw."""
    return np.concatenate([row[:3], euler_from_quaternion(row[3:])])


def _frame_pose(frame: Heard | None, stamp_ns: int) -> Array:
    if frame is None:
        return np.zeros(6)
    i = int(np.searchsorted(frame.value_stamp_ns, stamp_ns, side="right")) - 1
    return pose_of(frame.values[max(0, i)])
