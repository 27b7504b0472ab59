"""Tensions that alternate from one reading to the next: what moves them is too fast to be read."""

from __future__ import annotations

import numpy as np

from cspm_ident.diagnosis.residuals.regressors import Place
from cspm_ident.diagnosis.residuals.spectral_lines import Line
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.signals.measurement import Measurement
from cspm_sim.effects import Channel


def chatters_of(
    measurement: Measurement, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> tuple[Line, ...]:
    """Return the tensions of a recording that alternate, as lines at half of the rate of readings.

    A force loop that is unstable swings as fast as its controller acts, and readings taken at the
    same rate tell nothing of what the cable does between them: where it goes slack, their mean is
    not that of the force.

    Args:
        measurement: what was recorded.
        thresholds: those of aliased tensions.
    """
    tension = measurement.tension
    if tension is None or len(tension.values) < 3:
        return ()
    steps = np.diff(tension.values, axis=0)
    squares = np.sum(steps**2, axis=0)
    follows = np.sum(steps[1:] * steps[:-1], axis=0) / np.maximum(squares, 1e-300)
    # Half of a step is the amplitude of what alternates.
    amplitudes = 0.5 * np.sqrt(squares / len(steps))
    least = thresholds.aliased_amplitude_share * np.mean(np.abs(tension.values), axis=0)
    highest = 0.5 / float(np.median(np.diff(tension.times)))
    return tuple(
        Line(Place(Channel.TENSION, name), 0, highest, float(amplitude), 0.0, alternates=True)
        for name, share, amplitude, enough in zip(
            measurement.machine.cable_names, follows, amplitudes, amplitudes > least, strict=True
        )
        if share < -thresholds.aliased_anticorrelation and enough
    )
