"""The PID of largest crossover within a loop's requirements: section 7-1's procedure to its end.

"The bandwidth is maximised" until all of it is used up: the integral's zero lies where 20 dB are
left at the low-frequency crossing of −180°, the derivative's as high as 60° of phase margin let it,
and the gain is the largest that leaves 6 dB of gain margin and a closed loop a tenth as fast as the
force loops. The result is also the PID of the largest integral gain within these margins, Åström
and Hägglund's criterion (Advanced PID Control, 2006, section 7.4).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_control.design.margins import ComplexArray, Margins, grid_margins
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import PidGains

Array = NDArray[np.float64]

# The derivative's zero is looked for between the crossover and a tenth of it, where it has given
# 84 of its 90 degrees; the crossover down to a hundredth of the largest that is allowed.
DERIVATIVE_RATIOS = np.geomspace(1.0, 10.0, 48)
CROSSOVER_RATIOS = np.geomspace(1.0, 0.01, 60)
# To what the crossover is found.
ACCURACY = 1e-4
# What interpolation on the grid may miss: of a gain [dB], of a phase [rad] or of the bandwidth.
GAIN_GUARD, GUARD = 0.02, 2e-3


class LoopRequirement(NamedTuple):
    """What a motion loop must keep.

    Attributes:
        phase_margin: [rad].
        gain_margin: [dB].
        low_frequency_gain: [dB].
        largest_bandwidth: of the closed loop [rad/s].
    """

    phase_margin: float
    gain_margin: float
    low_frequency_gain: float
    largest_bandwidth: float


class PidShape(NamedTuple):
    """A PID by its loop's crossover [rad/s] and how many times below it its two zeros lie."""

    crossover: float
    derivative_ratio: float
    integral_ratio: float

    def response(self, frequencies: Array) -> ComplexArray:
        """Return (1 + ω_i/s)(1 + s/ω_d) at angular frequencies (m,) [rad/s]."""
        s = 1j * frequencies / self.crossover
        shape = (1.0 + 1.0 / (self.integral_ratio * s)) * (1.0 + self.derivative_ratio * s)
        return np.asarray(shape)

    def gains(self, gain: float) -> PidGains:
        """Return the PID that is `gain` times this shape."""
        integral = self.crossover / self.integral_ratio
        derivative = self.crossover / self.derivative_ratio
        return PidGains(
            kp=gain * (1.0 + integral / derivative), ki=gain * integral, kd=gain / derivative
        )


class Axis:
    """One input and output of the motion plant on a grid of frequencies."""

    def __init__(self, frequencies: Array, response: ComplexArray) -> None:
        """Take the plant's response (m,) at rising angular frequencies (m,) [rad/s]."""
        self.frequencies = frequencies
        self.response = response
        self._logarithm = np.log(frequencies)
        self._log_magnitude = np.log(np.abs(response))
        phase = np.unwrap(np.angle(response))
        # At low frequency the bar is a double integrator, whose phase is −180° and not +180°.
        self._phase = phase - 2.0 * np.pi * np.round((phase[0] + np.pi) / (2.0 * np.pi))

    def at(self, frequencies: Array) -> tuple[Array, Array]:
        """Return the plant's log magnitude and phase [rad] between the grid's frequencies."""
        logarithm = np.log(frequencies)
        magnitude = np.interp(logarithm, self._logarithm, self._log_magnitude)
        return magnitude, np.interp(logarithm, self._logarithm, self._phase)

    def gain(self, shape: PidShape) -> float:
        """Return the factor that gives the loop |L| = 1 at the crossover."""
        crossover = np.array([shape.crossover])
        magnitude, _ = self.at(crossover)
        return float(np.exp(-magnitude[0]) / np.abs(shape.response(crossover)[0]))

    def margins(self, shape: PidShape) -> Margins:
        """Return the loop's margins, by interpolation on the grid."""
        loop = self.gain(shape) * shape.response(self.frequencies) * self.response
        return grid_margins(self.frequencies, loop)


def widest_loop(dof: str, axis: Axis, requirement: LoopRequirement) -> PidGains:
    """Return the PID of the largest crossover that keeps the requirement.

    Args:
        dof: for errors.
        axis: the plant.
        requirement: what the loop must keep.

    Raises:
        InputError: no PID keeps it.
    """
    highest = min(requirement.largest_bandwidth, axis.frequencies[-2])
    outside, best = highest, None
    for crossover in highest * CROSSOVER_RATIOS:
        best = _shape(axis, requirement, crossover)
        if best is not None:
            break
        outside = crossover
    if best is None:
        raise InputError(
            f"control.motion: no PID of {dof} has {np.degrees(requirement.phase_margin):.0f}° and"
            f" {requirement.gain_margin:g} dB of margins and a bandwidth of at most"
            f" {requirement.largest_bandwidth:.4g} rad/s, allowed: control.motion.gains"
        )
    while outside > (1.0 + ACCURACY) * best.crossover:
        middle = float(np.sqrt(outside * best.crossover))
        found = _shape(axis, requirement, middle)
        outside, best = (middle, best) if found is None else (outside, found)
    return best.gains(axis.gain(best))


def _shape(axis: Axis, requirement: LoopRequirement, crossover: float) -> PidShape | None:
    """Return the shape of a crossover with the least derivative action, None if none is kept."""
    _, phase = axis.at(np.array([crossover]))
    # The integral only takes phase, so that ratios too small without it need not be tried. The
    # last of them is kept to interpolate from.
    lead = np.arctan(DERIVATIVE_RATIOS)
    enough = np.flatnonzero(np.pi + phase[0] + lead - requirement.phase_margin >= GUARD)
    if not len(enough):
        return None
    derivative = DERIVATIVE_RATIOS[max(int(enough[0]) - 1, 0) :]
    low_gain = requirement.low_frequency_gain + GAIN_GUARD
    integral = _integral_ratios(axis, low_gain, crossover, derivative)
    lead = np.arctan(derivative) - np.arctan(1.0 / integral)
    room = np.pi + phase[0] + lead - requirement.phase_margin - GUARD
    enough = np.flatnonzero((room >= 0.0) & (integral > derivative))
    if not len(enough):
        return None
    i = int(enough[0])
    share = room[i] / (room[i] - room[i - 1]) if i and np.isfinite(room[i - 1]) else 0.0
    shape = PidShape(
        crossover,
        float(derivative[i] * (derivative[i - 1] / derivative[i]) ** share),
        float(integral[i] * (integral[i - 1] / integral[i]) ** share),
    )
    return shape if _is_kept(axis.margins(shape), requirement) else None


def _is_kept(found: Margins, requirement: LoopRequirement) -> bool:
    return (
        found.phase_margin >= requirement.phase_margin
        and found.gain_margin >= requirement.gain_margin + GAIN_GUARD
        and found.bandwidth <= (1.0 - GUARD) * requirement.largest_bandwidth
    )


def _integral_ratios(
    axis: Axis, low_frequency_gain: float, crossover: float, derivative: Array
) -> Array:
    """Return the least integral ratio per derivative ratio (n,), NaN where there is none.

    At a frequency x·ω_c below the crossover, plant and derivative leave ψ above −180°. The integral
    takes just that where its ratio is 1/(x·tan ψ): there the loop crosses −180°, with a gain that
    falls as x rises. The ratio is that of the gain required.
    """
    x = axis.frequencies[axis.frequencies < crossover] / crossover
    magnitude, phase = axis.at(x * crossover)
    at_crossover, _ = axis.at(np.array([crossover]))
    d = derivative[:, None]
    angle = np.pi + phase + np.arctan(d * x)
    usable = (angle > 0.0) & (angle < 0.5 * np.pi)
    tangent = np.where(usable, np.tan(angle), np.nan)
    ratio = 1.0 / (x * tangent)
    shape = np.hypot(1.0, d * x) / np.hypot(1.0, d)
    integral = np.hypot(1.0, tangent) / np.hypot(1.0, 1.0 / ratio)
    gain = (20.0 / np.log(10.0)) * (magnitude - at_crossover + np.log(shape * integral))
    return np.array(
        [_last_ratio(*row, low_frequency_gain) for row in zip(gain, ratio, strict=True)]
    )


def _last_ratio(gain: Array, ratio: Array, required: float) -> float:
    enough = np.flatnonzero(gain >= required)
    if not len(enough):
        return np.nan
    i = int(enough[-1])
    if i + 1 == len(gain) or not np.isfinite(gain[i + 1]):
        return float(ratio[i])
    share = (gain[i] - required) / (gain[i] - gain[i + 1])
    return float(ratio[i] * (ratio[i + 1] / ratio[i]) ** share)
