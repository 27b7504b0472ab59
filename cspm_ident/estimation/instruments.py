"""Instrumental variables, for regressors that carry the noise of the target."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from cspm_ident.estimation.block_length import block_length
from cspm_ident.estimation.covariance import long_run_sum
from cspm_ident.estimation.estimate import Interval
from cspm_ident.estimation.interval import Linearisation, make_estimate
from cspm_ident.estimation.linear import Solution, exact_rounding, fit_linear
from cspm_ident.estimation.noise import (
    Noise,
    effective_samples,
    fit_noise,
    rounding_floors,
    whiten_channels,
)
from cspm_ident.estimation.parameter import Parameter, free_indices
from cspm_ident.estimation.record import Record, check_records
from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]


class Exogeneity(NamedTuple):
    """Durbin-Wu-Hausman test of whether least squares is biased on these data.

    Attributes:
        statistic: Wald's, of the part of the regressors that the instruments do not explain.
        degrees_of_freedom: of its χ² distribution where least squares is right; 0 where the
            instruments span the regressors, so that both are the same.
        p_value: small where least squares is biased.
    """

    statistic: float
    degrees_of_freedom: int
    p_value: float


class InstrumentalSolution(NamedTuple):
    """An estimate by instruments.

    Attributes:
        solution: values, intervals and residuals (with the measured regressors).
        exogeneity: whether least squares would have been biased.
        strength: per regressor, the F statistic of what the instruments say of it beyond the other
            regressors; below about 10 an instrument is weak (Staiger, Stock 1997).
    """

    solution: Solution
    exogeneity: Exogeneity
    strength: Array


def fit_instruments(
    records: Sequence[Record],
    parameters: Sequence[Parameter],
    start: Sequence[float] | None = None,
    *,
    interval: Interval = Interval.SANDWICH,
    max_order: int | None = None,
    seed: int = 0,
) -> InstrumentalSolution:
    """Estimate a linear regression by two-stage least squares.

    Regressors are replaced by what the instruments explain of them. The noise model of a first pass
    then filters regressors, instruments and target, and it is done again (refined instruments,
    Young 2011, chapter 7). Instruments must not depend on the noise, as signals that are simulated
    from the reference do not.

    Args:
        records: with instruments; columns that carry no noise are their own instruments and have to
            be among them.
        parameters: one for each column of the regressors.
        start: see `fit_linear`.
        interval: sandwich or bootstrap; the likelihood's takes the filtered residuals for white.
        max_order: of the noise model, see `fit_noise`.
        seed: of the bootstrap.

    Raises:
        InputError: records without instruments, or fewer instruments than parameters.
    """
    check_records(records, len(parameters))
    _check_instruments(records, len(parameters))
    groups = tuple(record.group for record in records)
    floors = rounding_floors([record.target for record in records], groups)
    free = free_indices(parameters)
    theta = _second_stage(records, parameters, start)
    for _ in range(_PASSES):
        residuals = [record.target - record.regressors @ theta for record in records]
        noise = fit_noise(residuals, groups, max_order, floors, len(free))
        white = [_whitened(record, noise) for record in records]
        theta = _second_stage(white, parameters, start)
    residuals = [record.target - record.regressors @ theta for record in records]
    explained = _explained(white)
    model = Linearisation(
        [record.target - record.regressors @ theta for record in white],
        [columns[:, :, free] for columns in explained],
        exact_rounding(sum(residual.size for residual in residuals)),
        effective_samples(noise, residuals, groups),
        True,
    )
    estimate = make_estimate(parameters, theta, model, interval, "instruments", seed)
    solution = Solution(estimate, residuals, groups, noise)
    return InstrumentalSolution(
        solution, _exogeneity(white, explained), _strength(white, explained)
    )


_PASSES = 2


def _check_instruments(records: Sequence[Record], columns: int) -> None:
    for record in records:
        found = 0 if record.instruments is None else record.instruments.shape[2]
        if found < columns:
            raise InputError(
                f"a record has {found} instruments for {columns} parameters; "
                "allowed: at least as many as parameters"
            )


def _whitened(record: Record, noise: Noise) -> Record:
    group = noise[record.group]
    return Record(
        whiten_channels(group, record.target),
        whiten_channels(group, record.regressors),
        record.group,
        whiten_channels(group, _instruments(record)),
    )


def _instruments(record: Record) -> Array:
    assert record.instruments is not None
    return record.instruments


def _rows(columns: Sequence[Array]) -> Array:
    return np.concatenate([part.reshape(-1, part.shape[-1]) for part in columns])


def _explained(records: Sequence[Record]) -> list[Array]:
    """Return the regressors as the instruments explain them, per record."""
    instruments = _rows([_instruments(record) for record in records])
    regressors = _rows([record.regressors for record in records])
    first = np.linalg.lstsq(instruments, regressors, rcond=None)[0]
    return [_instruments(record) @ first for record in records]


def _second_stage(
    records: Sequence[Record], parameters: Sequence[Parameter], start: Sequence[float] | None
) -> Array:
    stage = [
        Record(record.target, columns, record.group)
        for record, columns in zip(records, _explained(records), strict=True)
    ]
    return fit_linear(stage, parameters, start, whiten=False, max_order=0).estimate.values


def _exogeneity(records: Sequence[Record], explained: Sequence[Array]) -> Exogeneity:
    """Add what the instruments do not explain as further regressors; test that they do nothing."""
    regressors = _rows([record.regressors for record in records])
    left = regressors - _rows(explained)
    size = np.linalg.norm(regressors, axis=0)
    suspect = np.linalg.norm(left, axis=0) > _SAME * np.where(size > 0.0, size, 1.0)
    count = int(suspect.sum())
    if count == 0:
        return Exogeneity(0.0, 0, 1.0)
    design = np.column_stack([regressors, left[:, suspect]])
    target = np.concatenate([record.target.ravel() for record in records])
    fitted = np.linalg.lstsq(design, target, rcond=None)[0]
    parts = _scores(design, target - design @ fitted, records)
    length = max(block_length([part[:, s] for part in parts]) for s in range(design.shape[1]))
    bread = np.linalg.pinv(design.T @ design)
    covariance = (bread @ long_run_sum(parts, length) @ bread)[-count:, -count:]
    extra = fitted[-count:]
    statistic = float(extra @ np.linalg.pinv(covariance) @ extra)
    return Exogeneity(statistic, count, float(chi2.sf(statistic, count)))


_SAME = 1e-8


def _scores(design: Array, residual: Array, records: Sequence[Record]) -> list[Array]:
    ends = np.cumsum([record.target.size for record in records])[:-1]
    pieces = np.split(design * residual[:, None], ends)
    return [
        piece.reshape(*record.target.shape, -1).sum(axis=1)
        for piece, record in zip(pieces, records, strict=True)
    ]


def _strength(records: Sequence[Record], explained: Sequence[Array]) -> Array:
    """F of the first stage by Shea's partial R², as Godfrey (1999) computes it."""
    regressors = _rows([record.regressors for record in records])
    reduced = _rows(explained)
    rows, count = regressors.shape
    instruments = _instruments(records[0]).shape[2]
    whole = np.diag(np.linalg.pinv(regressors.T @ regressors))
    partial = np.diag(np.linalg.pinv(reduced.T @ reduced))
    share = np.clip(whole / np.where(partial > 0.0, partial, np.inf), 0.0, 1.0)
    with np.errstate(divide="ignore"):
        ratio = share / (1.0 - share)
    return np.asarray(ratio * (rows - instruments) / (instruments - count + 1))
