"""How a body that is small against the waves follows them.

It moves with the water at the surface, heeled with its slope. For the wave of `sea.py` with a = 1,
written as complex amplitudes of exp(iωt) at the body (k the wave number, χ the direction of travel,
χ' = χ - mean yaw), with z and heave down and the horizontal displacement of a water particle
lagging the elevation by 90° in the direction of travel:

    surge -i cos χ      roll   i k sin χ'
    sway  -i sin χ      pitch -i k cos χ'
    heave -1            yaw   -k sin χ' cos χ'

The signs of the angles: R = Rz Ry Rx with z down makes pitch > 0 bow up and roll > 0 starboard
down, so that pitch = ∂η/∂x' and roll = -∂η/∂y'. Yaw is the law of a slender body, whose axis turns
with the water: ψ = ∂(lateral displacement)/∂x'. The zero-speed response of a ship tends to these
laws as the frequency goes to zero.
"""

from __future__ import annotations

import numpy as np

from cspm_control.waves.sea import Array, Complex


def small_body_response(direction: Array, wave_number: Array, mean_yaw: float = 0.0) -> Complex:
    """Return the response to waves of unit amplitude, shape (n, 6) [m/m, rad/m].

    Args:
        direction: χ of each wave, shape (n,) [rad].
        wave_number: k of each wave, shape (n,) [rad/m].
        mean_yaw: ψ of the body at rest [rad].
    """
    relative = direction - mean_yaw
    cosine, sine = np.cos(relative), np.sin(relative)
    return np.stack(
        [
            -1j * np.cos(direction),
            -1j * np.sin(direction),
            np.full(len(direction), -1.0 + 0.0j),
            1j * wave_number * sine,
            -1j * wave_number * cosine,
            -wave_number * sine * cosine + 0.0j,
        ],
        axis=1,
    )
