"""Self-calibration: nonlinear least squares of cable lengths, with what is known beforehand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import t as student

from cspm_ident.estimation.block_length import block_length
from cspm_ident.estimation.covariance import long_run_sum
from cspm_ident.geometry.length_rows import RATE, LengthRows
from cspm_ident.geometry.unknowns import Unknowns
from cspm_msgs_py.errors import ConvergenceError

Array = NDArray[np.float64]

_ROUNDS = 30
_REWEIGHED = 8  # rounds after which weights and accuracies are kept
_SETTLED = 1e-3  # of a standard deviation
# What a model of straight cables leaves over at best, as an error that a second averages [m].
_FLOOR_M = 1e-6
# Poses are common to all cables, which correlates their errors; what is estimated of that counts
# less than in full, or few blocks would make differences between cables exact.
_CORRELATED = 0.9
_FIRST_M = 1e-3
# At first little is held, or what the accuracies hold back would pass for noise.
_WIDE = 30.0


@dataclass(frozen=True, eq=False)
class Calibration:
    """The optimum, and what is known about it.

    Attributes:
        unknowns: what was fitted.
        values: of all unknowns, (u,).
        covariance: of these, (u, u).
        information: of the data alone, (u, u).
        row_information: of each cable's error per row, (n, n) [1/m²].
        accuracies: before the data, (u,), larger than the usual ones where the data shows it.
        factors: by group, by how much they are.
        freedom: of the t distribution.
    """

    unknowns: Unknowns
    values: Array
    covariance: Array
    information: Array
    row_information: Array
    accuracies: Array
    factors: dict[str, float]
    freedom: float

    @property
    def quantile(self) -> float:
        """Half a 95 % interval in standard deviations."""
        return float(student.ppf(0.975, self.freedom))

    def spread(self, directions: Array) -> Array:
        """Return the standard deviations of combinations, (m,), given as rows (m, u)."""
        return np.asarray(
            np.sqrt(np.einsum("mi,ij,mj->m", directions, self.covariance, directions))
        )

    def information_of(self, rows: LengthRows) -> Array:
        """Return what a further recording with the same errors would say, (u, u)."""
        return _normal([rows], self.unknowns, self.values, self.row_information)[0]

    def accuracy(self, directions: Array) -> Array:
        """Return the standard deviations that they had before the data, (m,)."""
        return np.asarray(np.sqrt((directions**2) @ self.accuracies**2))


def calibrate(records: Sequence[LengthRows]) -> Calibration:
    """Fit the unknowns to recordings of one machine, each cable's zero free in each.

    The errors of a row are weighed by their long-run covariance, since they are alike for a while.
    Where the unknowns of a group are farther off than its accuracy says, the accuracy is widened
    (MacKay, Bayesian interpolation, Neural Computation 4, 1992).

    Raises:
        ConvergenceError: the search does not settle.
    """
    n = len(records[0].cables)
    most = np.max([np.ptp(rows.wound, axis=0) for rows in records], axis=0)
    unknowns = Unknowns(n, np.asarray(most > 0.0))
    listed = unknowns.listed
    usual = np.array([each.accuracy for each in listed])
    factors = dict.fromkeys((each.group for each in listed), _WIDE)
    values, weight = np.zeros(len(listed)), np.eye(n) / (_FIRST_M**2 * RATE)
    freedom = np.inf
    for done in range(_ROUNDS):
        accuracies = usual * np.array([factors[each.group] for each in listed])
        information, pull = _normal(records, unknowns, values, weight)
        whole = cho_factor(information + np.diag(accuracies**-2.0))
        step = cho_solve(whole, -pull - values / accuracies**2)
        covariance = cho_solve(whole, np.eye(len(values)))
        values = values + step
        moved = np.abs(step) / np.sqrt(np.diag(covariance))
        if done > _REWEIGHED and moved.max() < _SETTLED:
            return Calibration(
                unknowns, values, covariance, information, weight, accuracies, factors, freedom
            )
        if done < _REWEIGHED:
            known = 1.0 - np.diag(covariance) / accuracies**2
            factors = _factors([each.group for each in listed], values / usual, known)
            weight, freedom = _weight(records, unknowns, values, known.sum() / n)
    raise ConvergenceError(
        f"geometry: no optimum in {_ROUNDS} rounds, allowed: poses and angles of one machine"
    )


def _normal(
    records: Sequence[LengthRows], unknowns: Unknowns, values: Array, weight: Array
) -> tuple[Array, Array]:
    """Return the data's information, (u, u), and the slope of half the sum of squares, (u,)."""
    size = len(values)
    information, pull = np.zeros((size, size)), np.zeros(size)
    places = [unknowns.of_cable(i) for i in range(unknowns.n)]
    for rows in records:
        slopes = unknowns.slopes(rows, values)
        weighed = unknowns.residuals(rows, values) @ weight
        for i, here in enumerate(places):
            pull[here] += slopes[:, i].T @ weighed[:, i]
            for j, there in enumerate(places):
                block = weight[i, j] * slopes[:, i].T @ slopes[:, j]
                information[np.ix_(here, there)] += block
    return information, pull


def _weight(
    records: Sequence[LengthRows], unknowns: Unknowns, values: Array, fitted: float
) -> tuple[Array, float]:
    """Return the inverse long-run covariance of a row's errors, (n, n), and its freedom.

    Args:
        records: the recordings.
        unknowns: what is fitted.
        values: where.
        fitted: how many unknowns the data determines per cable.
    """
    parts = [unknowns.residuals(rows, values) for rows in records]
    total = sum(map(len, parts))
    length = max(block_length([part[:, i] for part in parts]) for i in range(unknowns.n))
    length = max(length, int(np.ceil(total ** (1.0 / 3.0))))
    freedom = max(total / length - fitted, 1.0)
    covariance = long_run_sum(parts, length) / total * (total / length) / freedom
    covariance *= np.where(np.eye(unknowns.n, dtype=bool), 1.0, _CORRELATED)
    covariance += _FLOOR_M**2 * RATE * np.eye(unknowns.n)
    return np.asarray(np.linalg.inv(covariance)), freedom


def _factors(groups: Sequence[str], off: Array, known: Array) -> dict[str, float]:
    """Return by how much larger each group's errors are than usual, at least 1.

    Args:
        groups: of each unknown.
        off: values in units of their usual accuracy.
        known: share of each that the data determines.
    """
    found = {}
    for group in dict.fromkeys(groups):
        of = np.array([each == group for each in groups])
        determined = float(known[of].sum())
        size = float(np.sum(off[of] ** 2)) / max(determined, 1.0)
        found[group] = max(1.0, float(np.sqrt(size)))
    return found
