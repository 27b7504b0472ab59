"""A winch under position control, simulated step by step without the project's plant."""

from typing import NamedTuple

import numpy as np

from cspm_ident.signals.samples import Samples
from cspm_ident.winch import WinchSignals

STEP = 1e-3
EFFECTS = ("winch_viscous_friction", "winch_coulomb_friction", "winch_torque_offset")


class Winch(NamedTuple):
    """Inertia, friction and a constant resisting torque; at the motor shaft."""

    inertia: float = 2.4e-3
    viscous: float = 6.0e-3
    coulomb: float = 0.05
    constant: float = 0.015

    @property
    def values(self):
        """As the estimate lists them: the effect's torque helps, hence the sign."""
        return np.array([self.inertia, self.viscous, self.coulomb, -self.constant])


def reference(count, shift=0.0):
    """Three sines that start at rest [rad], and their rate."""
    time = np.arange(count) * STEP
    ramp = np.minimum(time / 0.5, 1.0) ** 2 * (3.0 - 2.0 * np.minimum(time / 0.5, 1.0))
    waves = [(3.0, 0.7), (1.2, 1.9), (0.35, 4.3)]
    angle = ramp * sum(a * np.sin(2 * np.pi * f * time + shift * f) for a, f in waves)
    return angle, np.gradient(angle, STEP)


def closed_loop(winch, count, noise=0.0, torque_noise=0.0, seed=0, load=None, shift=0.0):
    """PD control from a noisy encoder, in steps of a fifth of the period.

    The controller differentiates what it reads with a pole at 300 rad/s, as drives do.
    `torque_noise` is added to the torque's reading only. Returns readings; `load` is a tension over
    time [N], with a radius of 0.01 m.
    """
    rng = np.random.default_rng(seed)
    wanted, wanted_rate = reference(count, shift)
    read_noise = noise * rng.standard_normal(count)
    angle = speed = filtered = 0.0
    before = read_noise[0]
    angles, torques = np.empty(count), np.empty(count)
    for k in range(count):
        reading = angle + read_noise[k]
        filtered += 0.26 * ((reading - before) / STEP - filtered)
        before = reading
        torque = 6.0 * (wanted[k] - reading) + 0.20 * (wanted_rate[k] - filtered)
        angles[k], torques[k] = reading, torque
        pull = 0.01 * load[k] if load is not None else 0.0
        for _ in range(5):
            free = torque - pull - winch.constant - winch.viscous * speed
            # Sticks where the friction's limit suffices to stop the shaft within the step.
            hold = free + winch.inertia * speed / (STEP / 5)
            dry = max(-winch.coulomb, min(winch.coulomb, hold))
            change = (free - dry) / winch.inertia * STEP / 5
            angle += (speed + 0.5 * change) * STEP / 5
            speed += change
    return readings(angles, torques + torque_noise * rng.standard_normal(count), load)


def readings(angle, torque, load=None):
    """As signals; the torque at a stamp acts for one period from then on."""
    times = np.arange(len(angle)) * STEP
    tension = Samples(times, load[:, None]) if load is not None else None
    return WinchSignals(
        Samples(times, angle[:, None]),
        Samples(times, torque[:, None]),
        tension,
        radius=0.01,
        torque_age=-0.5 * STEP,
    )
