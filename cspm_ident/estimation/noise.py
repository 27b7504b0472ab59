"""The noise of groups of channels, and the map that makes it white."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from cspm_ident.estimation.autoregression import Autoregression, fit_autoregression, whiten
from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]


class GroupNoise(NamedTuple):
    """Noise of the channels that are sampled together.

    Attributes:
        channels: the colour of each.
        mixing: lower triangular factor of the correlation of their innovations, (m, m).
    """

    channels: tuple[Autoregression, ...]
    mixing: Array


Noise = Mapping[str, GroupNoise]


def unit_noise(residuals: Sequence[Array], groups: Sequence[str]) -> Noise:
    """Return white noise of variance 1 in all channels, none correlated with another.

    Args:
        residuals: per record, shape (n, channels).
        groups: the group of each record.
    """
    white = Autoregression(np.zeros(0), 1.0)
    widths = {group: part.shape[1] for part, group in zip(residuals, groups, strict=True)}
    return {group: GroupNoise((white,) * m, np.eye(m)) for group, m in widths.items()}


def fit_noise(
    residuals: Sequence[Array],
    groups: Sequence[str],
    max_order: int | None,
    floors: Mapping[str, float],
    parameters: int = 0,
) -> Noise:
    """Return the noise model of each group.

    Args:
        residuals: per record, shape (n, channels).
        groups: the group of each record.
        max_order: largest autoregressive order; None takes 10·log10 of the samples, at most a third
            of the longest record; 0 takes the noise for white.
        floors: per group, the standard deviation below which a residual is rounding.
        parameters: how many were fitted; the variance is divided by the samples less these.

    Raises:
        InputError: records of one group have different numbers of channels.
    """
    return {
        group: _fit_group(
            [r for r, g in zip(residuals, groups, strict=True) if g == group],
            group,
            max_order,
            floors[group],
            parameters,
        )
        for group in dict.fromkeys(groups)
    }


def _fit_group(
    residuals: Sequence[Array], group: str, max_order: int | None, floor: float, parameters: int
) -> GroupNoise:
    if len({residual.shape[1] for residual in residuals}) > 1:
        raise InputError(
            f"group {group!r} has records of different numbers of channels; allowed: one number"
        )
    total = sum(map(len, residuals))
    order = default_order(residuals) if max_order is None else max_order
    channels = [
        fit_autoregression([residual[:, c] for residual in residuals], order, floor)
        for c in range(residuals[0].shape[1])
    ]
    correction = total / max(total - parameters, 1)
    channels = [model._replace(variance=model.variance * correction) for model in channels]
    single = GroupNoise(tuple(channels), np.eye(len(channels)))
    white = np.concatenate([whiten_channels(single, residual) for residual in residuals])
    return single._replace(mixing=_factor_of_correlation(white))


def default_order(residuals: Sequence[Array]) -> int:
    """Return the largest order that the records can carry."""
    total = sum(map(len, residuals))
    return max(0, min(int(10.0 * np.log10(max(total, 1))), max(map(len, residuals)) // 3))


def _factor_of_correlation(white: Array) -> Array:
    covariance = white.T @ white
    size = np.sqrt(np.diag(covariance))
    size[size == 0.0] = 1.0
    correlation = covariance / np.outer(size, size)
    # Channels that repeat each other count once instead of with unbounded weight.
    correlation[~np.eye(len(size), dtype=bool)] *= _MOST_CORRELATED
    np.fill_diagonal(correlation, 1.0)
    return np.linalg.cholesky(correlation)


_MOST_CORRELATED = 0.999


def whiten_channels(noise: GroupNoise, values: Array) -> Array:
    """Return values, shape (n, channels, …), in coordinates in which the noise is N(0, 1)."""
    separate = np.stack(
        [whiten(model, values[:, c]) for c, model in enumerate(noise.channels)], axis=1
    )
    if len(noise.channels) == 1:
        return separate
    flat = separate.swapaxes(0, 1).reshape(separate.shape[1], -1)
    mixed = solve_triangular(noise.mixing, flat, lower=True)
    shape = (separate.shape[1], separate.shape[0], *separate.shape[2:])
    return np.asarray(mixed.reshape(shape).swapaxes(0, 1))


def effective_samples(noise: Noise, residuals: Sequence[Array], groups: Sequence[str]) -> float:
    """Return how many independent samples say as much about a constant, over all channels."""
    return sum(
        len(residual) * model.effective_share
        for residual, group in zip(residuals, groups, strict=True)
        for model in noise[group].channels
    )


def rounding_floors(values: Sequence[Array], groups: Sequence[str]) -> dict[str, float]:
    """Return for each group the standard deviation that rounding alone may leave."""
    largest: dict[str, float] = {}
    for value, group in zip(values, groups, strict=True):
        largest[group] = max(largest.get(group, 0.0), float(np.abs(value).max()))
    return {group: _EPSILON * (size or 1.0) for group, size in largest.items()}


_EPSILON = float(np.finfo(float).eps)
