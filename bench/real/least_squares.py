"""An independent fit: least squares of the true terms alone, on the same residual rows."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.signals.measurement import Measurement
from cspm_sim.effects import Channel, catalogue

Array = NDArray[np.float64]
Shape = tuple[tuple[str, float], ...]


class LeastSquares(NamedTuple):
    """What the true terms make of recordings.

    Attributes:
        amounts: by effect and parameter, in the effects' units.
        unexplained: RMS torque that is left of the searched rows [N·m].
        error: RMS torque that is left of the judged rows [N·m].
    """

    amounts: dict[str, dict[str, float]]
    unexplained: float
    error: float


def least_squares(
    searched: Sequence[Measurement], held_out: Sequence[Measurement], effects: Collection[str]
) -> LeastSquares:
    """Return the fit of the true terms of one winch on rows without reversals.

    Every combination of their nonlinear parameters on the catalogue's grid is tried on the searched
    rows. Nothing of the search, its tests or its refinement is used.

    Args:
        searched: recordings that are fitted.
        held_out: recordings that are predicted; if empty, the last 30 % of the searched ones.
        effects: ids of the true effects.
    """
    known = [effect for name, effect in catalogue().items() if name in effects]
    fitted, judged = _rows(searched, known), _rows(held_out, known)
    if not held_out:
        ends = [each.times[0] + 0.7 * np.ptp(each.times) for each in fitted]
        judged = [e.within(end, np.inf) for e, end in zip(fitted, ends, strict=True)]
        fitted = [e.within(-np.inf, end) for e, end in zip(fitted, ends, strict=True)]
    best = min((_solved(fitted, terms) for terms in _choices(fitted)), key=lambda each: each[0])
    _, terms, weights = best
    return LeastSquares(
        _amounts(fitted[0], terms, weights),
        _left(fitted, terms, weights),
        _left(judged, terms, weights),
    )


def _left(rows: Sequence[Equation], terms: Sequence[Candidate], weights: Array) -> float:
    left = [e.target[:, 0] - _columns(e, terms) @ weights for e in rows]
    return float(np.sqrt(np.mean(np.concatenate(left) ** 2)))


def _amounts(
    row: Equation, terms: Sequence[Candidate], weights: Array
) -> dict[str, dict[str, float]]:
    found, rest = {}, list(weights)
    for term in terms:
        count = row.columns[term].shape[2]
        own, rest = rest[:count], rest[count:]
        found[term.effect_id] = term.effect.values(own, **term.nonlinear)
    return found


def _rows(measurements: Sequence[Measurement], effects: Sequence[object]) -> list[Equation]:
    equations = [e for m in measurements for e in equations_of(m, effects)]  # type: ignore[arg-type]
    steady = (e.steady for e in equations if e.place.channel is Channel.SHAFT)
    return [each for each in steady if len(each.times)]


def _choices(rows: Sequence[Equation]) -> list[list[Candidate]]:
    """Return the candidates with every combination of their nonlinear parameters."""
    shapes: dict[str, dict[Shape, list[Candidate]]] = {}
    for term in rows[0].columns:
        if isinstance(term, Candidate):
            shapes.setdefault(term.effect_id, {}).setdefault(term.shape, []).append(term)
    combined = product(*(list(own.values()) for own in shapes.values()))
    return [[term for members in choice for term in members] for choice in combined]


def _columns(equation: Equation, terms: Sequence[Candidate]) -> Array:
    if not terms:
        return np.empty((len(equation.times), 0))
    return np.hstack([equation.columns[term][:, 0] for term in terms]).astype(float)


def _solved(
    rows: Sequence[Equation], terms: list[Candidate]
) -> tuple[float, list[Candidate], Array]:
    """Return squares left, terms and weights."""
    columns = np.concatenate([_columns(each, terms) for each in rows])
    target = np.concatenate([each.target[:, 0] for each in rows])
    weights = np.linalg.lstsq(columns, target, rcond=None)[0]
    return float(np.sum((target - columns @ weights) ** 2)), terms, weights
