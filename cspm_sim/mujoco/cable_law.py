"""The cable's stiffness law in the form elongation = ∫ dt/k(t), without a table.

Thesis (3-7) under the cap (3-10), read as a tangent, with a floor tension f:

    dε/dt = max( l^b / (a·g(t)), l/(E·A) ),   g(t) = e^{ct} − e^{dt},   t ≥ f

and a straight line below f. 1/g has the pole 1/((c − d)·t) at t = 0, whose integral is a
logarithm; the smooth remainder is left to Gauss-Legendre quadrature. The tension at an elongation
is the root of that integral.

`cspm_model.elastic_law` has the law and its inverse for production. This is a second one on
purpose: the MuJoCo plant checks the other plant, so it must not share its table nor its mistakes.

A law is a row (a, b, c, d, E·A, f). The linear law is the one whose curve is infinitely stiff, so
that only the cap is left: a = ∞.
"""

from math import exp, expm1, inf, log, sqrt

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_msgs_py.testbed import ExponentialStiffness, LinearStiffness

Array = NDArray[np.float64]

LAW_COLUMNS = 6
A, B, C, D, RIGIDITY, FLOOR = range(LAW_COLUMNS)
HIGHEST_TENSION = 1e6  # a law that has not met its cap by then never does [N]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
# In units of 1/(c − d), whose multiples 2πi are the remainder's poles: with a panel of this length
# twelve nodes are exact to rounding.
_PANEL = 10.0
_ITERATIONS = 100


def law_row(law: ExponentialStiffness | LinearStiffness) -> list[float]:
    """Return the law's numbers in the order of the columns."""
    if isinstance(law, LinearStiffness):
        return [inf, 0.0, 0.0, -1.0, law.axial_rigidity, law.floor_tension]
    return [law.a, law.b, law.c, law.d, law.axial_rigidity, law.floor_tension]


@njit(cache=True)
def _curve(tension: float, law: Array) -> float:
    """Return g(t) = e^{ct} − e^{dt}."""
    return -exp(law[C] * tension) * expm1((law[D] - law[C]) * tension)


@njit(cache=True)
def _integral(tension: float, law: Array) -> float:
    """Return s(t) = (a/l^b)·ε [N] of the law without cap, for a tension at or above the floor."""
    floor, rate = law[FLOOR], law[C] - law[D]
    total = floor / _curve(floor, law) + log(tension / floor) / rate
    panels = 1 + int((tension - floor) * rate / _PANEL)
    half = 0.5 * (tension - floor) / panels
    for panel in range(panels):
        for j in range(_NODES.shape[0]):
            t = floor + half * (2 * panel + 1 + _NODES[j])
            total += half * _WEIGHTS[j] * (1.0 / _curve(t, law) - 1.0 / (rate * t))
    return total


@njit(cache=True)
def _cap_tension(elastic_length: float, law: Array) -> float:
    """Return the tension [N] from which the cap holds; at least the floor, inf for never."""
    cap = law[RIGIDITY] / law[A] * elastic_length ** (law[B] - 1.0)
    low = high = law[FLOOR]
    while _curve(high, law) < cap:
        low, high = high, 2.0 * high
        if high > HIGHEST_TENSION:
            return inf
    for _ in range(_ITERATIONS):
        value = _curve(high, law)
        slope = law[C] * exp(law[C] * high) - law[D] * exp(law[D] * high)
        better = high - (value - cap) / slope
        if low == high or abs(better - high) <= 1e-15 * high:
            break
        if value > cap:
            # g may be concave here, and its tangent then leads below the bracket.
            high = better if better > low else 0.5 * (low + high)
        else:
            low, high = high, better
    return high


@njit(cache=True)
def elongation_at(tension: float, elastic_length: float, law: Array) -> float:
    """Return the elongation [m] at which an elastic length [m] carries a tension [N]."""
    compliance = elastic_length / law[RIGIDITY]
    top = _cap_tension(elastic_length, law)
    floor = law[FLOOR]
    if top <= floor:
        return tension * compliance
    scale = law[A] / elastic_length ** law[B]
    if tension <= floor:
        return tension / (_curve(floor, law) * scale)
    below = _integral(min(tension, top), law) / scale
    return below + max(0.0, tension - top) * compliance


@njit(cache=True)
def tension_at(elongation: float, elastic_length: float, law: Array) -> float:
    """Return the tension [N] of an elastic length [m] at an elongation [m]; 0 if not stretched."""
    if elongation <= 0.0:
        return 0.0
    stiffness = law[RIGIDITY] / elastic_length
    top, floor = _cap_tension(elastic_length, law), law[FLOOR]
    if top <= floor:
        return stiffness * elongation
    scale = law[A] / elastic_length ** law[B]
    wanted, first = scale * elongation, _curve(floor, law)
    past = wanted - floor / first
    if past <= 0.0:
        return first * wanted
    if top < inf:
        meets = _integral(top, law)
        if wanted >= meets:
            return top + stiffness * (elongation - meets / scale)
    # Near the floor s grows like ln(t/f)/(c − d), which makes a good first guess.
    rise = min((law[C] - law[D]) * past, log(HIGHEST_TENSION / floor))
    return _root(wanted, floor * exp(rise), min(top, HIGHEST_TENSION), law)


@njit(cache=True)
def _root(wanted: float, guess: float, high: float, law: Array) -> float:
    """Return t between floor and `high` with s(t) = wanted, by Newton's method in ln t."""
    low, tension = law[FLOOR], min(guess, high)
    for _ in range(_ITERATIONS):
        excess = _integral(tension, law) - wanted
        if excess > 0.0:
            high = tension
        else:
            low = tension
        step = -excess * _curve(tension, law) / tension
        if abs(step) <= 1e-13:
            break
        better = log(tension) + step
        inside = log(low) < better < log(high)
        tension = exp(better) if inside else sqrt(low * high)
    return tension
