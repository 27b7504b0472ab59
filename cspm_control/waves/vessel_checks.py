"""Whether a vessel's tables are what physics allows: long waves, mirror symmetry, radians.

In waves that are long against it every vessel moves with the water (`small_body.py`): heave tends
to -1 and pitch to the slope of the wave. A vessel that is built alike to both sides answers to a
wave from the other side by the mirrored motion.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cspm_control.waves.sea import Array, Complex, wave_number
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import InputError

GRAVITY = 9.81
# Phases may run on over many turns, so that their size says nothing of their unit.
LIKE_WATER = 0.5
"""How far heave may be from that of the water; a phase that is 30° off makes as much."""
MIRRORED = 0.5
"""Of the largest response: a wrong sign makes 2, and a load to one side of a ship far less."""
_DEGREE = np.pi / 180.0
_SIGNS = (1.0, -1.0, 1.0, -1.0, 1.0, -1.0)  # surge, heave and pitch are the same for both sides


def check_physics(
    path: Path, frequency: Array, heading: Array, amplitude: Array, phase: Array
) -> None:
    """Refuse tables in other units, or of another form than a vessel's.

    Args:
        path: the file, for errors.
        frequency: shape (n,) [rad/s].
        heading: shape (m,) [rad].
        amplitude: shape (n, m, 6) [m/m, rad/m].
        phase: shape (n, m, 6) [rad].

    Raises:
        InputError: naming what is not as it must be, and what was probably meant.
    """
    where = f"{path}: vessel.motionRAO"
    _check_phases(where, frequency, amplitude, phase)
    _check_rotations(where, frequency, heading, amplitude)
    _check_mirrored(where, heading, amplitude * np.exp(1j * phase))


def _check_phases(where: str, frequency: Array, amplitude: Array, phase: Array) -> None:
    lowest = f"in the longest wave, {frequency[0]:.3g} rad/s, heave"
    in_degrees = amplitude[0, :, 2] * np.exp(1j * phase[0, :, 2] * _DEGREE)
    heave = amplitude[0, :, 2] * np.exp(1j * phase[0, :, 2])
    if _off(heave, -1.0) > LIKE_WATER and _off(in_degrees, -1.0) <= LIKE_WATER:
        raise InputError(
            f"{where}.phase: {lowest} is that of the water only if the phases are degrees, allowed:"
            " rad"
        )
    if _off(heave, 1.0) <= LIKE_WATER:
        raise InputError(
            f"{where}.phase: {lowest} is against the water, allowed: z down and the phase of the"
            " wave at the vessel's origin, so that heave tends to -1"
        )


def _off(heave: Complex, wanted: float) -> float:
    return float(np.abs(heave - wanted).max())


def _check_rotations(where: str, frequency: Array, heading: Array, amplitude: Array) -> None:
    """Refuse pitch in degrees per metre, which in the longest wave is 57 times its slope."""
    number = float(wave_number(frequency[:1], GRAVITY)[0])
    slope = number * float(np.abs(np.cos(heading)).max())
    if slope == 0.0:
        return
    ratio = float(amplitude[0, :, 4].max()) / slope
    if 0.5 / _DEGREE < ratio < 2.0 / _DEGREE:
        raise InputError(
            f"{where}.amp: in the longest wave, {frequency[0]:.3g} rad/s, pitch is {ratio:.3g}"
            " times the slope of the wave, allowed: rad/m; degrees have to be converted"
        )


def _check_mirrored(where: str, heading: Array, operator: Complex) -> None:
    partner, known = _mirrored(heading)
    for dof, sign in enumerate(_SIGNS):
        table = operator[:, known, dof]
        largest = float(np.abs(table).max(initial=0.0))
        apart = np.abs(operator[:, partner[known], dof] - sign * table)
        if largest > 0.0 and apart.max() > MIRRORED * largest:
            at = float(heading[known][int(apart.max(axis=0).argmax())])
            how = "the same" if sign > 0 else "opposite"
            raise InputError(
                f"{where}: {DOFS[dof]} at headings {at:.3g} and {2 * np.pi - at:.3g} rad is not"
                f" {how}, as a vessel's is that is built alike to both sides, allowed: tables of"
                " such a vessel, in rad"
            )


def _mirrored(heading: Array) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Return for each heading that from the other side, and whether there is one."""
    turn = 2.0 * np.pi
    apart = np.abs(np.mod(heading[:, None] + heading[None, :] + np.pi, turn) - np.pi)
    partner = apart.argmin(axis=1)
    return partner, apart.min(axis=1) < 1e-3
