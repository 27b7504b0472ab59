"""Alternatives: hypotheses that explain nearly as much as a selected one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from cspm_ident.diagnosis.regression.collinearity import (
    contains,
    distance,
    freely_gained,
)
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, Rival
from cspm_ident.diagnosis.regression.joint_fit import Fits
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.selection.masked_by_parameter import absorbed_pairs
from cspm_ident.diagnosis.selection.rivals import rivals_of


def alternatives_of(
    fits: Fits,
    candidates: Sequence[Candidate],
    hypothesis: Hypothesis,
    others: Sequence[Hypothesis],
) -> Iterator[Rival]:
    """Yield hypotheses that explain the same nearly as well as a selected one, in its place.

    What separates two hypotheses is the difference of what they leave, block by block, and not how
    large it is in all: a few blocks may hold half of a gain by chance. A difference within the
    model-form error does not separate them. Each further parameter counts as in Schwarz's
    criterion, with blocks as observations.

    Args:
        fits: of all columns.
        candidates: all candidates of the search.
        hypothesis: the selected hypothesis to replace.
        others: all other selected hypotheses.
    """
    taken = {(c.effect_id, c.element) for h in others for c in h.candidates}
    free = [c for c in candidates if (c.effect_id, c.element) not in taken]
    sums, base, own = fits.sums, fits.columns(others), fits.own_columns(hypothesis)
    reference = fits.held_out(hypothesis, base)
    gained = float(np.sum(sums.held_out(base) - reference))
    free_gain = freely_gained(fits.gram, sums, base, own)
    limits = fits.thresholds
    undecided = max(limits.model_form_error_share * gained, free_gain)
    for rival, *beside in _rivals(fits, free, hypothesis, others):
        assumed = [rival, *beside]
        columns = fits.gram.columns_of(c for h in assumed for c in h.candidates)
        wider = max(0.0, sum(map(fits.freedom, assumed)) - fits.freedom(hypothesis))
        nested = wider and not beside and contains(sums, base, columns, own)
        if nested or not fits.is_plausible([*others, *assumed], loosely=True):
            continue
        late = fits.delayed_columns(np.setdiff1d(columns, own), hypothesis.onset)
        worse = late.held_out(rival, fits.beside(base, *beside)) - reference
        if worse.sum() >= gained:
            continue
        apart = distance(worse, undecided, wider, limits)
        if apart <= limits.tie_sigma:
            yield Rival(rival, apart, *beside)


def _rivals(
    fits: Fits,
    free: Sequence[Candidate],
    hypothesis: Hypothesis,
    others: Sequence[Hypothesis],
) -> Iterator[tuple[Hypothesis, ...]]:
    """Yield rivals, alone or with a wrong parameter of the test-bed file that masks them.

    Pairs masked by a parameter are searched for the hypothesis and for its rivals on the same
    elements, because rivals are collinear with it.
    """
    given, base = (fits.gram, fits.sums), fits.columns(others)
    rivals = rivals_of(*given, base, hypothesis, free)
    yield from ((rival,) for rival in rivals)
    alone = {hypothesis.effect.id, *(rival.effect.id for rival in rivals)}
    collinear = [hypothesis, *(r for r in rivals if r.elements == hypothesis.elements)]
    pairs: dict[tuple[str, str], tuple[Hypothesis, Hypothesis]] = {}
    for like in collinear:
        for effect, number in absorbed_pairs(*given, base, like, free):
            pairs.setdefault((effect.effect.id, number.effect.id), (effect, number))
    yield from (pair for (effect_id, _), pair in pairs.items() if effect_id not in alone)
