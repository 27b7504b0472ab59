"""Aliased tensions: readings that alternate because the motion is too fast for their rate."""

from __future__ import annotations

import numpy as np

from cspm_ident.diagnosis.residuals.regressors import Place
from cspm_ident.diagnosis.residuals.spectral_lines import Line
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.signals.measurement import Measurement
from cspm_sim.effects import Channel

ANTICORRELATION = 2.0 / 3.0
"""Correlation of successive steps, negated, of differentiated white readings; white ones have 1/2.
More of it is an alternation."""


def chatters_of(
    measurement: Measurement, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> tuple[Line, ...]:
    """Return the alternating tensions of a recording, as lines at half the sampling rate.

    An unstable force loop oscillates at its controller's rate. Readings at the same rate do not
    show the cable's motion between them: where the cable goes slack, their mean is not the mean
    force.

    Args:
        measurement: recorded signals.
        thresholds: those of aliased tensions.
    """
    tension = measurement.tension
    if tension is None or len(tension.values) < 3:
        return ()
    steps = np.diff(tension.values, axis=0)
    squares = np.sum(steps**2, axis=0)
    follows = np.sum(steps[1:] * steps[:-1], axis=0) / np.maximum(squares, 1e-300)
    # The amplitude of an alternating signal is half its step.
    amplitudes = 0.5 * np.sqrt(squares / len(steps))
    least = thresholds.majority_share * np.mean(np.abs(tension.values), axis=0)
    highest = 0.5 / float(np.median(np.diff(tension.times)))
    return tuple(
        Line(Place(Channel.TENSION, name), 0, highest, float(amplitude), 0.0, alternates=True)
        for name, share, amplitude, enough in zip(
            measurement.machine.cable_names, follows, amplitudes, amplitudes > least, strict=True
        )
        if share < -ANTICORRELATION and enough
    )
