"""Tables of values for what no effect of the catalogue explains, fitted and held against data."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from cspm_ident.diagnosis.empirical.constrained_fit import Plan, Sums, fitted, folds_of, sums_of
from cspm_ident.diagnosis.empirical.table_choice import Drivers, chosen
from cspm_ident.diagnosis.residuals.corrected_measurement import as_found
from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation, in_noise, steady
from cspm_ident.diagnosis.selection.refinement import Cut
from cspm_ident.diagnosis.thresholds import Thresholds
from cspm_ident.signals.measurement import Measurement
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.testbed_keys.effect_table import (
    BAR_WRENCH,
    CABLE_TENSION,
    DRIVERS,
    WINCH_TORQUE,
    EffectTable,
)
from cspm_sim.effects import Channel, Effect
from cspm_sim.effects.empirical import table_effect

Array = NDArray[np.float64]
Parts = Sequence[Sequence[Equation]]
Tables = dict[Candidate, Array]

_PLACES = {
    Channel.SHAFT: WINCH_TORQUE,
    Channel.TENSION: CABLE_TENSION,
    Channel.WRENCH: BAR_WRENCH,
}
# The speed at which each residual acts, and the sign of a function of it that takes energy out.
_OPPOSES = {WINCH_TORQUE: ("speed", 1), CABLE_TENSION: ("rate of elongation", 1)}
# A residual that was not reported is described where it falls by this factor: the root mean square
# that is left is then what noise is for the goal of 1.5 times the noise.
_WORTHWHILE_RATIO = 1.5
NOTE = "describes the unmodelled residual and does not explain it"


class Searched(NamedTuple):
    """The data that tables are fitted to.

    Attributes:
        recordings: of which the searched part counts.
        part: cuts their equations to that part.
        weights: of the findings beside which tables are fitted.
        noise: of each residual, its unit.
        block_s: length of the blocks of the cross-validation [s].
        thresholds: of the diagnosis.
    """

    recordings: Sequence[Measurement]
    part: Cut
    weights: Mapping[Candidate, Array]
    noise: Mapping[Place, Array]
    block_s: float
    thresholds: Thresholds


class _Wanted(NamedTuple):
    """One channel of a residual, with the functions that describe it."""

    place: Place
    channel: int
    plan: Plan

    @property
    def where(self) -> str:
        """The place's name in a table."""
        return _PLACES[self.place.channel]

    def tables(self) -> list[EffectTable]:
        """Return tables with the right knots, their values zero."""
        found = []
        for term in self.plan.terms:
            knots = [tuple(map(float, axis.tabled_knots)) for axis in term.axes]
            names = [axis.name for axis in term.axes]
            content = {
                "place": self.where,
                "axis": DOFS[self.channel] if self.where == BAR_WRENCH else None,
                "driver": names[0],
                "knots": knots[0],
                "second_driver": names[1] if len(names) > 1 else None,
                "second_knots": knots[1] if len(knots) > 1 else (),
                "values": (0.0,) * int(np.prod([len(each) for each in knots])),
                "note": NOTE,
            }
            found.append(EffectTable.model_validate(content))
        return found


def empirical_tables(searched: Searched, unexplained: Collection[Place]) -> Tables:
    """Return values of tables that describe what findings leave of the residuals.

    Functions of time are left out: what they fit says nothing of other data.

    Args:
        searched: the data.
        unexplained: residuals of which a share is described as reported; others only where it is
            most of the squares.
    """
    rows = steady(_equations(searched, ()))
    wanted = [
        found
        for place in searched.noise
        if place.channel in _PLACES
        for channel in range(len(searched.noise[place]))
        if (
            found := _wanted(
                searched, rows, place, channel, _share(searched, reported=place in unexplained)
            )
        )
    ]
    if not wanted:
        return {}
    effects = [table_effect(table) for each in wanted for table in each.tables()]
    exact = _equations(searched, effects)
    tables: Tables = {}
    for each in wanted:
        tables |= _fitted(searched, exact, each)
    return tables


def _equations(searched: Searched, effects: Sequence[Effect]) -> Parts:
    parts = [
        equations_of(as_found(m, searched.weights), effects, thresholds=searched.thresholds)
        for m in searched.recordings
    ]
    return in_noise(searched.part(parts), searched.noise)


def _share(searched: Searched, *, reported: bool) -> float:
    """Return the share of a squared residual that a first function has to take."""
    return searched.thresholds.unknown_share if reported else 1.0 - _WORTHWHILE_RATIO**-2


def _wanted(
    searched: Searched, rows: Parts, place: Place, channel: int, least: float
) -> _Wanted | None:
    """Return the functions that describe one channel of a residual; None where none does."""
    own = [e for part in rows for e in part if e.place == place and len(e.times)]
    if not own:
        return None
    where = _PLACES[place.channel]
    names = {key: key.split(" [")[0] for key in own[0].signals}
    signals = {
        name: np.concatenate([e.signals[key] for e in own])
        for key, name in names.items()
        if name in DRIVERS[where] and all(key in e.signals for e in own)
    }
    target = np.concatenate([_projected(e, e.target[:, channel], channel) for e in own])
    opposes = dict([_OPPOSES[where]]) if where in _OPPOSES else {f"{DOFS[channel]} speed": -1}
    folds = np.concatenate([folds_of(e.times, searched.block_s) for e in own])
    planes = where != BAR_WRENCH
    further = searched.thresholds.unknown_share
    plan = chosen(Drivers(target, signals, folds, opposes, planes), least, further)
    return None if plan is None else _Wanted(place, channel, plan)


def _projected(equation: Equation, values: Array, channel: int) -> Array:
    """Return values of one channel, (k,) or (k, m), less what unknown quantities explain."""
    if not equation.nuisance.size:
        return values
    unknown = equation.nuisance[:, channel]
    return np.asarray(values - unknown @ np.linalg.lstsq(unknown, values, rcond=None)[0])


def _fitted(searched: Searched, rows: Parts, wanted: _Wanted) -> Tables:
    """Return the values of one residual's tables, from the exact columns.

    Whether functions of a speed jump at zero is decided by the rows of reversals, to which they are
    not fitted, for a shaft may stick there.
    """
    candidates = [Candidate(table_effect(t), wanted.place.element) for t in wanted.tables()]
    own = [e for part in rows for e in part if e.place == wanted.place and len(e.times)]
    tried = []
    for jumps in (False, True):
        terms = tuple(term.jumping(jumps=jumps) for term in wanted.plan.terms)
        plan = wanted.plan._replace(terms=terms)
        tie = block_diag(*(term.tie for term in terms))
        values = tie @ fitted(_sums(searched, own, wanted, candidates, tie), plan)
        unit = _unit(searched, wanted)
        left = [t - c @ values for c, t in (_exact(e, wanted, candidates, unit) for e in own)]
        tried.append((sum(float(each @ each) for each in left), unit * values))
    values = min(tried, key=lambda each: each[0])[1]
    ends = np.cumsum([len(c.effect.parameters) for c in candidates])[:-1]
    return dict(zip(candidates, np.split(values, ends), strict=True))


def _unit(searched: Searched, wanted: _Wanted) -> float:
    return float(searched.noise[wanted.place][wanted.channel]) or 1.0


def _exact(
    equation: Equation, wanted: _Wanted, candidates: Sequence[Candidate], unit: float
) -> tuple[Array, Array]:
    """Return the tables' columns per unit of the noise, and the residual, without unknowns."""
    channel = wanted.channel
    found = np.hstack([equation.columns[c][:, channel] for c in candidates]).astype(float)
    columns = _projected(equation, found * unit, channel)
    return columns, _projected(equation, equation.target[:, channel], channel)


def _sums(
    searched: Searched,
    own: Sequence[Equation],
    wanted: _Wanted,
    candidates: Sequence[Candidate],
    tie: Array,
) -> Sums:
    """Return the sums over rows without a reversal, of columns per value at the knots."""
    still = [each for e in own if len((each := e.steady).times)]
    pairs = [_exact(each, wanted, candidates, _unit(searched, wanted)) for each in still]
    folds = np.concatenate([folds_of(each.times, searched.block_s) for each in still])
    columns, target = (np.concatenate(each) for each in zip(*pairs, strict=True))
    return sums_of(columns @ tie, target, folds)
