"""A cable over points and pulleys on both bodies: its length, and its pull on the bar.

Pulleys swivel freely about their centres: the plane of each holds the cable before and behind it,
and the pulley lies inside the cable's bend. The length is stationary over what swivels and over
where the cable touches. So it changes with the stops' own motion alone, and per newton each stop
is pulled by the unit vectors of the free cable on both sides of it.
"""

from math import acos, atan2, pi, sqrt

import numpy as np
from numba import njit
from numpy import float64
from numpy.typing import NDArray

from cspm_model.kernels.pulley import around_pulley
from cspm_model.kernels.rotation import Placement, Vector, cross, rotate

Array = NDArray[float64]

# A route's columns: how many stops follow the exit, then those of each.
STOP_COUNT = 0
FIRST_STOP = 1
BODY, PLACE, RADIUS, STOP_COLUMNS = 0, 1, 4, 5
ON_FRAME, ON_BAR, AT_ATTACHMENT = 0.0, 1.0, 2.0
MOST_STOPS = 16
ROUTE_COLUMNS = FIRST_STOP + STOP_COLUMNS * MOST_STOPS

# Columns of a stop that is placed, world axes: its centre, where the cable touches it first, and
# where last [m].
_CENTRE, _FIRST, _LAST, _PLACED = 0, 3, 6, 9
# A sweep leaves of an error the product of radius over distance of neighbouring pulleys.
_SWEEPS, _STILL = 60, 1e-14


@njit(cache=True, error_model="numpy")
def _unit(x: float, y: float, z: float) -> tuple[float, Vector]:
    """Return length and direction; no direction of length zero."""
    length = sqrt(x * x + y * y + z * z)
    inverse = 1.0 / length if length > 0.0 else 0.0
    return length, (x * inverse, y * inverse, z * inverse)


@njit(cache=True, error_model="numpy")
def _between(placed: Array, a: int, b: int, column: int) -> tuple[float, Vector]:
    """Return length and direction from where the cable leaves stop a to a point of stop b."""
    return _unit(
        placed[b, column] - placed[a, _LAST],
        placed[b, column + 1] - placed[a, _LAST + 1],
        placed[b, column + 2] - placed[a, _LAST + 2],
    )


@njit(cache=True, error_model="numpy")
def _across(before: Vector, after: Vector) -> Vector:
    """Return the unit vector about which the cable bends from one direction to another."""
    sine, normal = _unit(*cross(*before, *after))
    if sine > 0.0:
        return normal
    # It comes back as it went: any plane that holds it gives the same length.
    x, y, z = before
    if abs(x) <= abs(y) and abs(x) <= abs(z):
        return _unit(0.0, z, -y)[1]
    return _unit(-z, 0.0, x)[1] if abs(y) <= abs(z) else _unit(y, -x, 0.0)[1]


@njit(cache=True, error_model="numpy")
def _touch(there: Vector, normal: Vector, share: float, sense: float) -> Vector:
    """Return the direction from a centre to where a tangent from `there` touches the rim.

    `there` is a direction, `share` the radius over the distance.
    """
    rise = sense * sqrt(1.0 - share * share)
    tx, ty, tz = cross(*normal, *there)
    x, y, z = there
    return share * x + rise * tx, share * y + rise * ty, share * z + rise * tz


@njit(cache=True, error_model="numpy")
def _set(placed: Array, k: int, column: int, radius: float, rim: Vector) -> float:
    """Put a point of stop k's rim in that direction; return how far it moved [m]."""
    moved = 0.0
    for d in range(3):
        value = placed[k, _CENTRE + d] + radius * rim[d]
        moved += abs(value - placed[k, column + d])
        placed[k, column + d] = value
    return moved


@njit(cache=True, error_model="numpy")
def _wind(placed: Array, k: int, radius: float) -> float:
    """Bring the cable around stop k to where its neighbours are; return how far it moved [m]."""
    cx, cy, cz = placed[k, _CENTRE], placed[k, _CENTRE + 1], placed[k, _CENTRE + 2]
    near, before = _between(placed, k - 1, k, _CENTRE)
    far, after = _unit(
        placed[k + 1, _FIRST] - cx, placed[k + 1, _FIRST + 1] - cy, placed[k + 1, _FIRST + 2] - cz
    )
    normal = _across(before, after)
    back = (-before[0], -before[1], -before[2])
    first = _set(placed, k, _FIRST, radius, _touch(back, normal, radius / near, 1.0))
    last = _set(placed, k, _LAST, radius, _touch(after, normal, radius / far, -1.0))
    return first if first > last else last


@njit(cache=True, error_model="numpy")
def _wound(placed: Array, k: int, radius: float) -> float:
    """Return the arc that the cable winds around stop k [m]."""
    near, to_centre = _between(placed, k - 1, k, _CENTRE)
    cx, cy, cz = placed[k, _CENTRE], placed[k, _CENTRE + 1], placed[k, _CENTRE + 2]
    far, after = _unit(
        placed[k + 1, _FIRST] - cx, placed[k + 1, _FIRST + 1] - cy, placed[k + 1, _FIRST + 2] - cz
    )
    sine, _ = _unit(*cross(*to_centre, *after))
    cosine = to_centre[0] * after[0] + to_centre[1] * after[1] + to_centre[2] * after[2]
    return radius * (pi + atan2(sine, cosine) - acos(radius / near) - acos(radius / far))


@njit(cache=True, error_model="numpy")
def _leave(placed: Array, axis: Vector, radius: float) -> tuple[float, float]:
    """Let the cable leave the exit towards the next stop; return its length [m], and how it moved.

    Over a pulley it leaves along the line that meets that stop.
    """
    apart = (
        placed[1, _FIRST] - placed[0, _CENTRE],
        placed[1, _FIRST + 1] - placed[0, _CENTRE + 1],
        placed[1, _FIRST + 2] - placed[0, _CENTRE + 2],
    )
    distance, _ = _unit(*apart)
    if radius == 0.0:
        return distance, 0.0
    length, direction = around_pulley(apart, axis, radius)
    moved = 0.0
    for d in range(3):
        # Any point of that line stands for the pulley.
        value = placed[1, _FIRST + d] - distance * direction[d]
        moved += abs(value - placed[0, _LAST + d])
        placed[0, _LAST + d] = value
    return length, moved


# Callers without numba's runtime pass that on to what they compile, so what allocates asks for it.
@njit(cache=True, error_model="numpy", _nrt=True)
def _place(
    leaves: Vector, attachment: Vector, route: Array, frame: Placement, body: Placement
) -> Array:
    """Return the stops as points, (stops, _PLACED)."""
    count = int(route[STOP_COUNT])
    placed = np.empty((count + 1, _PLACED))
    for k in range(count + 1):
        point = leaves
        if k > 0:
            first = FIRST_STOP + STOP_COLUMNS * (k - 1)
            origin, turn = (frame[0], frame[1])
            if route[first + BODY] == ON_BAR:
                origin, turn = (body[0], body[1])
            column = first + PLACE
            x, y, z = rotate(turn, route[column], route[column + 1], route[column + 2])
            point = (origin[0] + x, origin[1] + y, origin[2] + z)
            if route[first + BODY] == AT_ATTACHMENT:
                point = attachment
        for column in (_CENTRE, _FIRST, _LAST):
            for d in range(3):
                placed[k, column + d] = point[d]
    return placed


@njit(cache=True, error_model="numpy", _nrt=True)  # as `_place`
def along_route(
    leaves: Vector,
    axis: Vector,
    radius: float,
    attachment: Vector,
    route: Array,
    frame: Placement,
    body: Placement,
) -> tuple[float, Vector, Vector]:
    """Return the length [m], and its slopes over the bar's place and turn about its origin [1, m].

    NaN where a cable would have to run through a pulley.

    Args:
        leaves: the exit, world axes [m].
        axis: in which the cable enters a pulley at the exit, world axes.
        radius: of that pulley [m]; 0 without.
        attachment: the first stop on the bar, world axes [m].
        route: the stops behind the exit, (ROUTE_COLUMNS,).
        frame: placement of the winch frame.
        body: of the bar.
    """
    placed = _place(leaves, attachment, route, frame, body)
    last = len(placed) - 1
    length = 0.0
    for _ in range(_SWEEPS):
        length, moved = _leave(placed, axis, radius)
        for k in range(1, last):
            rim = route[FIRST_STOP + STOP_COLUMNS * (k - 1) + RADIUS]
            if rim > 0.0:
                moved += _wind(placed, k, rim)
        if moved <= _STILL:
            break
    for k in range(1, last):
        rim = route[FIRST_STOP + STOP_COLUMNS * (k - 1) + RADIUS]
        length += _between(placed, k, k + 1, _FIRST)[0]
        length += _wound(placed, k, rim) if rim > 0.0 else 0.0
    pull, moment = _slopes(placed, route, body[0])
    return length, pull, moment


@njit(cache=True, error_model="numpy")
def _slopes(placed: Array, route: Array, origin: Vector) -> tuple[Vector, Vector]:
    """Return the length's slopes over place and turn of a bar with this origin."""
    last = len(placed) - 1
    px = py = pz = mx = my = mz = 0.0
    ux, uy, uz = _between(placed, 0, 1, _FIRST)[1]
    for k in range(1, last + 1):
        nx = ny = nz = 0.0
        if k < last:
            nx, ny, nz = _between(placed, k, k + 1, _FIRST)[1]
        if route[FIRST_STOP + STOP_COLUMNS * (k - 1) + BODY] != ON_FRAME:
            x, y, z = ux - nx, uy - ny, uz - nz
            tx, ty, tz = cross(
                placed[k, _CENTRE] - origin[0],
                placed[k, _CENTRE + 1] - origin[1],
                placed[k, _CENTRE + 2] - origin[2],
                *(x, y, z),
            )
            px, py, pz, mx, my, mz = px + x, py + y, pz + z, mx + tx, my + ty, mz + tz
        ux, uy, uz = nx, ny, nz
    return (px, py, pz), (mx, my, mz)
