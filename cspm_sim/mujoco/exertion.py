"""What cables and damping exert on bar and winches, from the positions that MuJoCo holds."""

from math import cos, sin

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_msgs_py.testbed import Cable
from cspm_sim.mujoco.cable_law import FLOOR, LAW_COLUMNS, law_row, tension_at

Array = NDArray[np.float64]

# Columns of a cable's row after those of its law.
OFFSET, DAMPING, DAMPING_SLOPE, RADIUS, HAS_CABLE = range(LAW_COLUMNS, LAW_COLUMNS + 5)

RUNAWAY = 1e6  # no cable carries this [N]


def cable_row(cable: Cable) -> list[float]:
    """Return a cable's numbers in the order of the columns; zeros for a winch without cable."""
    radius = cable.wound_radius
    if cable.stiffness is None or cable.damping is None:
        return [0.0] * LAW_COLUMNS + [0.0, 0.0, 0.0, radius, 0.0]
    damping = cable.damping
    constant, slope = damping.factor * damping.constant, damping.factor * damping.slope
    return [*law_row(cable.stiffness), cable.offset_length, constant, slope, radius, 1.0]


@njit(cache=True)
def turning(angles: Array, rates: Array, out: Array) -> None:
    """Write ω [rad/s] in world axes of Euler angles φ θ ψ that change at `rates`.

    The sum of three turns: ψ̇ about the world's z, θ̇ about the yawed y, φ̇ about the body's x.
    """
    st, ct, sp, cp = sin(angles[1]), cos(angles[1]), sin(angles[2]), cos(angles[2])
    out[0] = -rates[1] * sp + rates[0] * ct * cp
    out[1] = rates[1] * cp + rates[0] * ct * sp
    out[2] = rates[2] - rates[0] * st


@njit(cache=True)
def _point_velocity(point: Array, body: Array, axis: int) -> float:
    """Return a component of the velocity of a body's point; `body` is origin, velocity, ω."""
    j, k = (axis + 1) % 3, (axis + 2) % 3
    return body[3 + axis] + body[6 + j] * (point[k] - body[k]) - body[6 + k] * (point[j] - body[j])


@njit(cache=True)
def _tension(length: float, rate: float, unstretched: float, winding: float, row: Array) -> float:
    """Return a cable's tension [N], thesis (2-19), with the damper faded below the floor.

    `rate` and `winding` are the rates of stretched and unstretched length [m/s].
    """
    elastic_length = unstretched + row[OFFSET]
    elastic = tension_at(length - unstretched, elastic_length, row)
    damping = max(0.0, row[DAMPING] - row[DAMPING_SLOPE] * elastic_length)
    damping *= min(1.0, elastic / row[FLOOR])
    return max(0.0, elastic + damping * (rate - winding))


@njit(cache=True)
def exert(
    ends: Array,
    frame: Array,
    body: Array,
    centre: Array,
    unstretched: Array,
    speeds: Array,
    rows: Array,
    drag: Array,
    across: Array,
    radii: Array,
    given: Array,
    held: Array,
    tensions: Array,
    winding: Array,
    wrench: Array,
) -> int:
    """Write tensions, rates of the unstretched lengths, and the wrench on the bar.

    Returns the first cable whose tension is beyond `RUNAWAY` or no number, -1 if there is none.

    Args:
        ends: exits, then attachments, in world axes, (2n, 3) [m].
        frame: origin, velocity, ω of the winch frame in world axes, (9,).
        body: the same of the bar.
        centre: the bar's centre of mass in world axes, (3,).
        unstretched: unstretched lengths, (n,) [m].
        speeds: motor speeds, (n,) [rad/s].
        rows: the cables, see `cable_row`.
        drag: damping of the bar per world axis, about its origin, (6,) [N·s/m, N·m·s/rad].
        across: what each attachment's velocity across its cable meets, and by how much the
            exit's lessens it, (n, 2) [N·s/m].
        radii: length wound per motor angle, (n,) [m/rad].
        given: length that each cable has gained beside its winding, (n,) [m].
        held: tension beside that of law and damper, (n,) [N].
        tensions: receives the tensions, (n,) [N].
        winding: receives the rates of the unstretched lengths, (n,) [m/s].
        wrench: receives force, and moment about the centre of mass, in world axes, (6,).
    """
    n, lost = rows.shape[0], -1
    force, dragged = np.zeros(3), np.zeros(3)
    for axis in range(3):
        wrench[axis] = -drag[axis] * body[3 + axis]
        wrench[3 + axis] = -drag[3 + axis] * body[6 + axis]
    _add_moment(body[:3], centre, wrench[:3].copy(), wrench)
    for i in range(n):
        tensions[i] = winding[i] = 0.0
        if rows[i, HAS_CABLE] == 0.0:
            continue
        start, end = ends[i], ends[n + i]
        length, rate, along = 0.0, 0.0, 0.0
        for axis in range(3):
            length += (end[axis] - start[axis]) ** 2
        length = length**0.5
        for axis in range(3):
            force[axis] = (start[axis] - end[axis]) / length
            near, far = _point_velocity(start, frame, axis), _point_velocity(end, body, axis)
            rate -= force[axis] * (far - near)
            dragged[axis] = across[i, 0] * far - across[i, 1] * near
            along += force[axis] * dragged[axis]
        winding[i] = -unstretched[i] / length * radii[i] * speeds[i]
        longer = unstretched[i] + given[i]
        tensions[i] = max(0.0, _tension(length, rate, longer, winding[i], rows[i]) + held[i])
        # Written so that NaN counts as well.
        if lost < 0 and not tensions[i] < RUNAWAY:
            lost = i
        # `force` is the unit vector towards the exit.
        for axis in range(3):
            force[axis] = (tensions[i] + along) * force[axis] - dragged[axis]
            wrench[axis] += force[axis]
        _add_moment(end, centre, force, wrench)
    return lost


@njit(cache=True)
def _add_moment(point: Array, centre: Array, force: Array, wrench: Array) -> None:
    for axis in range(3):
        j, k = (axis + 1) % 3, (axis + 2) % 3
        wrench[3 + axis] += (point[j] - centre[j]) * force[k] - (point[k] - centre[k]) * force[j]
