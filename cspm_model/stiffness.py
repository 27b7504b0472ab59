"""The cable's stiffness law as a table for the kernels.

Thesis (3-7) is identified as a tangent, Δt/Δl (3-4), and is read so here:

    dt/dε = min( (a/l^b)·g(t), E·A/l ),   g(t) = e^{c·t'} − e^{d·t'},   t' = max(t, floor)

with elongation ε, elastic length l and tension t. With s = (a/l^b)·ε the uncapped law is the same
curve t(s) for every length, dt/ds = g(t), so one table serves all lengths. Below the floor tension
the curve is the straight line t = g(floor)·s through the origin.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from cspm_msgs_py.testbed import ExponentialStiffness

Array = NDArray[np.float64]

POINTS = 2048
# The table ends where the slope passes the material cap at any elastic length in this range [m];
# beyond it the law goes on as a straight line.
ELASTIC_LENGTHS = (0.02, 100.0)
LONGEST_TENSION_FACTOR = 5.0


def law_slope(law: ExponentialStiffness, tension: Array | float) -> Array:
    """Return g(t) = dt/ds of the law without cap, for tension [N] of any shape."""
    t = np.maximum(np.asarray(tension, dtype=float), law.floor_tension)
    return np.asarray(np.exp(law.c * t) - np.exp(law.d * t))


# A machine has few kinds of cable, and is built more than once in the course of a run.
@lru_cache(maxsize=64)
def law_table(law: ExponentialStiffness, tension_limit: float) -> tuple[Array, float]:
    """Return t and dt/ds, (POINTS, 2), at equal steps of s beyond the floor, and the step [N].

    Args:
        law: the law's parameters.
        tension_limit: the cable's t_max [N]; bounds the table where the cap is out of reach.
    """
    end_tension = _end_tension(law, tension_limit)
    scaled_end = _scaled_elongation(law, end_tension)
    s = np.linspace(0.0, scaled_end, POINTS)
    solution = scipy.integrate.solve_ivp(
        lambda _, t: law_slope(law, t),
        (0.0, scaled_end),
        [law.floor_tension],
        method="DOP853",
        t_eval=s,
        rtol=1e-12,
        atol=1e-12,
    )
    tension = solution.y[0]
    table = np.stack([tension, law_slope(law, tension)], axis=1)
    table.setflags(write=False)
    return table, float(s[1])


def _end_tension(law: ExponentialStiffness, tension_limit: float) -> float:
    longest = LONGEST_TENSION_FACTOR * tension_limit
    lengths = np.array(ELASTIC_LENGTHS)
    cap = law.axial_rigidity / law.a * np.max(lengths ** (law.b - 1.0))
    tensions = np.linspace(law.floor_tension, longest, 4096)
    capped = law_slope(law, tensions) > 1.05 * cap
    return float(tensions[np.argmax(capped)]) if capped.any() else longest


def _scaled_elongation(law: ExponentialStiffness, tension: float) -> float:
    """Return s − s_floor = ∫ dt/g from the floor to `tension` [N]."""
    t = np.geomspace(law.floor_tension, max(tension, 1.01 * law.floor_tension), 20001)
    y = t / law_slope(law, t)  # ∫ dt/g = ∫ (t/g) d(ln t)
    return float(np.trapezoid(y, np.log(t)))
