"""Smooth least squares under constraints, judged by cross-validation over blocks of time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, cho_factor, cho_solve, cholesky, solve_triangular
from scipy.optimize import lsq_linear

from cspm_ident.diagnosis.empirical.table_basis import Constraint, Term

Array = NDArray[np.float64]
Index = NDArray[np.intp]

FOLDS = 5
# Weights of the penalty on curvature that are tried, in squares per row.
SMOOTHNESS = (1e-6, 1e-4, 1e-2, 1.0)
# Weight that settles which of two functions has what both could have, relative to the data's.
_RIDGE = 1e-6
# Relative accuracy of the solver under bounds.
_SOLVED = 1e-9


class Sums(NamedTuple):
    """Sums over the rows of each fold.

    Attributes:
        gram: of the columns, shape (folds, m, m).
        target: of columns and target, (folds, m).
        squares: of the target, (folds,).
        rows: counts, (folds,).
    """

    gram: Array
    target: Array
    squares: Array
    rows: Array


class Plan(NamedTuple):
    """How functions are fitted.

    Attributes:
        terms: the functions.
        constraints: of each.
        smoothness: weight of the penalty on curvature.
    """

    terms: tuple[Term, ...]
    constraints: tuple[Constraint, ...]
    smoothness: float


def sums_of(columns: Array, target: Array, folds: Index) -> Sums:
    """Return the sums of columns, (n, m), and target, (n,), over rows of each fold, (n,)."""
    width = columns.shape[1]
    gram, right = np.zeros((FOLDS, width, width)), np.zeros((FOLDS, width))
    squares, rows = np.zeros(FOLDS), np.zeros(FOLDS)
    for k in range(FOLDS):
        own, aim = columns[folds == k], target[folds == k]
        gram[k], right[k] = own.T @ own, own.T @ aim
        squares[k], rows[k] = aim @ aim, len(aim)
    return Sums(gram, right, squares, rows)


def folds_of(times: Array, block_s: float) -> Index:
    """Return the fold of each row: blocks of time [s] are dealt in turn."""
    return np.asarray((times - times.min()) // block_s, dtype=np.intp) % FOLDS


class _Form(NamedTuple):
    """What a plan's fit has in common whichever rows it is of.

    Attributes:
        penalty: on curvature per row, (m, m).
        maps: from what is fitted to the values at all knots, (m, p).
        least: lower bound of what is fitted, (p,).
    """

    penalty: Array
    maps: Array
    least: Array


def fitted(sums: Sums, plan: Plan) -> Array:
    """Return the values at all knots, term by term.

    Args:
        sums: of the columns of all terms, side by side.
        plan: how to fit.
    """
    return _solved(sums, _form(plan), np.arange(FOLDS))


def errors(sums: Sums, plan: Plan) -> Array:
    """Return the mean square of each fold, fitted to the others, (folds,)."""
    form, found = _form(plan), []
    for k in range(FOLDS):
        values = _solved(sums, form, np.delete(np.arange(FOLDS), k))
        left = sums.squares[k] - 2.0 * values @ sums.target[k] + values @ sums.gram[k] @ values
        found.append(max(0.0, float(left)) / max(1.0, float(sums.rows[k])))
    return np.array(found)


def _form(plan: Plan) -> _Form:
    rough = block_diag(*(term.roughness for term in plan.terms))
    each = [t.map(c) for t, c in zip(plan.terms, plan.constraints, strict=True)]
    least = [
        np.full(own.shape[1], 0.0 if c is not Constraint.FREE else -np.inf)
        for own, c in zip(each, plan.constraints, strict=True)
    ]
    return _Form(plan.smoothness * rough.T @ rough, block_diag(*each), np.concatenate(least))


def _solved(sums: Sums, form: _Form, folds: Index) -> Array:
    """Return the values at all knots that fit the rows of some folds."""
    gram, right = sums.gram[folds].sum(axis=0), sums.target[folds].sum(axis=0)
    gram = gram + sums.rows[folds].sum() * form.penalty
    maps = form.maps
    inner = maps.T @ gram @ maps
    inner += _RIDGE * max(float(np.trace(inner)), 1e-300) / len(inner) * np.eye(len(inner))
    if not np.isfinite(form.least).any():
        return np.asarray(maps @ cho_solve(cho_factor(inner), maps.T @ right))
    upper = cholesky(inner)
    aim = solve_triangular(upper, maps.T @ right, trans="T")
    return np.asarray(maps @ lsq_linear(upper, aim, (form.least, np.inf)).x)


def nothing(sums: Sums) -> Array:
    """Return the mean square of each fold with no function at all, (folds,)."""
    return np.asarray(sums.squares / np.maximum(1.0, sums.rows))


def is_better(before: Array, after: Array) -> bool:
    """Return whether errors by fold fall by more than one standard error of their difference.

    What the solver leaves is no fall: a constraint that does not act gives the same fit.
    """
    fall, same = before - after, _SOLVED * before.mean()
    return bool(fall.mean() > max(same, fall.std(ddof=1) / np.sqrt(len(fall))))


def simplest(sums: Sums, plans: Sequence[Plan]) -> tuple[Plan, Array]:
    """Return the first plan whose error is within one standard error of the least.

    The one-standard-error rule (Breiman, Friedman, Olshen, Stone, Classification and Regression
    Trees, 1984, 3.4.3). Plans are in the order of preference.
    """
    tried = [(plan, errors(sums, plan)) for plan in plans]
    best = min(tried, key=lambda each: each[1].mean())[1]
    return next(each for each in tried if not is_better(each[1], best))
