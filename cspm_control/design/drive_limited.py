"""Force loops of cables so stiff that no drive gives the bandwidth that is wanted.

A steel cable's resonance is little damped, and the time that sampling takes leaves no phase above
it. What is left is to stay below: the gain at the resonance is kept under what 6 dB of margin
leave, and the torque that balances the wanted tension goes ahead (Åström, Hägglund, Advanced PID
Control, 2006, section 3.4), so that the loop only corrects it. Motion loops then see the winches'
inertia, and are designed on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_control.design.margins import ComplexArray, Margins, grid_margins
from cspm_model.kernels.cable import RADIUS
from cspm_model.kernels.machine import BAR_STATES, PlantParameters
from cspm_model.linearisation import (
    ALL_AXES,
    OperatingPoint,
    StateSpace,
    motion_subsystem,
    wrench_tensions,
)
from cspm_msgs_py.control_spec.force import PiGains
from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]

# Gains are looked for as tension fed back per tension, above the resonance; below it as shares of
# what gives the bandwidth.
GAINS, LOWERED = np.geomspace(1000.0, 0.1, 121), np.geomspace(1.0, 1e-3, 10)
# Integral frequencies above the resonance, as shares of the largest bandwidth.
INTEGRAL_SHARES = (1.0 / 20.0, 1.0 / 40.0, 1.0 / 80.0)
# Below the resonance a loop only integrates: with the phase that its samples lose less than 1°, it
# has no proportional term to speak of.
INTEGRAL_FREQUENCY = 1000.0  # rad/s


class DriveLimit(NamedTuple):
    """What a drive-limited force loop must keep.

    Attributes:
        phase_margin: [rad].
        gain_margin: [dB].
        largest_bandwidth: of the closed loop [rad/s].
        slow_bandwidth: the largest of a loop below the resonance [rad/s].
    """

    phase_margin: float
    gain_margin: float
    largest_bandwidth: float
    slow_bandwidth: float


def drive_limited_gains(
    name: str, frequencies: Array, response: ComplexArray, radius: float, limit: DriveLimit
) -> PiGains:
    """Return the PI of a stiff cable within a limit.

    Of largest bandwidth above the resonance if the drive allows any, else below it, with the torque
    of the wanted tension ahead.

    Args:
        name: of the cable, for errors.
        frequencies: rising (m,) [rad/s].
        response: from motor torque to tension there, with all that delays it, (m,) [N/(N·m)].
        radius: cable wound per radian of the motor [m].
        limit: what to keep.

    Raises:
        InputError: no PI keeps it.
    """
    tensions = radius * response
    resonance = float(frequencies[int(np.abs(tensions).argmax())])
    for share in INTEGRAL_SHARES:
        integral = share * limit.largest_bandwidth
        shape = (1.0 + integral / (1j * frequencies)) * tensions
        for gain in GAINS:
            kept = grid_margins(frequencies, gain * shape)
            slowest = min(kept.crossover, kept.bandwidth)
            wide = resonance < slowest and kept.bandwidth <= limit.largest_bandwidth
            if wide and _is_kept(kept, limit):
                return PiGains(kp=radius * float(gain), integral_frequency=integral)
    shape = (1.0 + INTEGRAL_FREQUENCY / (1j * frequencies)) * tensions
    largest = limit.slow_bandwidth / (INTEGRAL_FREQUENCY * float(np.abs(tensions[0])))
    for gain in largest * LOWERED:
        if _is_kept(grid_margins(frequencies, gain * shape), limit):
            kp = radius * float(gain)
            return PiGains(kp=kp, integral_frequency=INTEGRAL_FREQUENCY, feedforward=1.0)
    raise InputError(
        f"control.force: no PI of {name} keeps {np.degrees(limit.phase_margin):.0f}° and"
        f" {limit.gain_margin:g} dB of margins, allowed: control.force.gains"
    )


def _is_kept(found: Margins, limit: DriveLimit) -> bool:
    return (
        found.phase_margin >= limit.phase_margin
        and found.gain_margin >= limit.gain_margin
        and not np.isfinite(found.low_frequency_gain)
    )


def motion_plant_of_slow_loops(
    model: StateSpace,
    parameters: PlantParameters,
    point: OperatingPoint,
    gains: Sequence[PiGains],
    axes: Sequence[int] = ALL_AXES,
) -> StateSpace:
    """Return the model from a wanted wrench to the pose, with the force loops closed.

    As `motion_subsystem`, whose loops are as good as their wanted tensions; states of the loops'
    integrals (n,) [N·s] follow.

    Args:
        model: of `linear_model`.
        parameters: the machine's kernel parameters.
        point: the model's operating point.
        gains: per cable.
        axes: world axes of the wrench in which it is to be met, its inputs.
    """
    rigid = motion_subsystem(model, parameters, point, axes)
    n, states = len(gains), len(model.A)
    proportional = np.diag([each.kp for each in gains])
    integral = np.diag([each.kp * each.integral_frequency for each in gains])
    ahead = np.diag([each.feedforward for each in gains] * parameters.cables[:, RADIUS])
    shown = model.C[BAR_STATES:]
    wanted = wrench_tensions(point, axes)
    return StateSpace(
        A=np.block(
            [
                [model.A - model.B @ proportional @ shown, model.B @ integral],
                [-shown, np.zeros((n, n))],
            ]
        ),
        B=np.vstack([model.B @ (proportional + ahead) @ wanted, wanted]),
        C=np.hstack([rigid.C, np.zeros((6, n))]),
        D=rigid.D,
        states=(*model.states, *(f"integral {i}" for i in range(states, states + n))),
        inputs=rigid.inputs,
        outputs=rigid.outputs,
    )
