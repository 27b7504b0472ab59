"""Cable lengths and the structure matrix of all cables at once."""

from numba import njit
from numpy import float64
from numpy.typing import NDArray

from cspm_sim.kernels.cable import EXIT, cable_span
from cspm_sim.kernels.rotation import cross, rotate, rotation_from_euler

Array = NDArray[float64]


@njit(cache=True, error_model="numpy")
def cable_geometry(
    cables: Array, bar_pose: Array, frame_pose: Array, lengths: Array, bar: Array, frame: Array
) -> None:
    """Write lengths (n,) and the rows of l̇ = bar·twist_bar + frame·twist_frame, each (n, 6).

    `cables` are parameter rows (see `kernels.cable`), poses x y z φ θ ψ, twists in world axes.
    """
    still = (0.0, 0.0, 0.0)
    bar_rotation = rotation_from_euler(bar_pose[3], bar_pose[4], bar_pose[5])
    bar_position = (bar_pose[0], bar_pose[1], bar_pose[2])
    frame_rotation = rotation_from_euler(frame_pose[3], frame_pose[4], frame_pose[5])
    frame_position = (frame_pose[0], frame_pose[1], frame_pose[2])
    for i in range(cables.shape[0]):
        (ux, uy, uz), (bx, by, bz), length, _ = cable_span(
            cables,
            i,
            frame_position,
            frame_rotation,
            still,
            still,
            bar_position,
            bar_rotation,
            still,
            still,
        )
        ax, ay, az = rotate(
            frame_rotation, cables[i, EXIT], cables[i, EXIT + 1], cables[i, EXIT + 2]
        )
        lengths[i] = length
        bar[i, 0], bar[i, 1], bar[i, 2] = ux, uy, uz
        bar[i, 3], bar[i, 4], bar[i, 5] = cross(bx, by, bz, ux, uy, uz)
        frame[i, 0], frame[i, 1], frame[i, 2] = -ux, -uy, -uz
        mx, my, mz = cross(ax, ay, az, ux, uy, uz)
        frame[i, 3], frame[i, 4], frame[i, 5] = -mx, -my, -mz
