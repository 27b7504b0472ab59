"""Tables of values against held-out data: those that do not lower a residual are left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.diagnosis.validation.holdout_residuals import (
    HeldOut,
    residuals_of,
    rms,
)
from cspm_ident.diagnosis.validation.holdout_simulation import (
    Baselines,
    SimulatedFit,
    with_tables_simulated,
)
from cspm_ident.signals.measurement import Measurement
from cspm_msgs_py.dofs import DOFS

Array = NDArray[np.float64]
# Ratio of simulated errors that scatter alone makes.
_NO_WORSE = 1.05
Tables = Mapping[Candidate, Array]


def confirmed_tables(
    parts: Sequence[tuple[Measurement, float]],
    found: Mapping[Candidate, Array],
    tables: Tables,
    noise: Mapping[Place, Array],
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> dict[Candidate, Array]:
    """Return the tables with which the squared residual of their channel falls on held-out data.

    Args:
        parts: recordings, each with the time from which it is held out [s].
        found: weights of the findings.
        tables: values of the tables.
        noise: of each residual, its unit.
        thresholds: those of residuals.
    """
    if not tables:
        return {}
    before = residuals_of(parts, found, noise, thresholds)
    after = residuals_of(parts, {**found, **tables}, noise, thresholds)
    kept = {}
    for candidate, values in tables.items():
        place = _place_of(candidate)
        table = candidate.effect.table
        assert table is not None
        channel = DOFS.index(table.axis) if table.axis else 0
        falls = _squares(after.get(place, ()), channel) < _squares(before.get(place, ()), channel)
        if falls:
            kept[candidate] = values
    return kept


def simulated_tables(
    fits: Sequence[SimulatedFit],
    baselines: Baselines,
    found: Mapping[Candidate, Array],
    tables: Tables,
) -> dict[Candidate, Array]:
    """Return the tables with which no simulation of their own place becomes worse.

    Args:
        fits: simulations of the held-out data with the findings.
        baselines: those of the recordings.
        found: weights of the findings.
        tables: values of the tables.
    """
    kept = dict(tables)
    while kept:
        now = with_tables_simulated(fits, baselines, {**found, **kept})
        worse = {
            Place(each.output.kind, each.output.element)
            for each in now
            if not each.final <= _NO_WORSE * each.after
        }
        gone = [c for c in kept if _place_of(c) in worse]
        if not gone:
            break
        kept = {c: values for c, values in kept.items() if c not in gone}
    return kept


def _place_of(candidate: Candidate) -> Place:
    return Place(candidate.effect.signature.regression.channel, candidate.element)


def with_tables(
    fits: Sequence[HeldOut],
    measurements: Sequence[Measurement],
    starts: Sequence[float],
    found: Mapping[Candidate, Array],
    noise: Mapping[Place, Array],
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> tuple[HeldOut, ...]:
    """Return the held-out residuals with those of a model that has tables as well.

    Args:
        fits: the residuals without tables.
        measurements: the recordings.
        starts: times from which each is held out [s].
        found: weights of the findings and values of the tables.
        noise: of each residual, its unit.
        thresholds: those of residuals.
    """
    parts = list(zip(measurements, starts, strict=True))
    after = residuals_of(parts, found, noise, thresholds)
    units = {p: float(noise[p][0]) if len(noise[p]) == 1 else 1.0 for p in after}
    return tuple(
        replace(fit, tabled=units[fit.place] * rms(after[fit.place])) if fit.place in after else fit
        for fit in fits
    )


def _squares(equations: Sequence[Equation], channel: int) -> float:
    return sum(float(np.sum(e.left[:, channel] ** 2)) for e in equations)
