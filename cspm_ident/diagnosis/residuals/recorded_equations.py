"""All equations of a recording."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.cable_and_bar_equations import suspension_equations
from cspm_ident.diagnosis.residuals.corrected_measurement import settled
from cspm_ident.diagnosis.residuals.drive_torque import drive_equations
from cspm_ident.diagnosis.residuals.free_shapes import Knots
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.residuals.virtual_load_cell import drawn_tension
from cspm_ident.diagnosis.residuals.winch_torque import shaft_equations
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.freed_memory import give_back
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.timeline import Timeline
from cspm_sim.effect_entries import read_actions
from cspm_sim.effects import Channel, Effect, Elements

Array = NDArray[np.float64]


def equations_of(
    measurement: Measurement,
    effects: Sequence[Effect],
    knots: Knots | None = None,
    progress: Callable[[str], None] = lambda _: None,
    touched: Sequence[Candidate] | None = None,
    assumed: Mapping[Candidate, Array] = MappingProxyType({}),
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> list[Equation]:
    """Return every residual that the sensors allow, less the known effects' part.

    Args:
        measurement: what was recorded, with the machine as it is described.
        effects: with regressors in the equations, such as the whole catalogue.
        knots: of the free functions; None: without these.
        progress: called with the name of the current step.
        touched: candidates of interest; residuals that they do not change may be left out.
        assumed: weights about which residuals are linearised, where virtual load cells are used,
            which winch faults change. They stay in the residuals.
        thresholds: those of residuals.

    Raises:
        InputError: the machine's effects cannot be used.
    """
    give_back()
    measurement = settled(measurement)
    known = read_actions(measurement.machine)
    winches, suspended = _reached(measurement, touched)
    # Cables and bar first, because they need most memory.
    late: list[Equation] = []
    if measurement.machine.bar is not None and suspended and measurement.knows_frame:
        progress("cables and bar")
        drawn = None if measurement.tension else drawn_tension(measurement, known)
        drawn = drawn and drawn.less(assumed)
        reported = measurement if drawn is None else drawn.measurement
        late = suspension_equations(
            Timeline(reported), effects, known, knots, drawn=drawn, thresholds=thresholds
        )
        give_back()
    progress("torque equations of the winches")
    found = drive_equations(measurement, effects, known, knots)
    found += shaft_equations(measurement, effects, known, knots, winches, thresholds)
    give_back()
    return found + late


def _reached(
    measurement: Measurement, touched: Sequence[Candidate] | None
) -> tuple[Collection[str], bool]:
    """Return the winches that candidates may affect, and whether they may affect cables and bar."""
    names = measurement.machine.cable_names
    # Without load cells, winch faults change the virtual load cells' tensions.
    if touched is None or measurement.tension is None:
        return names, True
    kinds = {
        r.channel
        for c in touched
        for r in (c.effect.signature.regression, *c.effect.signature.partners)
    }
    # Late load cells change the residuals of all winches.
    everywhere = any(c.effect.elements is Elements.CELLS for c in touched)
    winches = names if everywhere else {c.element for c in touched if c.element in names}
    return winches, not kinds <= {Channel.SHAFT, Channel.DRIVE}
