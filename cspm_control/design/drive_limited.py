"""Force loops of cables so stiff that no drive gives the bandwidth that is wanted.

A steel cable's resonance is little damped, and the time that sampling takes leaves little phase
above it. Where a loop above keeps no margins it stays below: it only integrates, slower than any
motion loop, and the torque that balances the wanted tension goes ahead (Åström, Hägglund, Advanced
PID Control, 2006, section 3.4). Motion loops then see the winches' inertia, and are designed on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_control.design.margins import ComplexArray, grid_margins
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

Array = NDArray[np.float64]

# Gains above the resonance are looked for as tension fed back per tension, integral frequencies as
# shares of the largest bandwidth.
GAINS, INTEGRAL_SHARES = np.geomspace(1000.0, 0.1, 121), (1.0 / 20.0, 1.0 / 40.0, 1.0 / 80.0)
# Below it a loop only integrates: beside this frequency a proportional term is nothing.
INTEGRAL_FREQUENCY = 1000.0  # rad/s


class DriveLimit(NamedTuple):
    """What a drive-limited force loop must keep.

    Attributes:
        phase_margin: [rad].
        gain_margin: [dB].
        largest_bandwidth: of the closed loop [rad/s].
        slow_bandwidth: the largest of a loop below the resonance [rad/s].
        ratio: how many times slower than the motion loop it is at least.
    """

    phase_margin: float
    gain_margin: float
    largest_bandwidth: float
    slow_bandwidth: float
    ratio: float


def fast_gains(
    frequencies: Array, response: ComplexArray, radius: float, resonance: float, limit: DriveLimit
) -> PiGains | None:
    """Return the PI of largest bandwidth above the resonances that keeps a limit, None without any.

    Args:
        frequencies: rising (m,) [rad/s].
        response: from motor torque to tension there, with all that delays it, (m,) [N/(N·m)].
        radius: cable wound per radian of the motor [m].
        resonance: the fastest of the machine [rad/s].
        limit: what to keep.
    """
    for share in INTEGRAL_SHARES:
        integral = share * limit.largest_bandwidth
        shape = radius * (1.0 + integral / (1j * frequencies)) * response
        for gain in GAINS:
            kept = grid_margins(frequencies, gain * shape)
            if (
                resonance < min(kept.crossover, kept.bandwidth)
                and kept.bandwidth <= limit.largest_bandwidth
                and kept.phase_margin >= limit.phase_margin
                and kept.gain_margin >= limit.gain_margin
                and not np.isfinite(kept.low_frequency_gain)
            ):
                return PiGains(kp=radius * float(gain), integral_frequency=integral)
    return None


def slow_gains(frequencies: Array, response: ComplexArray, limit: DriveLimit) -> PiGains:
    """Return the PI below the resonance, with the torque of the wanted tension ahead.

    Its gain margin leaves a motion loop a crossover at which the resonance reaches half of |L| = 1;
    the force loop is slower than that by the limit's ratio. Arguments as `fast_gains`.
    """
    magnitude = np.abs(response)
    highest = int(magnitude.argmax())
    reach = 0.5 * frequencies[highest] * magnitude[0] / magnitude[highest]
    bandwidth = min(limit.slow_bandwidth, float(reach) / limit.ratio)
    kp = bandwidth / (INTEGRAL_FREQUENCY * float(magnitude[0]))
    return PiGains(kp=kp, integral_frequency=INTEGRAL_FREQUENCY, feedforward=1.0)


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
