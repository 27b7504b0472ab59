"""Parameters of what was named, with intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.regression.coefficients import Weights, weights_of
from cspm_ident.diagnosis.residuals.drive_torque import time_constant
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation, steady
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_model.robust_statistics import huber_fit
from cspm_sim.effects import Channel

Parts = Sequence[Sequence[Equation]]


def of_shafts(
    weights: Weights,
    parts: Parts,
    block_s: float,
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> Weights:
    """Return the weights with those of winches' effects fitted to suit their rows.

    Near a reversal a shaft may stick, which no regressor of its speed says. Rows in which it turns
    round are left out and others that stand out count less (Huber, Ann. Math. Stat. 35(1), 1964).
    Where least squares over all rows leave no weight's interval, they are taken instead: what is
    efficient, unless what is safe contradicts (Hausman, Econometrica 46(6), 1978).

    Args:
        weights: as found.
        parts: all rows, in units of their noise.
        block_s: length of the blocks [s].
        thresholds: of intervals.
    """
    found = dict(weights)
    for winch in {e.place.element for part in parts for e in part if e.turning.any()}:
        place = Place(Channel.SHAFT, winch)
        own = [c for c in weights if (c.effect.signature.regression.channel, c.element) == place]
        if not own:
            continue
        rows = [[e.only(own) for e in part if e.place == place] for part in parts]
        plain = _fitted(steady(rows), own, block_s, thresholds)
        calm = _fitted(_calmed(steady(rows), own), own, block_s, thresholds)
        # Rows that stand out are no noise: what they move is uncertain as well.
        safe = {c: (w, np.hypot(half, w - plain[c][0])) for c, (w, half) in calm.items()}
        whole = _fitted(rows, own, block_s, thresholds)
        agree = all(np.all(np.abs(whole[c][0] - safe[c][0]) <= safe[c][1]) for c in own)
        found |= whole if agree else safe
    return found


def of_drives(weights: Weights, period: float) -> Weights:
    """Return the weights with those of drives as of continuous time, by how their samples arise.

    Args:
        weights: as found.
        period: for which a command is held [s].
    """
    found = dict(weights)
    for candidate, (values, half) in weights.items():
        if candidate.effect.signature.regression.channel is Channel.DRIVE:
            low, middle, high = (
                time_constant(each, period) for each in (values - half, values, values + half)
            )
            found[candidate] = middle, np.maximum(high - middle, middle - low)
    return found


def of_clocks(weights: Weights) -> Weights:
    """Return the weights, of which no part is surer than what a sound machine may have of it.

    A delay is told against clocks that lie apart themselves (GUM, JCGM 100:2008, 4.3).

    Args:
        weights: as found.
    """
    found = dict(weights)
    for candidate, (values, half) in weights.items():
        effect = candidate.effect
        if effect.signature.negligible:
            own = np.array([effect.signature.negligible.get(p.name, 0.0) for p in effect.linear])
            found[candidate] = values, np.hypot(half, own)
    return found


def of_forms(
    weights: Weights,
    model_form_error: Mapping[Candidate, float],
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> Weights:
    """Return the weights, of which none is surer than the form of its law.

    Noise alone makes the interval of a straight line through a curve as narrow as one likes; what
    the law leaves of the curve may as well have moved the line (GUM, JCGM 100:2008, 4.3). What is
    not seen of that no law is free of; a number of the file or of a reading has no form.

    Args:
        weights: as found.
        model_form_error: of each, by what share of its amplitude the law is seen to be off.
        thresholds: `model_form_error_share`.
    """
    found, form_error = dict(weights), float(np.sqrt(thresholds.model_form_error_share))
    for candidate, (values, half) in weights.items():
        least = 0.0 if candidate.effect.is_correction else form_error
        share = max(model_form_error[candidate], least)
        found[candidate] = values, np.hypot(half, share * np.abs(values))
    return found


def of_reach(weights: Weights, parts: Parts) -> Weights:
    """Return the weights, of which none is surer than how much of it has acted.

    What saturates and has not been seen to is told beyond what acted by the form of its law alone,
    and others rise as far and end elsewhere: as much as is missing may be wrong (GUM, JCGM
    100:2008, 4.3).

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
    """Return half of the range of a saturating candidate's column, whatever it started from."""
    rows = (e.columns[candidate][:, 0, 0] for part in parts for e in part if candidate in e.columns)
    return max((min(1.0, 0.5 * float(np.ptp(own))) for own in rows if len(own)), default=0.0)


def _fitted(
    parts: Parts, candidates: Sequence[Candidate], block_s: float, thresholds: Thresholds
) -> Weights:
    gram = gather(parts, block_s)
    return weights_of(gram, BlockRegression(gram, thresholds), candidates)


def _calmed(parts: Parts, candidates: Sequence[Candidate]) -> Parts:
    """Return rows scaled so that least squares are Huber's estimate."""
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


# Of the scale: what lies farther counts less.
_HUBER = 3.0
# Of reweighting.
_ROUNDS = 20
