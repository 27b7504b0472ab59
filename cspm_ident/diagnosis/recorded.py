"""All equations of a recording."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from cspm_ident.diagnosis.drive import drive_equations
from cspm_ident.diagnosis.drivers import Knots
from cspm_ident.diagnosis.equation import Equation
from cspm_ident.diagnosis.shaft import shaft_equations
from cspm_ident.diagnosis.supposed import settled
from cspm_ident.diagnosis.suspension_equations import suspension_equations
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.timeline import Timeline
from cspm_sim.effect_entries import read_actions
from cspm_sim.effects import Effect


def equations_of(
    measurement: Measurement,
    effects: Sequence[Effect],
    knots: Knots | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> list[Equation]:
    """Return every residual that the sensors allow, less what the machine's effects add.

    Args:
        measurement: what was recorded, with the machine as it is described.
        effects: whose columns are wanted, such as the whole catalogue.
        knots: of the free functions; None: without these.
        progress: called with what is being done.

    Raises:
        InputError: the machine's effects cannot be used.
    """
    measurement = settled(measurement)
    known = read_actions(measurement.machine)
    progress("torque equations of the winches")
    found = drive_equations(measurement, effects, known, knots)
    found += shaft_equations(measurement, effects, known, knots)
    if measurement.machine.bar is not None:
        progress("cables and bar")
        found += suspension_equations(Timeline(measurement), effects, known, knots)
    return found
