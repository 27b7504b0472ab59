"""Six functions that may describe how the stiffness depends on the tension, ranked.

The thesis compares six and names one, (3-5); the other five are customary forms of stiffening.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from cspm_ident.rig.branches import Branch, mean_branches
from cspm_ident.rig.flanks import Ramps
from cspm_ident.rig.law import Law
from cspm_ident.vaf import vaf

Array = NDArray[np.float64]


class Form(NamedTuple):
    """A function of tension and parameters that are of the order of 1.

    Both tension and stiffness are in shares of the specimen's largest.
    """

    name: str
    formula: str
    function: Callable[[Array, Array], Array]
    starts: tuple[tuple[float, ...], ...]


class Rank(NamedTuple):
    """How well a form predicts cycles that it was not fitted to.

    Attributes:
        name: of the form.
        formula: of the form.
        parameters: how many it has for each specimen, without the asymptote.
        vaf: by specimen [%].
    """

    name: str
    formula: str
    parameters: int
    vaf: tuple[float, ...]

    @property
    def mean(self) -> float:
        """Mean VAF over the specimens [%]."""
        return float(np.mean(self.vaf))


FORMS = (
    Form("linear", "p1 + p2 t", lambda t, p: p[0] + p[1] * t, ((0.1, 1.0),)),
    Form(
        "quadratic",
        "p1 + p2 t + p3 t²",
        lambda t, p: p[0] + p[1] * t + p[2] * t**2,
        ((0.0, 2.0, -1.0),),
    ),
    Form("power", "p1 t^p2", lambda t, p: p[0] * t ** abs(p[1]), ((1.0, 0.5),)),
    Form(
        "logarithm",
        "p1 ln(1 + t/p2)",
        lambda t, p: p[0] * np.log1p(t / (abs(p[1]) + 1e-9)),
        ((0.5, 0.2), (1.0, 1.0)),
    ),
    Form(
        "hyperbola",
        "p1 t/(p2 + t)",
        lambda t, p: p[0] * t / (abs(p[1]) + t + 1e-12),
        ((1.2, 0.2), (2.0, 1.0)),
    ),
    Form(
        "two exponentials (3-5)",
        "p1 e^(p2 t) + p3 e^(p4 t)",
        lambda t, p: (
            p[0] * np.exp(np.minimum(p[1] * t, 50.0)) + p[2] * np.exp(np.minimum(p[3] * t, 50.0))
        ),
        ((1.0, 0.1, -1.0, -3.0), (1.0, 0.1, -1.0, -10.0), (1.0, 0.5, -1.0, -30.0)),
    ),
)


def rank_candidates(ramps: Sequence[Ramps], law: Law) -> list[Rank]:
    """Return the forms, best first, by the VAF of cycles that they were not fitted to.

    Every form is fitted to each specimen alone, to the even cycles and judged by the odd ones, and
    the other way round; each may stop at an asymptote of its own, as (3-10) does.

    Args:
        ramps: the specimens.
        law: the fitted law, for the elongation at the lowest tension.
    """
    folds = [
        [mean_branches(one, law, range(odd, one.cycles, 2)) for odd in (0, 1)] for one in ramps
    ]
    ranks = []
    for form in FORMS:
        scores = [0.5 * (_score(form, even, odd) + _score(form, odd, even)) for even, odd in folds]
        ranks.append(Rank(form.name, form.formula, len(form.starts[0]), tuple(scores)))
    return sorted(ranks, key=lambda rank: -rank.mean)


def _score(form: Form, fitted: Sequence[Branch], judged: Sequence[Branch]) -> float:
    tension, stiffness = _joined(fitted)
    strongest, stiffest = float(tension.max()), float(stiffness.max())
    known, scaled = tension / strongest, stiffness / stiffest

    def residual(p: Array) -> Array:
        return np.asarray(np.minimum(form.function(known, p[1:]), p[0]) - scaled)

    tried = [least_squares(residual, (1.0, *start), x_scale="jac") for start in form.starts]
    best = min(tried, key=lambda found: float(found.cost)).x
    tension, stiffness = _joined(judged)
    modelled = np.minimum(form.function(tension / strongest, best[1:]), best[0])
    return vaf(stiffness, stiffest * modelled)


def _joined(branches: Sequence[Branch]) -> tuple[Array, Array]:
    return (
        np.concatenate([branch.tension for branch in branches]),
        np.concatenate([branch.stiffness for branch in branches]),
    )
