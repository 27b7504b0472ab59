"""Winch block: torque and tension in, angular acceleration out; all at the motor shaft."""

from numba import njit
from numpy import float64
from numpy.typing import NDArray

Array = NDArray[float64]

# Columns of a winch's parameter row.
RADIUS = 0  # drum radius / gear ratio: cable wound per radian of the motor [m]
INERTIA = 1  # all that turns, at the motor shaft [kg·m²]
TORQUE_LIMIT = 2
WINCH_COLUMNS = 3

# What effects on a winch read and change.
ANGLE = 0
SPEED = 1
TENSION = 2
WINDING_RADIUS = 3
RESISTANCE = 4  # torque against positive motion [N·m]; an effect adds to it
DRY_LIMIT = 5  # largest dry friction torque [N·m]; an effect adds to it
WINCH_SIGNALS = 6


@njit(cache=True, error_model="numpy")
def winch_acceleration(
    torque: float, tension: float, speed: float, period: float, winches: Array, i: int,
    signals: Array,
) -> float:
    """Return q̈ [rad/s²] of J q̈ = τ − (r/n)·t − resistance − dry friction, thesis (2-21).

    Dry friction is set-valued at standstill. It takes whatever value within its limit would stop
    the shaft in one step of `period` [s]: exact while sliding, and a winch that sticks stays put.
    """
    limit = winches[i, TORQUE_LIMIT]
    net = min(limit, max(-limit, torque)) - winches[i, RADIUS] * tension - signals[RESISTANCE]
    dry = signals[DRY_LIMIT]
    if dry > 0.0:
        stopping = net + winches[i, INERTIA] * speed / period
        net -= min(dry, max(-dry, stopping))
    return net / winches[i, INERTIA]
