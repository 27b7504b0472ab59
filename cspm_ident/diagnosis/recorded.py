"""All equations of a recording."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from cspm_ident.diagnosis.equation import Equation
from cspm_ident.diagnosis.shaft import shaft_equations
from cspm_ident.diagnosis.suspension_equations import suspension_equations
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.timeline import Timeline
from cspm_sim.effect_entries import read_actions
from cspm_sim.effects import Effect


def equations_of(
    measurement: Measurement,
    effects: Sequence[Effect],
    progress: Callable[[str], None] = lambda _: None,
) -> list[Equation]:
    """Return every residual that the recording's sensors allow.

    Args:
        measurement: what was recorded, with the machine as it is described.
        effects: the catalogue.
        progress: called with what is being done.
    """
    known = read_actions(measurement.machine)
    progress("torque equations of the winches")
    found = shaft_equations(measurement, effects, known, _torque_age(measurement))
    if measurement.machine.bar is not None:
        progress("cables and bar")
        found += suspension_equations(Timeline(measurement), effects, known)
    return found


def _torque_age(measurement: Measurement) -> float:
    """Half a period: a drive reports the torque that it applied up to the stamp."""
    torque = measurement.torque
    return 0.0 if torque is None else 0.5 * torque.interval
