"""A function of one or two signals as values at knots, linear between them."""

from numba import njit
from numpy import float64
from numpy.typing import NDArray

Array = NDArray[float64]

# Numbers of a table: the signals that it reads, how many knots each has (the second 0: there is
# none), the signal that it adds to, then knots and values.
FIRST_SIGNAL = 0
FIRST_COUNT = 1
SECOND_SIGNAL = 2
SECOND_COUNT = 3
TARGET = 4
KNOTS = 5


@njit(cache=True, error_model="numpy", _nrt=False)
def _cell(table: Array, first: int, count: int, x: float) -> tuple[int, float]:
    """Return the knot at or below x, and the share of the way to the next; ends are held."""
    if not x > table[first]:
        return 0, 0.0
    if x >= table[first + count - 1]:
        return count - 2, 1.0
    low, high = 0, count - 1
    while high - low > 1:
        middle = (low + high) // 2
        if table[first + middle] <= x:
            low = middle
        else:
            high = middle
    return low, (x - table[first + low]) / (table[first + low + 1] - table[first + low])


@njit(cache=True, error_model="numpy", _nrt=False)
def table_value(table: Array, x: float, y: float) -> float:
    """Return the table's value at x of its first and y of its second signal, if it has one."""
    n, m = int(table[FIRST_COUNT]), int(table[SECOND_COUNT])
    i, along = _cell(table, KNOTS, n, x)
    values = KNOTS + n + m
    if m == 0:
        v = values + i
        return (1.0 - along) * table[v] + along * table[v + 1]
    j, across = _cell(table, KNOTS + n, m, y)
    v, w = values + i * m + j, values + (i + 1) * m + j
    lower = (1.0 - across) * table[v] + across * table[v + 1]
    upper = (1.0 - across) * table[w] + across * table[w + 1]
    return (1.0 - along) * lower + along * upper
