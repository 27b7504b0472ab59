"""Joint fits of hypotheses to the residuals."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.regression.coefficients import Weights, values_of, weights_of
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, is_negligible, parts_of
from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.thresholds import Thresholds

Array = NDArray[np.float64]
Index = NDArray[np.intp]


class Fits:
    """Block Gram matrices with their regression, addressed by hypotheses."""

    def __init__(self, gram: BlockGram, sums: BlockRegression) -> None:
        """Take the Gram matrices and their regression."""
        self.gram, self.sums = gram, sums

    @property
    def thresholds(self) -> Thresholds:
        """Those of the regression."""
        return self.sums.thresholds

    def columns(self, hypotheses: Iterable[Hypothesis]) -> Index:
        """Return indices of the nuisance regressors and those of some hypotheses."""
        return self.gram.with_nuisance(c for h in hypotheses for c in h.candidates)

    def own_columns(self, hypothesis: Hypothesis) -> Index:
        """Return indices of one hypothesis's regressors."""
        return self.gram.columns_of(hypothesis.candidates)

    def weights(self, hypotheses: Sequence[Hypothesis]) -> Weights:
        """Return the weights of hypotheses fitted together, with half their intervals' widths."""
        return weights_of(self.gram, self.sums, *parts_of(hypotheses))

    def values(self, hypotheses: Sequence[Hypothesis]) -> dict[Candidate, Array]:
        """Return the weights without intervals, which takes less time."""
        return values_of(self.gram, self.sums, *parts_of(hypotheses))

    def held_out(self, hypothesis: Hypothesis, base: Index) -> Array:
        """Return the hold-out Σ residual² of each block, fitted with a base and a hypothesis."""
        own, elements = self.own_columns(hypothesis), hypothesis.elements
        if not hypothesis.common:
            return self.sums.held_out(np.concatenate([base, own]))
        same = np.tile(np.eye(len(own) // len(elements)), (len(elements), 1))
        sums, base, own = self.sums.combined(base, own, same)
        return sums.held_out(np.concatenate([base, own]))

    def delayed(self, hypothesis: Hypothesis) -> Fits:
        """Return the same with a hypothesis acting only from its onset on."""
        if not hypothesis.onset:
            return self
        own, onset = self.own_columns(hypothesis), hypothesis.onset
        return Fits(self.gram.delayed(own, onset), self.sums.delayed(own, onset))

    def model_form_error(
        self, hypothesis: Hypothesis, others: Sequence[Hypothesis]
    ) -> dict[Candidate, float]:
        """Return the model-form error of each candidate as a share of its amplitude, from 0 to 1.

        It is the square root of a ratio of squares. Numerator: the largest gain of a free function
        beside the hypothesis in a residual that the candidate acts on. Denominator: the candidate's
        gain beyond all others. Where several candidates act on one residual, they share the error
        equally.
        """
        base, own = self.columns(others), self.own_columns(hypothesis)
        apart = [(c,) for c in hypothesis.candidates]
        causes = [hypothesis.candidates] if hypothesis.common else apart
        late = self.delayed(hypothesis)
        free = _freely_gained(late.gram, late.sums, base, own)
        parts = {cause: self.gram.columns_of(cause) for cause in causes}
        where = {cause: self.gram.places_of(mine) for cause, mine in parts.items()}
        acting = Counter(place for places in where.values() for place in places)
        found: dict[Candidate, float] = {}
        for cause, mine in parts.items():
            rest = np.concatenate([base, np.setdiff1d(own, mine)])
            gained = float(late.sums.gains_beyond(rest, [mine])[0])
            most = max(free[place] / acting[place] for place in where[cause])
            share = float(np.sqrt(most / max(gained, most))) if most else 0.0
            found |= dict.fromkeys(cause, share)
        return found

    def is_negligible(self, hypothesis: Hypothesis, chosen: Sequence[Hypothesis]) -> bool:
        """Return whether its weights are within a healthy machine's range, so it is no finding."""
        found = self.values(chosen)
        return is_negligible({c: found[c] for c in hypothesis.candidates})


def _freely_gained(
    gram: BlockGram, sums: BlockRegression, base: Index, own: Index
) -> dict[Place, float]:
    """Return the model-form error of regressors in each residual they act on, in squares.

    It is the largest hold-out gain of a free function of a measured signal beyond them, at least 0.
    Functions of time are excluded, because hold-out blocks have no information on them.
    """
    both = np.concatenate([base, own])
    left = sums.held_out(both).sum()
    found = dict.fromkeys(gram.places_of(own), 0.0)
    for driver in gram.terms:
        if isinstance(driver, Driver) and driver.place in found and not driver.of_time:
            free = sums.held_out(np.append(both, gram.columns_of([driver]))).sum()
            found[driver.place] = max(found[driver.place], float(left - free))
    return found
