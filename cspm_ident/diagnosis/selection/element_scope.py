"""Element scope: the elements on which an effect acts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import compress

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.hypothesis import (
    Hypothesis,
    has_one_system,
    is_negligible,
    is_spread,
    is_surveyed,
)
from cspm_ident.diagnosis.regression.joint_fit import Fits
from cspm_ident.diagnosis.regression.significance import Significance
from cspm_ident.diagnosis.residuals.regressors import Candidate

Array = NDArray[np.float64]
HALF_WIDTH = 1.96
"""Standard errors of a normal deviate in half an interval of 95 %."""
Index = NDArray[np.intp]


class Scopes:
    """Candidate element scopes of one effect, wider and narrower."""

    def __init__(
        self, fits: Fits, significance: Significance, candidates: Sequence[Candidate]
    ) -> None:
        """Store the fits, the significance test and all candidates of the search."""
        self._fits, self._significance, self._candidates = fits, significance, candidates

    def of(self, candidate: Candidate, free: Sequence[Candidate], base: Index) -> list[Hypothesis]:
        """Return hypotheses of the candidate's effect over several element scopes.

        The scopes are the significant elements and all free elements. On all elements, parameters
        are common or separate: an effect too weak on each element may be significant on all.

        Args:
            candidate: the effect, its shape and its first element.
            free: candidates that may be added.
            base: columns already selected.
        """
        same_effect = [
            c for c in free if c.effect_id == candidate.effect_id and c.shape == candidate.shape
        ]
        whole = Hypothesis(candidate.effect, tuple(same_effect))
        own = self._extended(candidate, same_effect, base)
        if len(same_effect) == 1:
            return [own]
        one_system = has_one_system(own.effect)
        common = [replace(whole, common=True)] if one_system or self.agree(whole, base) else []
        wider = [whole] if len(own.candidates) < len(same_effect) else []
        # Order matters: a later hypothesis replaces an earlier one only if it explains more.
        return [*common, own, *wider] if one_system else [own, *common, *wider]

    def pruned(self, hypothesis: Hypothesis, base: Index) -> Hypothesis:
        """Return the hypothesis without elements whose 95 % intervals all contain zero.

        If the rest is spread over half of the elements or more, an element stays where its
        intervals contain the median. Nothing is removed if the removed elements are jointly
        significant beside the rest, or if the parameters are common.
        """
        if hypothesis.common:
            return hypothesis
        members = hypothesis.candidates
        each, half = self._each(hypothesis, base)
        there = np.any(np.abs(each) > half, axis=1)
        if is_surveyed(hypothesis.effect):
            there &= [not is_negligible({c: own}) for c, own in zip(members, each, strict=True)]
        if not there.any():
            return hypothesis
        kept = replace(hypothesis, candidates=tuple(compress(members, there)))
        if is_spread(kept, self._everywhere(hypothesis), self._fits.thresholds):
            there |= np.all(np.abs(each - np.median(each[there], axis=0)) <= half, axis=1)
        kept = replace(hypothesis, candidates=tuple(compress(members, there)))
        if is_surveyed(hypothesis.effect):
            return kept
        gone = replace(hypothesis, candidates=tuple(compress(members, ~there)))
        return hypothesis if gone.candidates and self._act(gone, kept, base) else kept

    def _act(self, hypothesis: Hypothesis, beside: Hypothesis, base: Index) -> bool:
        """Return whether a hypothesis is significant beside another."""
        base = self._fits.beside(base, beside)
        return self._significance.counts(base, hypothesis, self._fits.gain(hypothesis, base))

    def agree(self, hypothesis: Hypothesis, base: Index) -> bool:
        """Return whether common parameters fit all elements, and several are non-zero at 95 %."""
        each, half = self._each(hypothesis, base)
        sums, kept, own = self._fits.shared(base, hypothesis)
        same = sums.weights(np.concatenate([kept, own]))[len(kept) :]
        near = np.abs(each - same) <= self._fits.thresholds.certain_sigma / HALF_WIDTH * half
        there = np.any(np.abs(each) > half, axis=1)
        return bool(np.all(near) and np.count_nonzero(there) > 1)

    def _each(self, hypothesis: Hypothesis, base: Index) -> tuple[Array, Array]:
        """Return each element's weights and half widths of their 95 % intervals.

        Both have the shape (elements, columns).
        """
        sums, shape = self._fits.sums, (len(hypothesis.candidates), -1)
        weights = sums.weights(self._fits.beside(base, hypothesis))[len(base) :]
        half = sums.half_width(base, self._fits.own_columns(hypothesis))
        return weights.reshape(shape), half.reshape(shape)

    def _extended(
        self, candidate: Candidate, same_effect: Sequence[Candidate], base: Index
    ) -> Hypothesis:
        """Return the effect on the elements where it is significant beside those already added."""
        sums, gram, found = self._fits.sums, self._fits.gram, [candidate]
        others = [c for c in same_effect if c.element != candidate.element]
        columns = [gram.columns_of([c]) for c in others]
        for k in np.argsort(-sums.gains_beyond(base, columns)):
            beside = np.concatenate([base, gram.columns_of(found)])
            further = Hypothesis(candidate.effect, (others[k],))
            if self._significance.counts(beside, further, sums.gain(beside, columns[k])):
                found.append(others[k])
        return Hypothesis(candidate.effect, tuple(c for c in same_effect if c in found))

    def _everywhere(self, hypothesis: Hypothesis) -> Hypothesis:
        """Return the hypothesis on all elements that its effect can act on."""
        own = hypothesis.effect.id, hypothesis.candidates[0].shape
        same_effect = tuple(c for c in self._candidates if (c.effect_id, c.shape) == own)
        return replace(hypothesis, candidates=same_effect)
