"""A survey's errors on held-out data: they are known no better than the search found them.

The search leaves their values uncertain, most where its part of the motion differs from the one
that is held out. Held-out data may therefore move them, as far as they stay within the survey's
accuracy. Without that, what they are uncertain by would count as something unmodelled.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.hypothesis import is_negligible, is_surveyed
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_sim.effects import Channel, Effect

Array = NDArray[np.float64]


def surveyed_in(weights: Mapping[Candidate, Array]) -> tuple[Effect, ...]:
    """Return the effects of surveyed places among a model's weights."""
    return tuple({c.effect_id: c.effect for c in weights if is_surveyed(c.effect)}.values())


def recalibrated(equation: Equation, weights: Mapping[Candidate, Array]) -> Equation:
    """Return a cable's residual less what it shows of its own ends beyond the model's calibration.

    Least squares with the survey's accuracy as prior (ridge regression), beside the nuisance. The
    residual stays as it is where the places would then be off by more than a survey is.

    Args:
        equation: in units of its noise, about the calibrated machine, with columns of its ends.
        weights: of the model, by candidate.
    """
    own = [c for c in equation.columns if isinstance(c, Candidate) and c in weights]
    own = [c for c in own if is_surveyed(c.effect) and is_negligible({c: weights[c]})]
    if equation.place.channel is not Channel.TENSION or not own:
        return equation
    columns = np.concatenate([equation.columns[c][:, 0] for c in own], axis=1).astype(float)
    moved = _fitted(equation, columns, own)
    parts = np.split(moved, np.cumsum([len(weights[c]) for c in own])[:-1])
    further = dict(zip(own, parts, strict=True))
    if not is_negligible({c: weights[c] + by for c, by in further.items()}):
        return equation
    return equation.less(further)


def _fitted(equation: Equation, columns: Array, own: list[Candidate]) -> Array:
    """Return by how much the places of candidates `own` are moved, (m,) [m, rad]."""
    free = equation.nuisance[:, 0] if equation.nuisance.size else np.zeros((len(columns), 0))
    accuracies = np.array([p.usual for c in own for p in c.effect.linear], dtype=float)
    both = np.hstack([columns * accuracies, free])
    prior = np.eye(len(accuracies), both.shape[1])
    target = np.append(equation.target[:, 0], np.zeros(len(prior)))
    found = np.linalg.lstsq(np.vstack([both, prior]), target, rcond=None)[0]
    return np.asarray(accuracies * found[: len(accuracies)])
