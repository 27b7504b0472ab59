"""Scatter of stamps against what accelerations need."""

from __future__ import annotations

import numpy as np

from cspm_ident.data_look.data_check import DataCheck, check_of
from cspm_ident.signals.jumps import without_jumps
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.samples import Samples
from cspm_ident.winch.motion_source import MotionSource, source_of
from cspm_ident.winch.recording import WinchSignals
from cspm_msgs_py.errors import InputError

# Of the time between samples: less than that is rounding.
_EVEN = 0.01
_FRICTIONS = ("winch_viscous_friction", "winch_coulomb_friction")


def stamp_check(measurement: Measurement) -> DataCheck:
    """Return whose accelerations are noise because of stamps or a coarse encoder."""
    angle = measurement.angle
    if angle is None:
        return DataCheck("stamps", measurement.path, True, "no angle, so no acceleration")
    found = []
    for i, name in enumerate(measurement.machine.cable_names):
        column = without_jumps(angle.column(i))
        if not np.ptp(column.values) or not column.interval:
            continue
        source = _source(column)
        if source is not None and not source.shows_acceleration:
            found.append(
                f"{100.0 * source.noise_share:.0f} % of the accelerations of {name} are noise, as"
                f" stamps that scatter by {1e3 * source.stamp_error:.2g} ms make it"
            )
    remedy = "record stamps of the instant of measurement, or the drives' speeds"
    scatter = float(np.mean(np.abs(np.diff(angle.times) - angle.interval))) / angle.interval
    well = "stamps are even"
    if scatter > _EVEN:
        well = f"stamps are uneven by {100.0 * scatter:.0f} %, and angles agree with them"
    return check_of("stamps", measurement.path, found, well, remedy)


def _source(angle: Samples) -> MotionSource | None:
    """Return an angle as the source of accelerations; None where it has no window of motion."""
    signals = [WinchSignals(angle, angle, None, 1.0)]
    for reversals in (False, True):
        try:
            return source_of(signals, _FRICTIONS, reversals=reversals)
        except InputError:
            continue
    return None
