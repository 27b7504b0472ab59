"""Winch block: torque and tension in, angular acceleration out; all at the motor shaft."""

from numba import njit
from numpy import float64
from numpy.typing import NDArray

from cspm_model.kernels.cable import GEAR_RATIO, INERTIA, RADIUS, TORQUE_LIMIT

Array = NDArray[float64]

# What effects on a winch read and change.
ANGLE = 0
SPEED = 1
WINCH_TENSION = 2
WINDING_RADIUS = 3
RESISTANCE = 4  # torque against positive motion [N·m]; an effect adds to it
DRY_LIMIT = 5  # largest dry friction torque [N·m]; an effect adds to it
REPORTED_TORQUE = 6  # what the drive says; effects of the drive change it
COMMANDED_TORQUE = 7  # within the torque limit
MOTOR_GEAR = 8
WINCH_SIGNALS = 9


@njit(cache=True, error_model="numpy", inline="always")
def clip(value: float, limit: float) -> float:
    """Return the value nearest to `value` within ±limit."""
    # Comparisons, since min() and max() of floats are several times slower when compiled.
    if value > limit:
        return limit
    return -limit if value < -limit else value


@njit(cache=True, error_model="numpy", inline="always")
def winch_acceleration(
    torque: float,
    tension: float,
    speed: float,
    period: float,
    cables: Array,
    i: int,
    signals: Array,
) -> float:
    """Return q̈ [rad/s²] of J q̈ = τ − (r/n)·t − resistance − dry friction, thesis (2-21).

    Dry friction is set-valued at standstill. It takes whatever value within its limit makes the
    speed decay over one step of `period` [s]: exact while sliding, and a winch that sticks does not
    creep.
    """
    limited = clip(torque, cables[i, TORQUE_LIMIT])
    net = limited - cables[i, RADIUS] * tension - signals[RESISTANCE]
    dry = signals[DRY_LIMIT]
    if dry > 0.0:
        net -= clip(net + cables[i, INERTIA] * speed / period, dry)
    return net / cables[i, INERTIA]


@njit(cache=True, error_model="numpy", inline="always")
def fill_winch_signals(
    angle: float,
    speed: float,
    tension: float,
    torque: float,
    cables: Array,
    i: int,
    signals: Array,
) -> None:
    """Write what effects on winch i read, and zero to what they add to."""
    signals[ANGLE] = angle
    signals[SPEED] = speed
    signals[WINCH_TENSION] = tension
    signals[WINDING_RADIUS] = cables[i, RADIUS]
    signals[MOTOR_GEAR] = cables[i, GEAR_RATIO]
    signals[RESISTANCE] = 0.0
    signals[DRY_LIMIT] = 0.0
    signals[COMMANDED_TORQUE] = signals[REPORTED_TORQUE] = clip(torque, cables[i, TORQUE_LIMIT])
