"""From a whitened linearisation at the optimum to intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from cspm_ident.estimation.block_length import block_length
from cspm_ident.estimation.bootstrap import bootstrap_covariance
from cspm_ident.estimation.covariance import long_run_sum
from cspm_ident.estimation.estimate import Estimate, Interval, without_unknown
from cspm_ident.estimation.identifiability import Excitation, find_excitation
from cspm_ident.estimation.parameter import Parameter, free_indices, prior_rows, scales

Array = NDArray[np.float64]


class Linearisation(NamedTuple):
    """A model about its optimum, in coordinates in which the noise is N(0, 1).

    Attributes:
        residuals: y − model, per record, shape (n, channels).
        jacobians: of the model or of the residuals, by the free parameters, per record, shape
            (n, channels, free).
        rounding: relative error of the Jacobians.
        effective_samples: the number of independent samples that the residuals amount to.
        white: whether their colour was taken out; else only their size.
    """

    residuals: Sequence[Array]
    jacobians: Sequence[Array]
    rounding: float
    effective_samples: float
    white: bool


class Spread(NamedTuple):
    """Covariance of the free parameters, in scales, and the t distribution's freedom."""

    covariance: Array
    degrees_of_freedom: float


def make_estimate(
    parameters: Sequence[Parameter],
    values: Array,
    model: Linearisation,
    interval: Interval,
    method: str,
    seed: int,
) -> Estimate:
    """Return values with their intervals.

    Args:
        parameters: all of them.
        values: the optimum, shape (parameters,).
        model: the linearisation in the free parameters.
        interval: how the covariance is made.
        method: how the values were made, in words.
        seed: of the bootstrap.
    """
    free = free_indices(parameters)
    chosen = [parameters[i] for i in free]
    stacked = np.concatenate([j.reshape(-1, len(free)) for j in model.jacobians])
    inflation = 1.0 if model.white else _inflation(model)
    excitation = find_excitation(stacked, chosen, model.rounding, inflation)
    spread = _spread(model, excitation, chosen, interval, seed)
    found = _assemble(parameters, values, excitation, spread, model, f"{method}, {interval.value}")
    return without_unknown(found, parameters)


def _inflation(model: Linearisation) -> float:
    """Samples per independent sample."""
    return sum(residual.size for residual in model.residuals) / max(model.effective_samples, 1.0)


def _spread(
    model: Linearisation,
    excitation: Excitation,
    chosen: Sequence[Parameter],
    interval: Interval,
    seed: int,
) -> Spread:
    basis = excitation.basis
    if basis.shape[1] == 0:
        return Spread(excitation.rest, 1.0)
    projection = scales(chosen)[:, None] * basis
    projected = [jacobian @ projection for jacobian in model.jacobians]
    prior = _prior_information(chosen, basis)
    freedom = max(model.effective_samples - len(chosen), 1.0)
    if interval is Interval.LIKELIHOOD:
        information = sum(np.einsum("ncs,nct->st", j, j) for j in projected)
        covariance = np.linalg.inv(information + prior)
    else:
        covariance, blocks = _robust(projected, model, prior, interval, seed)
        freedom = max(min(freedom, blocks - basis.shape[1]), 1.0)
    return Spread(basis @ covariance @ basis.T + excitation.rest, freedom)


def _robust(
    projected: Sequence[Array],
    model: Linearisation,
    prior: Array,
    interval: Interval,
    seed: int,
) -> tuple[Array, float]:
    """Covariance that assumes no noise model, and the number of blocks it rests on."""
    parts = [
        np.einsum("nc,ncs->ns", residual, jacobian)
        for residual, jacobian in zip(model.residuals, projected, strict=True)
    ]
    total = sum(map(len, parts))
    columns = range(parts[0].shape[1])
    # Never shorter than the rate at which blocks must grow, n^(1/3) (Künsch 1989).
    least = int(np.ceil(total ** (1.0 / 3.0)))
    length = max(least, *(block_length([part[:, s] for part in parts]) for s in columns))
    information = sum(np.einsum("ncs,nct->st", j, j) for j in projected) + prior
    if interval is Interval.BOOTSTRAP:
        return bootstrap_covariance(parts, information, prior, length, seed), total / length
    bread = np.linalg.inv(information)
    return bread @ (long_run_sum(parts, length) + prior) @ bread, total / length


def _prior_information(chosen: Sequence[Parameter], basis: Array) -> Array:
    where, _, sd = prior_rows(chosen)
    rows = (scales(chosen)[:, None] * basis)[where] / sd[:, None]
    return np.asarray(rows.T @ rows)


def _assemble(
    parameters: Sequence[Parameter],
    values: Array,
    excitation: Excitation,
    spread: Spread,
    model: Linearisation,
    method: str,
) -> Estimate:
    free, size = free_indices(parameters), scales(parameters)
    variance = np.zeros(len(parameters))
    variance[free] = np.where(excitation.unknown, np.inf, np.diag(spread.covariance))
    sd = np.sqrt(variance) * size
    half = float(student.ppf(0.975, spread.degrees_of_freedom)) * sd
    ends = np.stack([values - half, values + half], axis=1)
    frozen = tuple(p.name for p in parameters if p.frozen)
    ends[[p.frozen for p in parameters]] = np.nan
    return Estimate(
        names=tuple(p.name for p in parameters),
        units=tuple(p.unit for p in parameters),
        values=values,
        sd=sd,
        ci95=ends,
        correlation=_correlation(spread.covariance, free, variance),
        frozen=frozen,
        at_bound=tuple(_held(parameters, values)),
        unexcited=excitation.directions,
        effective_samples=model.effective_samples,
        degrees_of_freedom=spread.degrees_of_freedom,
        method=method,
    )


def _correlation(covariance: Array, free: NDArray[np.intp], variance: Array) -> Array:
    whole = np.full((len(variance), len(variance)), np.nan)
    whole[np.ix_(free, free)] = covariance
    size = np.sqrt(np.where(np.isfinite(variance) & (variance > 0.0), variance, np.nan))
    return np.asarray(whole / np.outer(size, size))


def _held(parameters: Sequence[Parameter], values: Array) -> list[str]:
    near = [1e-6 * p.scale for p in parameters]
    return [
        p.name
        for p, value, close in zip(parameters, values, near, strict=True)
        if not p.frozen and (value - p.lower <= close or p.upper - value <= close)
    ]
