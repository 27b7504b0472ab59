"""Parameters of the findings, with intervals."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.regression.coefficients import Weights, weights_of
from cspm_ident.diagnosis.regression.hypothesis import is_timing
from cspm_ident.diagnosis.residuals.drive_torque import time_constant
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation, steady
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_model.robust_statistics import huber_fit
from cspm_sim.effects import Channel

Array = NDArray[np.float64]
Parts = Sequence[Sequence[Equation]]


def of_shafts(
    weights: Weights,
    parts: Parts,
    block_s: float,
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> Weights:
    """Return the weights with those of winch effects fitted robustly, where needed.

    Near a reversal a shaft may stick, which no regressor of its speed describes. So rows with a
    reversal are left out, and outliers count less (Huber, Ann. Math. Stat. 35(1), 1964). Where
    least squares over all rows agree within every interval, they are used instead. That is, the
    efficient estimate holds unless the robust one contradicts it (Hausman, Econometrica 46(6),
    1978).

    Args:
        weights: as found.
        parts: all rows, in units of their noise.
        block_s: length of the blocks [s].
        thresholds: of intervals.
    """
    found = dict(weights)
    turning = {e.place for part in parts for e in part if e.turning.any()}
    for place in (each for each in turning if each.channel is Channel.SHAFT):
        own = [c for c in weights if (c.effect.signature.regression.channel, c.element) == place]
        if not own:
            continue
        rows = [[e.only(own) for e in part if e.place == place] for part in parts]
        plain = _fitted(steady(rows), own, block_s, thresholds)
        calm = _fitted(_calmed(steady(rows), own), own, block_s, thresholds)
        # Outliers are not noise: the shift they cause adds to the uncertainty.
        safe = {c: (w, np.hypot(half, w - plain[c][0])) for c, (w, half) in calm.items()}
        whole = _fitted(rows, own, block_s, thresholds)
        agree = all(np.all(np.abs(whole[c][0] - safe[c][0]) <= safe[c][1]) for c in own)
        found |= {} if agree else safe
    return found


def of_drives(weights: Weights, period: float) -> Weights:
    """Return the weights with those of drives converted from sampled to continuous time.

    Args:
        weights: as found.
        period: hold time of a command [s].
    """
    found = dict(weights)
    for candidate, (values, half) in weights.items():
        if candidate.effect.signature.regression.channel is Channel.DRIVE:
            low, middle, high = (
                time_constant(each, period) for each in (values - half, values, values + half)
            )
            found[candidate] = middle, np.maximum(high - middle, middle - low)
    return found


def of_scales(weights: Weights, places: Container[Place]) -> Weights:
    """Return the weights with gains of torque exact, not only for small ones.

    A gain g multiplies the torque M that the model needs by 1/g, so that the column of −M fits
    1 − 1/g where the effect's weight is g − 1.

    Args:
        weights: as found.
        places: residuals that were searched. Without that of the shaft, torques enter a virtual
            load cell, whose column is linear in the gain.
    """
    found = dict(weights)
    for candidate, (values, half) in weights.items():
        signature = candidate.effect.signature
        channel = signature.regression.channel
        at_shaft = channel is Channel.SHAFT and Place(channel, candidate.element) in places
        if signature.rescales and at_shaft and np.all(values + half < 1.0):
            found[candidate] = values / (1.0 - values), half / (1.0 - values) ** 2
    return found


def of_clocks(weights: Weights) -> Weights:
    """Return the weights, with intervals at least as wide as a healthy machine's range.

    A delay is measured against clocks that have offsets themselves (GUM, JCGM 100:2008, 4.3).

    Args:
        weights: as found.
    """
    found = dict(weights)
    for candidate, (values, half) in weights.items():
        effect = candidate.effect
        if effect.signature.negligible and is_timing(effect):
            limits = effect.signature.negligible
            own = np.array([limits.get(p.name, (0.0, 0.0))[1] for p in effect.linear])
            found[candidate] = values, np.hypot(half, own)
    return found


def of_forms(
    weights: Weights,
    moved: Mapping[Candidate, Array],
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> Weights:
    """Return the weights, with intervals that include the model-form error.

    With noise alone, the interval of a straight line fitted to a curve becomes arbitrarily narrow.
    What the law misses of the curve may have moved the line as well (GUM, JCGM 100:2008, 4.3).
    Every law is given a least model-form error; corrections of the file or of readings have none.

    Args:
        weights: as found.
        moved: how far free functions may move them; see `moved_by_functions`.
        thresholds: `model_form_error_share`.
    """
    found, form_error = dict(weights), float(np.sqrt(thresholds.model_form_error_share))
    for candidate, (values, half) in weights.items():
        least = 0.0 if candidate.effect.is_correction else form_error
        wider = np.maximum(moved[candidate], least * np.abs(values))
        found[candidate] = values, np.hypot(half, wider)
    return found


def of_reach(weights: Weights, parts: Parts) -> Weights:
    """Return the weights, with intervals that include the unobserved part of a saturation.

    A saturating effect that was not observed to saturate is extrapolated by its law alone. Other
    laws have the same rise and a different limit. So the missing share of the range counts as
    uncertainty (GUM, JCGM 100:2008, 4.3).

    Args:
        weights: as found.
        parts: all rows, in the residuals' units.
    """
    found = dict(weights)
    for candidate, (values, half) in weights.items():
        if candidate.effect.signature.saturates:
            missing = 1.0 - _reach(candidate, parts)
            found[candidate] = values, np.hypot(half, missing * np.abs(values))
    return found


def _reach(candidate: Candidate, parts: Parts) -> float:
    """Return half the range of a saturating candidate's regressor, at most 1; 0 without rows.

    Unlike the largest value, the range is independent of where the regressor starts.
    """
    rows = (e.columns[candidate][:, 0, 0] for part in parts for e in part if candidate in e.columns)
    return max((min(1.0, 0.5 * float(np.ptp(own))) for own in rows if len(own)), default=0.0)


def _fitted(
    parts: Parts, candidates: Sequence[Candidate], block_s: float, thresholds: Thresholds
) -> Weights:
    gram = gather(parts, block_s)
    return weights_of(gram, BlockRegression(gram, thresholds), candidates)


def _calmed(parts: Parts, candidates: Sequence[Candidate]) -> Parts:
    """Return rows scaled so that least squares give Huber's estimate."""
    target = np.concatenate([e.target[:, 0] for part in parts for e in part])
    columns = np.concatenate(
        [
            np.concatenate([e.columns[c][:, 0] for c in candidates], axis=1)
            for part in parts
            for e in part
        ]
    )
    _, counts = huber_fit(columns, target, _HUBER, _ROUNDS)
    edges = np.cumsum([len(e.times) for part in parts for e in part])[:-1]
    roots = iter(np.split(np.sqrt(counts), edges))
    return [[e.weighted(next(roots)) for e in part] for part in parts]


# Residuals beyond this multiple of the scale count less.
_HUBER = 3.0
# Number of reweighting rounds.
_ROUNDS = 20
