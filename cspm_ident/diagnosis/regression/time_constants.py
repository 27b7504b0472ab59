"""How much of an effect there may be in all, at other time constants than the one that fits best.

What is one number in the catalogue may be many in a machine: a rope creeps with all time constants
from milliseconds to days. A recording shows those near its periods, and takes what is slower for a
part of them (Ferry, Viscoelastic Properties of Polymers, 3rd ed., 1980, ch. 3).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.regression.block_regression import BlockRegression, behind, paired
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_sim.effects import Effect

Array = NDArray[np.float64]
Index = NDArray[np.intp]


class _Form(NamedTuple):
    """Two parts of an effect, fitted.

    Attributes:
        left: Σ residual² of each block that was not fitted, (blocks,).
        total: sum of the parts' weights.
        half: half the width of its 95 % interval.
    """

    left: Array
    total: float
    half: float


def told_within(effect: Effect, longest: float) -> Effect:
    """Return the effect with the time constants alone of which a recording shows the end.

    What takes longer grows as the tension's integral does, and so does all that gives way: a rope
    that slips on its drum would be told as one that creeps for ever.

    Args:
        effect: of the catalogue.
        longest: what the recording lasts [s].
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
    """Return the effect with a shape and, twice as fine as its grid, other values of its spectrum.

    Args:
        effect: of the catalogue.
        shape: that was found.
        longest: what the recording can show [s].
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
    """Return how large the sum of two parts may be, of all pairs that explain as well as the best.

    As the upper end of 95 % intervals of the weight of the columns, shape (1,). None where all
    pairs have a part that is less than nothing.

    Args:
        gram: of columns about what was found, with the effect's spectrum.
        candidate: the part that was found.
        others: what else was.
        thresholds: `tie_sigma`, and those of intervals.
    """
    sums, base = BlockRegression(gram, thresholds), gram.with_nuisance(others)
    parts = [gram.columns_of([c]) for c in _spectrum(gram, candidate)]
    fitted = (_form(sums, base, np.concatenate(pair)) for pair in combinations(parts, 2))
    forms = [form for form in fitted if form is not None]
    left = sums.held_out(np.concatenate([base, gram.columns_of([candidate])]))
    best = min([left, *(form.left for form in forms)], key=np.sum)
    most = thresholds.tie_sigma
    alike = [form for form in forms if behind(paired(form.left - best)) <= most]
    return np.array([max(form.total + form.half for form in alike)]) if alike else None


def _form(sums: BlockRegression, base: Index, parts: Index) -> _Form | None:
    """Return the parts fitted beside a base; None where one of them is negative."""
    both = np.concatenate([base, parts])
    weights = sums.weights(both)[len(base) :]
    if np.any(weights < 0.0):
        return None
    # As differences from the last, whose weight is then that of the sum.
    turn = np.eye(len(parts))
    turn[-1, :-1] = -1.0
    turned, beside, own = sums.combined(base, parts, turn)
    half = turned.half_width(beside, own)
    return _Form(sums.held_out(both), float(weights.sum()), float(half[-1]))


def _spectrum(gram: BlockGram, candidate: Candidate) -> list[Candidate]:
    """Return the candidates of one effect on one element, of all shapes that there are."""
    own = candidate.effect_id, candidate.element
    candidates = (term for term in gram.terms if isinstance(term, Candidate))
    return [c for c in candidates if (c.effect_id, c.element) == own]
