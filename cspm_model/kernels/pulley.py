"""A cable over a swivelling pulley at its exit: its length, its direction, and how that turns.

The cable enters the pulley at the exit, along the axis about which the pulley swivels. It winds
around the pulley by φ and leaves towards the attachment (Pott, Cable-Driven Parallel Robots, 2018,
section 4.5). As the pulley's plane holds the attachment, the length changes with the attachment's
motion along the cable alone, as without a pulley.
"""

from math import atan2, pi, sqrt

from numba import njit

from cspm_model.kernels.rotation import Vector, cross


@njit(cache=True, error_model="numpy", inline="always")
def _plane(apart: Vector, axis: Vector) -> tuple[float, float, Vector]:
    """Return height along the axis, distance from it, and the unit vector away from it."""
    x, y, z = apart
    height = x * axis[0] + y * axis[1] + z * axis[2]
    px, py, pz = x - height * axis[0], y - height * axis[1], z - height * axis[2]
    distance = sqrt(px * px + py * py + pz * pz)
    inverse = 1.0 / distance if distance > 0.0 else 0.0
    return height, distance, (px * inverse, py * inverse, pz * inverse)


@njit(cache=True, error_model="numpy", inline="always")
def _tangent(height: float, beyond: float, radius: float) -> tuple[float, float, float]:
    """Return free length, and the direction's parts away from the axis and along it.

    `beyond` is the attachment's distance from the pulley's centre, away from the axis. NaN inside
    the pulley, where no cable can end.
    """
    squared = beyond * beyond + height * height
    free = sqrt(squared - radius * radius) if squared > radius * radius else sqrt(-1.0)
    away = (free * beyond + radius * height) / squared
    along = (free * height - radius * beyond) / squared
    return free, away, along


@njit(cache=True, error_model="numpy", _nrt=False)
def around_pulley(apart: Vector, axis: Vector, radius: float) -> tuple[float, Vector]:
    """Return the length from exit to attachment [m] and the direction at the attachment.

    `apart` runs from exit to attachment [m], `axis` is the unit vector in which the cable enters.
    """
    height, distance, outward = _plane(apart, axis)
    free, away, along = _tangent(height, distance - radius, radius)
    wrapped = atan2(away, along)
    if wrapped < 0.0:
        wrapped += 2.0 * pi
    return radius * wrapped + free, (
        away * outward[0] + along * axis[0],
        away * outward[1] + along * axis[1],
        away * outward[2] + along * axis[2],
    )


@njit(cache=True, error_model="numpy", _nrt=False)
def pulley_turning(apart: Vector, axis: Vector, radius: float, velocity: Vector) -> Vector:
    """Return how fast the direction at the attachment turns [1/s].

    `velocity` is the attachment's against the frame [m/s]. In the pulley's plane the cable turns
    about its tangent point, across it about the swivelling axis.
    """
    height, distance, outward = _plane(apart, axis)
    free, away, along = _tangent(height, distance - radius, radius)
    sx, sy, sz = cross(*axis, *outward)
    ux = away * outward[0] + along * axis[0]
    uy = away * outward[1] + along * axis[1]
    uz = away * outward[2] + along * axis[2]
    nx, ny, nz = cross(sx, sy, sz, ux, uy, uz)
    vx, vy, vz = velocity
    within = (vx * nx + vy * ny + vz * nz) / free
    across = (vx * sx + vy * sy + vz * sz) * away / distance
    return within * nx + across * sx, within * ny + across * sy, within * nz + across * sz
