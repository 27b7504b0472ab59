"""Cable block: end points and rates in, tension out. Columns of the parameter rows by name."""

from math import sqrt

from numba import njit
from numpy import float64
from numpy.typing import NDArray

from cspm_sim.kernels.rotation import Matrix, Vector, cross, rotate

Array = NDArray[float64]

# Columns of a cable's parameter row.
EXIT = 0
ATTACHMENT = 3
OFFSET_LENGTH = 6
LAW_SCALE = 7  # a, or 0 for the linear law
LAW_EXPONENT = 8  # b
AXIAL_RIGIDITY = 9  # E·A
FLOOR_TENSION = 10
FLOOR_SLOPE = 11  # g(floor tension)
TABLE_STEP = 12
DAMPING_CONSTANT = 13
DAMPING_SLOPE = 14
HAS_CABLE = 15
CABLE_COLUMNS = 16


@njit(cache=True, error_model="numpy")
def cable_span(
    cables: Array,
    i: int,
    exit_position: Vector,
    exit_rotation: Matrix,
    exit_velocity: Vector,
    exit_rate: Vector,
    body_position: Vector,
    body_rotation: Matrix,
    body_velocity: Vector,
    body_rate: Vector,
) -> tuple[Vector, Vector, float, float]:
    """Return direction u, lever arm R·b, length and length rate of cable i.

    u points from the exit to the attachment, thesis (2-2); the rate (2-6) counts both ends'
    velocities. Velocities and angular velocities are of the frames' origins in world axes.
    """
    ax, ay, az = rotate(exit_rotation, cables[i, EXIT], cables[i, EXIT + 1], cables[i, EXIT + 2])
    bx, by, bz = rotate(
        body_rotation,
        cables[i, ATTACHMENT],
        cables[i, ATTACHMENT + 1],
        cables[i, ATTACHMENT + 2],
    )
    x = body_position[0] + bx - exit_position[0] - ax
    y = body_position[1] + by - exit_position[1] - ay
    z = body_position[2] + bz - exit_position[2] - az
    length = sqrt(x * x + y * y + z * z)
    ux, uy, uz = x / length, y / length, z / length
    fx, fy, fz = cross(exit_rate[0], exit_rate[1], exit_rate[2], ax, ay, az)
    wx, wy, wz = cross(body_rate[0], body_rate[1], body_rate[2], bx, by, bz)
    rate = (
        ux * (body_velocity[0] + wx - exit_velocity[0] - fx)
        + uy * (body_velocity[1] + wy - exit_velocity[1] - fy)
        + uz * (body_velocity[2] + wz - exit_velocity[2] - fz)
    )
    return (ux, uy, uz), (bx, by, bz), length, rate


@njit(cache=True, error_model="numpy")
def law_curve(scaled: float, cables: Array, tables: Array, i: int) -> tuple[float, float]:
    """Return t and dt/ds of cable i's exponential law without cap at the scaled elongation s [N].

    `tables` holds t and dt/ds at equal steps of s beyond the floor; between them it is a cubic
    Hermite interpolant, beyond its end a straight line.
    """
    slope = cables[i, FLOOR_SLOPE]
    past = scaled - cables[i, FLOOR_TENSION] / slope
    if past <= 0.0:
        return slope * scaled, slope
    step = cables[i, TABLE_STEP]
    last = tables.shape[1] - 1
    place = past / step
    j = int(place)
    if j >= last:
        end = tables[i, last, 1]
        return tables[i, last, 0] + end * (past - last * step), end
    s = place - j
    t0, m0 = tables[i, j, 0], tables[i, j, 1] * step
    t1, m1 = tables[i, j + 1, 0], tables[i, j + 1, 1] * step
    d = t1 - t0
    c2 = 3.0 * d - 2.0 * m0 - m1
    c3 = m0 + m1 - 2.0 * d
    tension = t0 + s * (m0 + s * (c2 + s * c3))
    return tension, (m0 + s * (2.0 * c2 + s * 3.0 * c3)) / step


@njit(cache=True, error_model="numpy")
def cap_point(slope: float, cables: Array, tables: Array, i: int) -> tuple[float, float]:
    """Return s and t where dt/ds reaches `slope`, by bisection on the table's rising slopes."""
    floor = cables[i, FLOOR_TENSION] / cables[i, FLOOR_SLOPE]
    low, high = floor, floor + (tables.shape[1] - 1) * cables[i, TABLE_STEP]
    for _ in range(60):
        middle = 0.5 * (low + high)
        if law_curve(middle, cables, tables, i)[1] < slope:
            low = middle
        else:
            high = middle
    scaled = 0.5 * (low + high)
    return scaled, law_curve(scaled, cables, tables, i)[0]


@njit(cache=True, error_model="numpy")
def elastic_tension(
    elongation: float, elastic_length: float, cables: Array, tables: Array, i: int
) -> tuple[float, float]:
    """Return tension [N] and tangent stiffness [N/m] at an elongation l − l0 [m], thesis (3-7, 3-10).

    Zero for elongation ≤ 0; continuous, with continuous slope for elongation > 0, and increasing.
    """
    if elongation <= 0.0:
        return 0.0, 0.0
    cap = cables[i, AXIAL_RIGIDITY] / elastic_length
    if cables[i, LAW_SCALE] == 0.0:
        return cap * elongation, cap
    scale = cables[i, LAW_SCALE] / elastic_length ** cables[i, LAW_EXPONENT]
    tension, slope = law_curve(scale * elongation, cables, tables, i)
    if scale * slope <= cap:
        return tension, scale * slope
    scaled, tension = cap_point(cap / scale, cables, tables, i)
    return tension + cap * (elongation - scaled / scale), cap


@njit(cache=True, error_model="numpy")
def cable_tension(
    elongation: float, rate: float, elastic_length: float, cables: Array, tables: Array, i: int
) -> float:
    """Return the tension [N] of cable i, thesis (2-19), never negative.

    The damper acts in full above the floor tension and fades to nothing at zero elastic tension,
    which keeps the tension continuous where the cable becomes taut while it moves.
    """
    elastic, _ = elastic_tension(elongation, elastic_length, cables, tables, i)
    damping = cables[i, DAMPING_CONSTANT] - cables[i, DAMPING_SLOPE] * elastic_length
    engaged = min(1.0, elastic / cables[i, FLOOR_TENSION])
    return max(0.0, elastic + max(0.0, damping) * engaged * rate)
