"""Upper limit of an effect's total size, over time constants other than the best-fitting one.

The catalogue has one time constant where a machine may have many: a rope creeps with all time
constants from milliseconds to days. A recording identifies those near its own periods and takes
slower ones for a part of them (Ferry, Viscoelastic Properties of Polymers, 3rd ed., 1980, ch. 3).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_comparison import behind, paired
from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_sim.effects import Effect

Array = NDArray[np.float64]
Index = NDArray[np.intp]


class _Form(NamedTuple):
    """Two parts of an effect, fitted together.

    Attributes:
        left: hold-out Σ residual² of each block, (blocks,).
        total: sum of the parts' weights.
        half: half the width of its 95 % interval.
    """

    left: Array
    total: float
    half: float


def covered_within(effect: Effect, longest: float) -> Effect:
    """Return the effect with only those time constants that the recording covers.

    Slower relaxations grow as the integral of the tension, as does slip. A rope that slips on its
    drum would be reported as one with unlimited creep.

    Args:
        effect: of the catalogue.
        longest: duration of the recording [s].
    """
    name = effect.signature.spectrum
    if not name:
        return effect
    grid = tuple(value for value in effect.signature.nonlinear[name] if value <= longest)
    parameters = tuple(
        replace(p, maximum=max(longest, p.minimum)) if p.name == name else p
        for p in effect.parameters
    )
    grids = effect.signature.nonlinear
    return replace(
        effect.with_grid({**grids, name: grid or grids[name][:1]}), parameters=parameters
    )


def with_spectrum(effect: Effect, shape: Mapping[str, float], longest: float) -> Effect:
    """Return the effect with a shape and a spectrum grid of twice the resolution.

    Args:
        effect: of the catalogue.
        shape: nonlinear parameters that were found.
        longest: time constant that the recording can show [s].
    """
    grid = {name: {value} for name, value in shape.items()}
    if effect.signature.spectrum:
        coarse = np.array(effect.signature.nonlinear[effect.signature.spectrum])
        fine = np.append(coarse, np.sqrt(coarse[1:] * coarse[:-1]))
        grid[effect.signature.spectrum] |= set(fine[fine <= longest].tolist())
    return effect.with_grid({name: tuple(sorted(own)) for name, own in grid.items()})


def most_in_all(
    gram: BlockGram,
    candidate: Candidate,
    others: Sequence[Candidate],
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> Array | None:
    """Return the upper limit of the sum of two parts, over all pairs that fit as well as the best.

    It is the upper end of the 95 % interval of the first regressor's weight, and −∞ for those
    beside it, shape (m,). None where every pair has a part with a negative weight.

    Args:
        gram: of columns about what was found, with the effect's spectrum.
        candidate: the part that was found.
        others: the other findings' candidates.
        thresholds: `tie_sigma`, and those of intervals.
    """
    sums, base = BlockRegression(gram, thresholds), gram.with_nuisance(others)
    parts = [gram.columns_of([c]) for c in _spectrum(gram, candidate)]
    fitted = (_form(sums, base, *pair) for pair in combinations(parts, 2))
    forms = [form for form in fitted if form is not None]
    left = sums.held_out(np.concatenate([base, gram.columns_of([candidate])]))
    best = min([left, *(form.left for form in forms)], key=np.sum)
    most = thresholds.tie_sigma
    tied = [form for form in forms if behind(paired(form.left - best)) <= most]
    if not tied:
        return None
    ends = np.full(len(parts[0]), -np.inf)
    ends[0] = max(form.total + form.half for form in tied)
    return ends


def _form(sums: BlockRegression, base: Index, one: Index, other: Index) -> _Form | None:
    """Return two parts fitted beside a base; None where the first weight of one is negative."""
    base, parts = np.concatenate([base, one[1:], other[1:]]), np.array([one[0], other[0]])
    both = np.concatenate([base, parts])
    weights = sums.weights(both)[len(base) :]
    if np.any(weights < 0.0):
        return None
    # As differences from the last part, whose weight is then the sum's.
    turn = np.eye(len(parts))
    turn[-1, :-1] = -1.0
    turned, beside, own = sums.combined(base, parts, turn)
    half = turned.half_width(beside, own)
    return _Form(sums.held_out(both), float(weights.sum()), float(half[-1]))


def _spectrum(gram: BlockGram, candidate: Candidate) -> list[Candidate]:
    """Return the candidates of one effect on one element, of all available shapes."""
    own = candidate.effect_id, candidate.element
    candidates = (term for term in gram.terms if isinstance(term, Candidate))
    return [c for c in candidates if (c.effect_id, c.element) == own]
