"""Quintic Hermite interpolation of a prescribed motion."""

from math import floor

from numba import njit
from numpy import float64
from numpy.typing import NDArray


@njit(cache=True)
def evaluate_motion(
    time: float, knots: NDArray[float64], spacing: float, periodic: bool, out: NDArray[float64]
) -> None:
    """Write pose, first and second derivative (18 numbers) at `time` [s] to `out`.

    `knots` has shape (n, 18) with rows pose(6), rate(6), acceleration(6); see `Motion`.
    """
    n = knots.shape[0]
    span = n * spacing if periodic else (n - 1) * spacing
    if not periodic and (time <= 0.0 or time >= span):
        row = 0 if time <= 0.0 else n - 1
        inside = n > 1 and (time == 0.0 or time == span)
        for d in range(6):
            out[d] = knots[row, d]
            out[6 + d] = knots[row, 6 + d] if inside else 0.0
            out[12 + d] = knots[row, 12 + d] if inside else 0.0
        return
    if periodic:
        time = time - floor(time / span) * span
    i = int(time / spacing)
    if i >= n - (0 if periodic else 1):
        i -= 1
    j = i + 1 if i + 1 < n else 0
    s = time / spacing - i
    h = spacing
    for d in range(6):
        p0, v0, a0 = knots[i, d], knots[i, 6 + d] * h, knots[i, 12 + d] * (0.5 * h * h)
        p1, v1, a1 = knots[j, d], knots[j, 6 + d] * h, knots[j, 12 + d] * (0.5 * h * h)
        # p(s) = p0 + v0 s + a0 s² + c3 s³ + c4 s⁴ + c5 s⁵ through both ends' p, v, a
        e0 = p1 - p0 - v0 - a0
        e1 = v1 - v0 - 2.0 * a0
        e2 = a1 - a0
        c3 = 10.0 * e0 - 4.0 * e1 + e2
        c4 = -15.0 * e0 + 7.0 * e1 - 2.0 * e2
        c5 = 6.0 * e0 - 3.0 * e1 + e2
        out[d] = p0 + s * (v0 + s * (a0 + s * (c3 + s * (c4 + s * c5))))
        out[6 + d] = (v0 + s * (2.0 * a0 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)))) / h
        out[12 + d] = (2.0 * a0 + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5))) / (h * h)
