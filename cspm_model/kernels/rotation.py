"""Rotations: R = Rz(ψ)Ry(θ)Rx(φ) maps body to world (thesis 2-3); quaternions are x y z w."""

from math import asin, atan2, cos, sin, sqrt

from numba import njit
from numpy import float64
from numpy.typing import NDArray

Array = NDArray[float64]
Vector = tuple[float, float, float]
Matrix = tuple[float, float, float, float, float, float, float, float, float]
# Position, rotation, velocity and angular velocity of a body, in world axes.
Placement = tuple[Vector, Matrix, Vector, Vector]


@njit(cache=True, error_model="numpy", forceinline=True)
def rotation_from_euler(roll: float, pitch: float, yaw: float) -> Matrix:
    """Return R_world_body, row by row."""
    cr, sr = cos(roll), sin(roll)
    cp, sp = cos(pitch), sin(pitch)
    cy, sy = cos(yaw), sin(yaw)
    return (
        cy * cp,
        cy * sp * sr - sy * cr,
        cy * sp * cr + sy * sr,
        sy * cp,
        sy * sp * sr + cy * cr,
        sy * sp * cr - cy * sr,
        -sp,
        cp * sr,
        cp * cr,
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def rotate(rotation: Matrix, x: float, y: float, z: float) -> Vector:
    """Return R·[x, y, z]."""
    return (
        rotation[0] * x + rotation[1] * y + rotation[2] * z,
        rotation[3] * x + rotation[4] * y + rotation[5] * z,
        rotation[6] * x + rotation[7] * y + rotation[8] * z,
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def rotate_back(rotation: Matrix, x: float, y: float, z: float) -> Vector:
    """Return Rᵀ·[x, y, z]."""
    return (
        rotation[0] * x + rotation[3] * y + rotation[6] * z,
        rotation[1] * x + rotation[4] * y + rotation[7] * z,
        rotation[2] * x + rotation[5] * y + rotation[8] * z,
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def cross(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> Vector:
    """Return a × b."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@njit(cache=True, error_model="numpy", forceinline=True)
def body_rate_to_euler_rate(roll: float, pitch: float, wx: float, wy: float, wz: float) -> Vector:
    """Return φ̇, θ̇, ψ̇ for the angular velocity ω in body axes; singular at θ = ±π/2."""
    cr, sr = cos(roll), sin(roll)
    yaw_rate = (sr * wy + cr * wz) / cos(pitch)
    return wx + sin(pitch) * yaw_rate, cr * wy - sr * wz, yaw_rate


@njit(cache=True, error_model="numpy", forceinline=True)
def euler_rate_to_world_rate(
    pitch: float, yaw: float, roll_rate: float, pitch_rate: float, yaw_rate: float
) -> Vector:
    """Return ω in world axes for the Euler rates: J_w of (2-6) times the rates."""
    cp, sp = cos(pitch), sin(pitch)
    cy, sy = cos(yaw), sin(yaw)
    return (
        cy * cp * roll_rate - sy * pitch_rate,
        sy * cp * roll_rate + cy * pitch_rate,
        yaw_rate - sp * roll_rate,
    )


@njit(cache=True, error_model="numpy")
def quaternion_from_euler(roll: float, pitch: float, yaw: float, out: Array) -> None:
    """Write the unit quaternion x y z w of R = Rz(ψ)Ry(θ)Rx(φ) to `out` (4 numbers)."""
    cr, sr = cos(0.5 * roll), sin(0.5 * roll)
    cp, sp = cos(0.5 * pitch), sin(0.5 * pitch)
    cy, sy = cos(0.5 * yaw), sin(0.5 * yaw)
    out[0] = sr * cp * cy - cr * sp * sy
    out[1] = cr * sp * cy + sr * cp * sy
    out[2] = cr * cp * sy - sr * sp * cy
    out[3] = cr * cp * cy + sr * sp * sy


@njit(cache=True, error_model="numpy")
def euler_from_quaternion(quaternion: Array) -> Vector:
    """Return φ, θ, ψ of the quaternion x y z w (any length > 0); |θ| ≤ π/2."""
    x, y, z, w = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    norm = sqrt(x * x + y * y + z * z + w * w)
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    roll = atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = asin(min(1.0, max(-1.0, 2.0 * (w * y - z * x))))
    yaw = atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return roll, pitch, yaw
