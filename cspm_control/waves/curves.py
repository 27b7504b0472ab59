"""Curves and sums of sines on knots: every curve is a sum of a few sines."""

from __future__ import annotations

from math import ceil, pi

import numpy as np

from cspm_control.waves.realisation import checked_count, envelope, knot_count
from cspm_control.waves.sea import Array
from cspm_model.kinematics import rotation
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.scenario_keys.curves import (
    CircleMotion,
    CurveSpec,
    HelixMotion,
    LemniscateMotion,
    LineMotion,
    SinesMotion,
)

QUARTER = 0.5 * pi


def curve_sines(spec: CurveSpec) -> tuple[Array, Array, Array]:
    """Return amplitudes (n, 6), frequencies (n,) [Hz] and phases (n,) [rad] of a closed curve."""
    once, table = 1.0 / spec.period, []
    x, y, z = np.eye(6)[:3]
    match spec:
        case LineMotion():
            half = 0.5 * np.array(spec.to)
            # From the mean pose to the far end: a sine of frequency 0 is a constant.
            table = [(half, 0.0, QUARTER), (-half, once, QUARTER)]
        case CircleMotion():
            table = [(spec.radius * x, once, QUARTER), (spec.radius * y, once, 0.0)]
        case LemniscateMotion():
            across, up = spec.size
            table = [(across * x, once, 0.0), (up * y, 2.0 * once, 0.0)]
        case HelixMotion():
            table = [(spec.radius * x, once, QUARTER), (spec.radius * y, once, 0.0)]
            # Heave is down: the rise begins at the mean pose.
            half = -0.5 * spec.rise * z
            table += [(half, 0.0, QUARTER), (-half, 0.5 * once / spec.turns, QUARTER)]
    amplitudes = np.array([row[0] for row in table])
    turned = rotation([0.0, 0.0, 0.0, *spec.turn])
    amplitudes[:, :3] = amplitudes[:, :3] @ turned.T
    return amplitudes, np.array([row[1] for row in table]), np.array([row[2] for row in table])


def listed_sines(spec: SinesMotion) -> tuple[Array, Array, Array]:
    """Return amplitudes (n, 6), frequencies (n,) [Hz] and phases (n,) [rad] of listed sines."""
    rows = [(DOFS.index(dof), sine) for dof, sines in spec.sines.items() for sine in sines]
    amplitudes = np.zeros((len(rows), 6))
    for row, (axis, sine) in zip(amplitudes, rows, strict=True):
        row[axis] = sine.amplitude
    frequencies = np.array([sine.frequency for _, sine in rows])
    return amplitudes, frequencies, np.array([sine.phase for _, sine in rows])


def sine_knots(
    sines: tuple[Array, Array, Array], ramp: float, duration: float
) -> tuple[Array, float]:
    """Return the knots (n, 18) of a sum of sines that grows from rest, and their spacing [s].

    Args:
        sines: amplitudes (n, 6), frequencies (n,) [Hz], phases (n,) [rad].
        ramp: within which it grows [s]; 0: at once.
        duration: how long the motion must last [s].

    Raises:
        InputError: the duration requires more knots than can be stored.
    """
    amplitudes, frequencies, phases = sines
    excursion, highest = float(np.abs(amplitudes).sum(axis=0).max()), float(frequencies.max())
    # The ramp counts as a quarter of a wave.
    highest = max(highest, 0.25 / ramp if ramp else 0.0)
    count = checked_count(ceil(knot_count(duration, highest, excursion)) + 2)
    spacing = duration / (count - 2)
    time, omega = spacing * np.arange(count, dtype=np.float64), 2.0 * pi * frequencies
    angle = np.outer(time, omega) + phases
    value = np.sin(angle) @ amplitudes
    rate = np.cos(angle) @ (omega[:, None] * amplitudes)
    bend = -np.sin(angle) @ (omega[:, None] ** 2 * amplitudes)
    if not ramp:
        return np.hstack([value, rate, bend]), spacing
    e, e1, e2 = (each[:, None] for each in envelope(time, ramp))
    grown = (e * value, e * rate + e1 * value, e * bend + 2.0 * e1 * rate + e2 * value)
    return np.hstack(grown), spacing
