"""Clock drift of a test rig's load cells against the clock of its drives."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.corrected_measurement import settled
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.residuals.winch_torque import PULL, SPEED, shaft_equations
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.estimation import Parameter, Record, fit_linear
from cspm_ident.signals.clock_drift import ClockDrift, without_drifts
from cspm_ident.signals.measurement import TENSION, Measurement
from cspm_sim.effect_entries import read_actions
from cspm_sim.effects import Effect, Elements, catalogue

Array = NDArray[np.float64]

# Scale of the drift in its fit.
_SCALE = 2.5e-5
LEAST_SHIFT_S = 2e-6
"""Clocks that differ by less over a recording shift nothing in a rope's torque."""
# Least length of a column, and least relative singular value.
_NOTHING, _RANK = 1e-300, 1e-9
# Least number of rows for a fit of a drift with the other regressors.
_FEWEST = 16


def on_drives_clock(
    measurement: Measurement, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> Measurement:
    """Return a rig's measurement with the drift of the load cells' stamps removed.

    The initial delay stays. With a bar, tensions change too slowly to identify the drift of a
    healthy clock, or to be affected by it. The measurement is then returned unchanged.
    """
    if measurement.machine.bar is not None or measurement.tension is None:
        return measurement
    drift = cell_drift(measurement, thresholds)
    if drift is None or not _is_plausible(drift, thresholds):
        return measurement
    return without_drifts(measurement, [drift])


def cell_drift(
    measurement: Measurement, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> ClockDrift | None:
    """Return the load cells' clock drift from the winches' torque equations, or None.

    A late reading changes the residual by the delay times the tension's rate. Fitted with the
    drift: an initial delay common to all load cells, friction, and errors of scale and zero.
    """
    own = settled(measurement)
    names = own.machine.cable_names
    late, known = [_lateness()], read_actions(own.machine)
    equations = shaft_equations(own, late, known, None, names, thresholds)
    # Winches without cable may have no load cell.
    rows = [each.steady for each in equations if each.columns]
    records = [_record(each) for each in rows if len(each.times) >= _FEWEST]
    if not records:
        return None
    estimate = fit_linear(records, [Parameter("drift", "1", scale=_SCALE)], whiten=False).estimate
    low, high = estimate.ci95[0]
    rate = float(estimate.values[0])
    return ClockDrift(TENSION, rate, (float(low), float(high)), measurement.duration)


def _lateness() -> Effect:
    """Return the effect of late load cells."""
    cells = (e for e in catalogue().values() if e.acts_on is Elements.CELLS)
    return next(e for e in cells if e.physics.sense and e.physics.sense.lateness)


def _record(equation: Equation) -> Record:
    """Return the partial regression of the drift (Frisch and Waugh, Econometrica 1(4), 1933)."""
    (late,) = (np.asarray(each[:, 0, 0], float) for each in equation.columns.values())
    speed, tension = (equation.signals[name] for name in (SPEED, PULL))
    others = np.stack([late, np.ones(len(late)), tension, speed, np.sign(speed)], axis=1)
    others = others / np.maximum(np.linalg.norm(others, axis=0), _NOTHING)
    both = np.column_stack([equation.target, late * equation.times])
    left = both - others @ np.linalg.lstsq(others, both, rcond=_RANK)[0]
    return Record(left[:, :1], left[:, 1:])


def _is_plausible(drift: ClockDrift, thresholds: Thresholds) -> bool:
    low, high = drift.interval
    reported = not low <= 0.0 <= high and abs(drift.rate) * drift.apart > LEAST_SHIFT_S
    return reported and abs(drift.rate) <= thresholds.healthy_clock_drift
