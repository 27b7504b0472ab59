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


def fitted(sums: Sums, plan: Plan, without: int | None = None) -> Array:
    """Return the values at all knots, term by term.

    Args:
        sums: of the columns of all terms, side by side.
        plan: how to fit.
        without: the fold that is left out; None: none.
    """
    keep = np.arange(FOLDS) != (-1 if without is None else without)
    gram, right = sums.gram[keep].sum(axis=0), sums.target[keep].sum(axis=0)
    rough = block_diag(*(term.roughness for term in plan.terms))
    gram = gram + plan.smoothness * sums.rows[keep].sum() * rough.T @ rough
    maps = block_diag(*(t.map(c) for t, c in zip(plan.terms, plan.constraints, strict=True)))
    inner = maps.T @ gram @ maps
    inner += _RIDGE * max(float(np.trace(inner)), 1e-300) / len(inner) * np.eye(len(inner))
    bounded = np.concatenate(
        [
            np.full(t.map(c).shape[1], 0.0 if c is not Constraint.FREE else -np.inf)
            for t, c in zip(plan.terms, plan.constraints, strict=True)
        ]
    )
    if not np.isfinite(bounded).any():
        return np.asarray(maps @ cho_solve(cho_factor(inner), maps.T @ right))
    upper = cholesky(inner)
    aim = solve_triangular(upper, maps.T @ right, trans="T")
    return np.asarray(maps @ lsq_linear(upper, aim, (bounded, np.inf)).x)


def errors(sums: Sums, plan: Plan) -> Array:
    """Return the mean square of each fold, fitted to the others, (folds,)."""
    found = []
    for k in range(FOLDS):
        values = fitted(sums, plan, k)
        left = sums.squares[k] - 2.0 * values @ sums.target[k] + values @ sums.gram[k] @ values
        found.append(max(0.0, float(left)) / max(1.0, float(sums.rows[k])))
    return np.array(found)


def nothing(sums: Sums) -> Array:
    """Return the mean square of each fold with no function at all, (folds,)."""
    return np.asarray(sums.squares / np.maximum(1.0, sums.rows))


def is_better(before: Array, after: Array) -> bool:
    """Return whether errors by fold fall by more than one standard error of their difference."""
    fall = before - after
    return bool(fall.mean() > fall.std(ddof=1) / np.sqrt(len(fall)))


def simplest(sums: Sums, plans: Sequence[Plan]) -> tuple[Plan, Array]:
    """Return the first plan whose error is within one standard error of the least.

    The one-standard-error rule (Breiman, Friedman, Olshen, Stone, Classification and Regression
    Trees, 1984, 3.4.3). Plans are in the order of preference.
    """
    tried = [(plan, errors(sums, plan)) for plan in plans]
    best = min(tried, key=lambda each: each[1].mean())[1]
    return next(each for each in tried if not is_better(each[1], best))
