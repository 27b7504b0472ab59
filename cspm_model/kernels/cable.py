"""Cable block: end points and rates in, tension out. Columns of the parameter rows by name."""

from math import exp, log, sqrt

from numba import njit
from numpy import float64
from numpy.typing import NDArray

from cspm_model.kernels.pulley import around_pulley
from cspm_model.kernels.rotation import Placement, Vector, cross, rotate
from cspm_model.kernels.route import ROUTE_COLUMNS, STOP_COUNT, along_route

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
FLOOR_SCALED = 12  # scaled elongation at the floor tension
TABLE_STEP = 13  # scaled elongation per step of the table
TABLE_STEPS = 14  # its reciprocal: a product costs less than a quotient
DAMPING_CONSTANT = 15
DAMPING_SLOPE = 16
HAS_CABLE = 17
# Columns of its winch, at the motor shaft.
RADIUS = 18  # drum radius / gear ratio: cable wound per radian of the motor [m]
INERTIA = 19  # all that turns [kg·m²]
TORQUE_LIMIT = 20
# What only effects read.
GEAR_RATIO = 21
GRAVITY_HERE = 22
# Of the way between exit and attachment.
PULLEY_RADIUS = 23  # 0 without a pulley
PULLEY_AXIS = 24  # unit vector, winch frame axes
PARTS = 27  # of the cable, between two blocks
ROUTE = 28  # columns of `kernels.route`; no stops where the cable ends at the attachment
CABLE_COLUMNS = ROUTE + ROUTE_COLUMNS


# Columns of a cable's span.
DIRECTION = 0  # u, from exit to attachment, world axes; of all parts and stops their sum
ARM = 3  # R·b, from the body's origin to the attachment, world axes
LENGTH = 6  # of all parts
RATE = 7
TENSION = 8
COUPLE = 9  # of a route: what its slope over the body's turn has beyond ARM × DIRECTION [m]
SPAN_COLUMNS = 12


@njit(cache=True, error_model="numpy")
def routed(
    cables: Array, i: int, frame: Placement, body: Placement, arm: Vector
) -> tuple[float, Vector, Vector]:
    """Return length, direction and couple of a cable with a route."""
    fp, fr, bp = frame[0], frame[1], body[0]
    ax, ay, az = rotate(fr, cables[i, EXIT], cables[i, EXIT + 1], cables[i, EXIT + 2])
    axis = rotate(
        fr, cables[i, PULLEY_AXIS], cables[i, PULLEY_AXIS + 1], cables[i, PULLEY_AXIS + 2]
    )
    length, pull, (mx, my, mz) = along_route(
        (fp[0] + ax, fp[1] + ay, fp[2] + az),
        axis,
        cables[i, PULLEY_RADIUS],
        (bp[0] + arm[0], bp[1] + arm[1], bp[2] + arm[2]),
        cables[i, ROUTE:],
        frame,
        body,
    )
    tx, ty, tz = cross(*arm, *pull)
    return length, pull, (mx - tx, my - ty, mz - tz)


@njit(cache=True, error_model="numpy", inline="always")
def cable_spans(cables: Array, frame: Placement, body: Placement, spans: Array) -> None:
    """Write direction, lever arm, length and length rate of all cables to `spans`.

    The direction is that of thesis (2-2); the rate (2-6) counts both ends' velocities.
    """
    fp, fr, fv, fw = frame
    bp, br, bv, bw = body
    for i in range(cables.shape[0]):
        ax, ay, az = rotate(fr, cables[i, EXIT], cables[i, EXIT + 1], cables[i, EXIT + 2])
        bx, by, bz = rotate(
            br, cables[i, ATTACHMENT], cables[i, ATTACHMENT + 1], cables[i, ATTACHMENT + 2]
        )
        x = bp[0] + bx - fp[0] - ax
        y = bp[1] + by - fp[1] - ay
        z = bp[2] + bz - fp[2] - az
        length = sqrt(x * x + y * y + z * z)
        # A winch without cable has no length and no direction.
        inverse = 1.0 / length if length > 0.0 else 0.0
        ux, uy, uz = x * inverse, y * inverse, z * inverse
        if cables[i, PULLEY_RADIUS] > 0.0:
            axis = rotate(
                fr, cables[i, PULLEY_AXIS], cables[i, PULLEY_AXIS + 1], cables[i, PULLEY_AXIS + 2]
            )
            length, (ux, uy, uz) = around_pulley((x, y, z), axis, cables[i, PULLEY_RADIUS])
            # The cable's line meets the attachment, not the exit.
            ax, ay, az = ax + x, ay + y, az + z
        cx = cy = cz = 0.0
        if cables[i, ROUTE + STOP_COUNT] > 0.0:
            length, (ux, uy, uz), (cx, cy, cz) = routed(cables, i, frame, body, (bx, by, bz))
            ax, ay, az = bp[0] + bx - fp[0], bp[1] + by - fp[1], bp[2] + bz - fp[2]
        parts = cables[i, PARTS]
        length, ux, uy, uz = parts * length, parts * ux, parts * uy, parts * uz
        ex, ey, ez = cross(fw[0], fw[1], fw[2], ax, ay, az)
        wx, wy, wz = cross(bw[0], bw[1], bw[2], bx, by, bz)
        spans[i, 0], spans[i, 1], spans[i, 2] = ux, uy, uz
        spans[i, 3], spans[i, 4], spans[i, 5] = bx, by, bz
        spans[i, LENGTH] = length
        spans[i, RATE] = (
            ux * (bv[0] + wx - fv[0] - ex)
            + uy * (bv[1] + wy - fv[1] - ey)
            + uz * (bv[2] + wz - fv[2] - ez)
        ) + (cx * (bw[0] - fw[0]) + cy * (bw[1] - fw[1]) + cz * (bw[2] - fw[2]))
        spans[i, COUPLE], spans[i, COUPLE + 1], spans[i, COUPLE + 2] = cx, cy, cz


@njit(cache=True, error_model="numpy", inline="always")
def law_curve(scaled: float, cables: Array, tables: Array, i: int) -> tuple[float, float]:
    """Return t and dt/ds of cable i's exponential law without cap at the scaled elongation s [N].

    `tables` holds t and dt/ds at equal steps of s beyond the floor; between them it is a cubic
    Hermite interpolant, beyond its end a straight line.
    """
    past = scaled - cables[i, FLOOR_SCALED]
    if past <= 0.0:
        return cables[i, FLOOR_SLOPE] * scaled, cables[i, FLOOR_SLOPE]
    step = cables[i, TABLE_STEP]
    last = tables.shape[1] - 1
    place = past * cables[i, TABLE_STEPS]
    j = int(place)
    if j >= last:
        end = tables[i, last, 1]
        return tables[i, last, 0] + end * (place - last) * step, end
    s = place - j
    t0, g0 = tables[i, j, 0], tables[i, j, 1]
    t1, g1 = tables[i, j + 1, 0], tables[i, j + 1, 1]
    d = (t1 - t0) * cables[i, TABLE_STEPS]
    c2 = 3.0 * d - 2.0 * g0 - g1
    c3 = g0 + g1 - 2.0 * d
    tension = t0 + s * (g0 + s * (c2 + s * c3)) * step
    return tension, g0 + s * (2.0 * c2 + s * 3.0 * c3)


@njit(cache=True, error_model="numpy", _nrt=False)
def _capped_tension(
    elongation: float, elastic_length: float, scale: float, cables: Array, tables: Array, i: int
) -> tuple[float, float]:
    """Return tension and stiffness past the cap, a line of slope E·A/l from where both meet."""
    cap = cables[i, AXIAL_RIGIDITY] / elastic_length
    wanted = cap / scale
    low, high = 0, tables.shape[1] - 1
    while high - low > 1:
        middle = (low + high) // 2
        if tables[i, middle, 1] < wanted:
            low = middle
        else:
            high = middle
    # Within its interval the slope is the parabola of `law_curve`.
    g0, g1 = tables[i, low, 1], tables[i, high, 1]
    d = (tables[i, high, 0] - tables[i, low, 0]) * cables[i, TABLE_STEPS]
    linear, quadratic = 2.0 * (3.0 * d - 2.0 * g0 - g1), 3.0 * (g0 + g1 - 2.0 * d)
    missing = wanted - g0
    s = 0.0
    if missing > 0.0:
        s = 2.0 * missing / (linear + sqrt(linear * linear + 4.0 * quadratic * missing))
    scaled = cables[i, FLOOR_SCALED] + (low + s) * cables[i, TABLE_STEP]
    tension, _ = law_curve(scaled, cables, tables, i)
    return tension + cap * (elongation - scaled / scale), cap


@njit(cache=True, error_model="numpy", inline="always")
def law_scale(elastic_length: float, cables: Array, i: int) -> float:
    """Return a/l^b [N/m], which turns cable i's elongation into the scaled one; 0 if linear."""
    if cables[i, LAW_SCALE] == 0.0:
        return 0.0
    # Faster than a power, in the most expensive line of the plant.
    return cables[i, LAW_SCALE] * exp(-cables[i, LAW_EXPONENT] * log(elastic_length))


@njit(cache=True, error_model="numpy", inline="always")
def elastic_tension(
    elongation: float, elastic_length: float, scale: float, cables: Array, tables: Array, i: int
) -> tuple[float, float]:
    """Return tension [N] and tangent stiffness [N/m] at an elongation [m], thesis (3-7, 3-10).

    `scale` is `law_scale` at this elastic length. Zero for elongation ≤ 0; continuous, with
    continuous slope for elongation > 0, and increasing.
    """
    if elongation <= 0.0:
        return 0.0, 0.0
    if scale > 0.0:
        tension, slope = law_curve(scale * elongation, cables, tables, i)
        if scale * slope * elastic_length <= cables[i, AXIAL_RIGIDITY]:
            return tension, scale * slope
        return _capped_tension(elongation, elastic_length, scale, cables, tables, i)
    stiffness = cables[i, AXIAL_RIGIDITY] / elastic_length
    return stiffness * elongation, stiffness


@njit(cache=True, error_model="numpy", inline="always")
def cable_tensions(
    cables: Array, tables: Array, state: Array, first: int, spans: Array, rates: Array
) -> None:
    """Write the tensions [N] of all cables, thesis (2-19), never negative, to `spans`.

    `state[first:]` holds unstretched lengths, angles and speeds; the rates of the unstretched
    lengths go to `rates[first:]`. The damper acts in full above the floor tension and fades to
    nothing at zero elastic tension, which keeps the tension continuous where the cable becomes
    taut while it moves.
    """
    n = cables.shape[0]
    # A loop of its own: a processor overlaps these slow powers, but not across what follows.
    for i in range(n):
        spans[i, TENSION] = law_scale(state[first + i] + cables[i, OFFSET_LENGTH], cables, i)
    for i in range(n):
        unstretched = state[first + i]
        # The winch winds stretched cable, thesis (2-16..2-18).
        length = spans[i, LENGTH] if spans[i, LENGTH] > 0.0 else 1.0
        rate = -unstretched * cables[i, RADIUS] * state[first + 2 * n + i] / length
        elastic_length = unstretched + cables[i, OFFSET_LENGTH]
        elastic, _ = elastic_tension(
            spans[i, LENGTH] - unstretched, elastic_length, spans[i, TENSION], cables, tables, i
        )
        damping = cables[i, DAMPING_CONSTANT] - cables[i, DAMPING_SLOPE] * elastic_length
        if damping < 0.0:
            damping = 0.0
        if elastic < cables[i, FLOOR_TENSION]:
            damping *= elastic / cables[i, FLOOR_TENSION]
        tension = elastic + damping * (spans[i, RATE] - rate)
        has_cable = cables[i, HAS_CABLE] != 0.0
        spans[i, TENSION] = tension if tension > 0.0 and has_cable else 0.0
        rates[first + i] = rate if has_cable else 0.0


@njit(cache=True, error_model="numpy", inline="always")
def cable_wrench(spans: Array) -> tuple[Vector, Vector]:
    """Return force and moment of the cables on the body about its origin, −Jᵀt of (2-13)."""
    fx = fy = fz = mx = my = mz = 0.0
    for i in range(spans.shape[0]):
        tension = -spans[i, TENSION]
        x, y, z = tension * spans[i, 0], tension * spans[i, 1], tension * spans[i, 2]
        nx, ny, nz = cross(spans[i, ARM], spans[i, ARM + 1], spans[i, ARM + 2], x, y, z)
        fx, fy, fz = fx + x, fy + y, fz + z
        cx, cy, cz = spans[i, COUPLE], spans[i, COUPLE + 1], spans[i, COUPLE + 2]
        mx, my, mz = mx + nx + tension * cx, my + ny + tension * cy, mz + nz + tension * cz
    return (fx, fy, fz), (mx, my, mz)
