"""Which functions of which drivers describe a residual."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.empirical.constrained_fit import (
    SMOOTHNESS,
    Index,
    Plan,
    errors,
    is_better,
    nothing,
    simplest,
    sums_of,
)
from cspm_ident.diagnosis.empirical.table_basis import (
    SECOND_KNOTS,
    Constraint,
    Term,
    axis_of,
)

Array = NDArray[np.float64]

# Functions that add up in one residual at most, and knots along the first of two drivers.
MOST_TERMS = 3
_PLANE_KNOTS = 8


class Drivers(NamedTuple):
    """Signals of one residual of one channel.

    Attributes:
        target: the residual in units of its noise, shape (n,).
        signals: by name, each (n,).
        folds: of the rows, (n,).
        opposes: by name of a driver at whose speed the residual acts, the sign that opposes it.
        planes: whether functions of two drivers are tried.
    """

    target: Array
    signals: Mapping[str, Array]
    folds: Index
    opposes: Mapping[str, int]
    planes: bool


def chosen(drivers: Drivers, least_share: float, further_share: float) -> Plan | None:
    """Return the functions that describe a residual; None where none does.

    Functions are added one by one, each that lowers the cross-validated error most, as long as it
    falls by more than its standard error. A function of two drivers is taken where functions that
    add up are worse. Of their constraints the strongest are taken with which the error is as low.

    Args:
        drivers: the residual and its signals.
        least_share: of the squared residual that all functions have to take.
        further_share: of what is left that each further function has to take.
    """
    first = nothing(sums_of(np.zeros((len(drivers.target), 0)), *_rows(drivers)))
    single = _single_terms(drivers)
    terms, best = _added(drivers, (), first, single, further_share)
    planes = [(plane, _smooth(drivers, (plane,))[1]) for plane in _planes(drivers)]
    if planes:
        plane, now = min(planes, key=lambda each: each[1].mean())
        if is_better(best, now) and now.mean() < (1.0 - further_share) * best.mean():
            terms, best = _added(drivers, (plane,), now, single, further_share)
    if not terms or first.mean() - best.mean() < least_share * first.mean():
        return None
    return _constrained(drivers, terms)


def _added(
    drivers: Drivers, terms: tuple[Term, ...], best: Array, pool: Sequence[Term], share: float
) -> tuple[tuple[Term, ...], Array]:
    """Return functions with further ones of other drivers, and the error by fold."""
    while len(terms) < MOST_TERMS:
        used = {axis.name for term in terms for axis in term.axes}
        tried = [
            (term, _smooth(drivers, (*terms, term))[1])
            for term in pool
            if term.axes[0].name not in used
        ]
        if not tried:
            break
        term, now = min(tried, key=lambda each: each[1].mean())
        if not is_better(best, now) or best.mean() - now.mean() < share * best.mean():
            break
        terms, best = (*terms, term), now
    return terms, best


def _rows(drivers: Drivers) -> tuple[Array, Index]:
    return drivers.target, drivers.folds


def _columns(drivers: Drivers, terms: Sequence[Term]) -> Array:
    return np.hstack([term.columns(dict(drivers.signals)) for term in terms])


def _single_terms(drivers: Drivers) -> list[Term]:
    axes = (
        axis_of(name, values, drivers.opposes.get(name, 0))
        for name, values in drivers.signals.items()
    )
    return [Term((axis,)) for axis in axes if axis is not None]


def _planes(drivers: Drivers) -> list[Term]:
    found = []
    for one, other in combinations(drivers.signals, 2) if drivers.planes else ():
        opposes = drivers.opposes.get(one, 0)
        first = axis_of(one, drivers.signals[one], opposes, _PLANE_KNOTS)
        second = axis_of(other, drivers.signals[other], 0, SECOND_KNOTS)
        if first is not None and second is not None:
            found.append(Term((first, second)))
    return found


def _smooth(drivers: Drivers, terms: tuple[Term, ...]) -> tuple[float, Array]:
    """Return the smoothness of least error, and the error by fold."""
    sums, free = sums_of(_columns(drivers, terms), *_rows(drivers)), (Constraint.FREE,) * len(terms)
    tried = [(weight, errors(sums, Plan(terms, free, weight))) for weight in SMOOTHNESS]
    return min(tried, key=lambda each: each[1].mean())


def _constrained(drivers: Drivers, terms: tuple[Term, ...]) -> Plan:
    """Return the plan with the strongest constraints, then the smoothest, of as low an error."""
    sums = sums_of(_columns(drivers, terms), *_rows(drivers))
    plan = Plan(terms, (Constraint.FREE,) * len(terms), _smooth(drivers, terms)[0])
    for k, term in enumerate(terms):
        plans = [
            plan._replace(constraints=(*plan.constraints[:k], each, *plan.constraints[k + 1 :]))
            for each in term.constraints
        ]
        plan, _ = simplest(sums, plans)
    smoother = [w for w in reversed(SMOOTHNESS) if w >= plan.smoothness]
    return simplest(sums, [plan._replace(smoothness=weight) for weight in smoother])[0]
