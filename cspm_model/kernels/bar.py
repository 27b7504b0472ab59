"""Bar block: forces and moments in, accelerations out (Newton and Euler about the mass centre)."""

from numba import njit
from numpy import float64
from numpy.typing import NDArray

from cspm_model.kernels.rotation import Matrix, Vector, cross, rotate, rotate_back

Array = NDArray[float64]

# Entries of the bar's parameter array.
MASS = 0
COM = 1
INERTIA = 4  # about the centre of mass, bar axes, row by row
INVERSE_INERTIA = 13
GRAVITY = 22
BAR_COLUMNS = 23


@njit(cache=True, error_model="numpy", inline="always")
def _times(bar: Array, first: int, x: float, y: float, z: float) -> Vector:
    return (
        bar[first] * x + bar[first + 1] * y + bar[first + 2] * z,
        bar[first + 3] * x + bar[first + 4] * y + bar[first + 5] * z,
        bar[first + 6] * x + bar[first + 7] * y + bar[first + 8] * z,
    )


@njit(cache=True, error_model="numpy", inline="always")
def bar_acceleration(
    bar: Array, rotation: Matrix, rate: Vector, force: Vector, moment: Vector
) -> tuple[Vector, Vector]:
    """Return v̇ of the bar frame's origin (world axes) and ω̇ (bar axes).

    Force and moment act about the bar frame's origin, in world axes, without gravity; `rate` is ω
    in bar axes. Thesis (2-12) with full inertia and any centre of mass.
    """
    cx, cy, cz = bar[COM], bar[COM + 1], bar[COM + 2]
    rx, ry, rz = rotate(rotation, cx, cy, cz)
    ox, oy, oz = cross(rx, ry, rz, force[0], force[1], force[2])
    mx, my, mz = rotate_back(rotation, moment[0] - ox, moment[1] - oy, moment[2] - oz)
    wx, wy, wz = rate
    hx, hy, hz = _times(bar, INERTIA, wx, wy, wz)
    gx, gy, gz = cross(wx, wy, wz, hx, hy, hz)
    ax, ay, az = _times(bar, INVERSE_INERTIA, mx - gx, my - gy, mz - gz)
    # a_origin = a_com − ω̇ × c − ω × (ω × c)
    tx, ty, tz = cross(ax, ay, az, cx, cy, cz)
    sx, sy, sz = cross(wx, wy, wz, cx, cy, cz)
    nx, ny, nz = cross(wx, wy, wz, sx, sy, sz)
    px, py, pz = rotate(rotation, tx + nx, ty + ny, tz + nz)
    mass = bar[MASS]
    linear = (force[0] / mass - px, force[1] / mass - py, force[2] / mass + bar[GRAVITY] - pz)
    return linear, (ax, ay, az)
