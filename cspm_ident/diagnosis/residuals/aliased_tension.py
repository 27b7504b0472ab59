"""Tensions that alternate from one reading to the next: what moves them is too fast to be read."""

from __future__ import annotations

import numpy as np

from cspm_ident.diagnosis.residuals.regressors import Place
from cspm_ident.diagnosis.residuals.spectral_lines import Line
from cspm_ident.signals.measurement import Measurement
from cspm_sim.effects import Channel

# Of one step to the next: even of readings whose noise rises with the square of the frequency, as
# that of something differentiated, no more than two thirds are taken back.
_ALTERNATING = -2.0 / 3.0
# Of the mean tension: what swings by less does not go slack, and averages out.
_LEAST = 0.5


def chatters_of(measurement: Measurement) -> tuple[Line, ...]:
    """Return the tensions of a recording that alternate, as lines at half of the rate of readings.

    A force loop that is unstable swings as fast as its controller acts, and readings taken at the
    same rate tell nothing of what the cable does between them: where it goes slack, their mean is
    not that of the force.

    Args:
        measurement: what was recorded.
    """
    tension = measurement.tension
    if tension is None or len(tension.values) < 3:
        return ()
    steps = np.diff(tension.values, axis=0)
    squares = np.sum(steps**2, axis=0)
    follows = np.sum(steps[1:] * steps[:-1], axis=0) / np.maximum(squares, 1e-300)
    # Half of a step is the amplitude of what alternates.
    amplitudes = 0.5 * np.sqrt(squares / len(steps))
    least = _LEAST * np.mean(np.abs(tension.values), axis=0)
    highest = 0.5 / float(np.median(np.diff(tension.times)))
    return tuple(
        Line(Place(Channel.TENSION, name), 0, highest, float(amplitude), 0.0, alternates=True)
        for name, share, amplitude, enough in zip(
            measurement.machine.cable_names, follows, amplitudes, amplitudes > least, strict=True
        )
        if share < _ALTERNATING and enough
    )
