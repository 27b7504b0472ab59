"""Joint fits of hypotheses to the residuals."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.regression.block_regression import BlockRegression, Gain
from cspm_ident.diagnosis.regression.coefficients import Weights, at_once, values_of, weights_of
from cspm_ident.diagnosis.regression.collinearity import freely_gained_at
from cspm_ident.diagnosis.regression.hypothesis import (
    Hypothesis,
    bounded,
    freedom,
    is_allowed,
    is_early,
    is_exact,
    is_negligible,
    is_tied,
    is_timing,
    parts_of,
)
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

    def freedom(self, hypothesis: Hypothesis) -> float:
        """Return the number of free parameters of a hypothesis that the data determine."""
        own = self.own_columns(hypothesis)
        known = len(own) - self.sums.freedom(own)
        return freedom(hypothesis) - known

    def beside(self, base: Index, *further: Hypothesis) -> Index:
        """Return the indices of a base and of hypotheses' regressors."""
        return np.concatenate([base, *map(self.own_columns, further)])

    def weights(self, hypotheses: Sequence[Hypothesis]) -> Weights:
        """Return the weights of hypotheses fitted together, with half their intervals' widths."""
        return weights_of(self.gram, self.sums, *parts_of(hypotheses))

    def values(self, hypotheses: Sequence[Hypothesis]) -> dict[Candidate, Array]:
        """Return the weights without intervals, which takes less time."""
        return values_of(self.gram, self.sums, *parts_of(hypotheses))

    def shared(self, base: Index, hypothesis: Hypothesis) -> tuple[BlockRegression, Index, Index]:
        """Return a regression in which all elements of a hypothesis share their weights.

        Returned with the indices of the base and of the hypothesis in it.
        """
        columns, elements = self.own_columns(hypothesis), hypothesis.elements
        same = np.tile(np.eye(len(columns) // len(elements)), (len(elements), 1))
        return self.sums.combined(base, columns, same)

    def held_out(self, hypothesis: Hypothesis, base: Index) -> Array:
        """Return the hold-out Σ residual² of each block, fitted with a base and a hypothesis."""
        if not hypothesis.common:
            return self.sums.held_out(self.beside(base, hypothesis))
        sums, base, own = self.shared(base, hypothesis)
        return sums.held_out(np.concatenate([base, own]))

    def gain(self, hypothesis: Hypothesis, base: Index) -> Gain:
        """Return the hold-out gain of a hypothesis beyond a base."""
        return self.sums.gain(base, self.own_columns(hypothesis))

    def delayed(self, hypothesis: Hypothesis) -> Fits:
        """Return the same with a hypothesis acting only from its onset on."""
        if not hypothesis.onset:
            return self
        own, onset = self.own_columns(hypothesis), hypothesis.onset
        return Fits(self.gram.delayed(own, onset), self.sums.delayed(own, onset))

    def delayed_columns(self, columns: Index, block: int) -> Fits:
        """Return the same with the regression's columns acting only from a block on."""
        return Fits(self.gram, self.sums.delayed(columns, block))

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
        free = freely_gained_at(late.gram, late.sums, base, own)
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

    def may_be_untruth(self, chosen: Sequence[Hypothesis]) -> list[bool]:
        """Return for each hypothesis whether the model-form error of the others may explain it.

        True where that error is as large as the hypothesis's gain in every residual it acts on.
        Three kinds have no such error: corrections of the file or of readings, clock offsets of a
        healthy machine, and constants, whose error is a function of time.
        """
        taken = [self._taken(h, chosen) for h in chosen]
        share = self.thresholds.model_form_error_share
        laws = [
            k
            for k, h in enumerate(chosen)
            if not is_exact(h.effect) and not self.is_negligible(h, chosen)
        ]
        return [
            all(
                taken[k][place] <= share * sum(max(0.0, taken[i][place]) for i in laws if i != k)
                for place in self.gram.places_of(self.own_columns(h))
            )
            for k, h in enumerate(chosen)
        ]

    def _taken(self, hypothesis: Hypothesis, chosen: Sequence[Hypothesis]) -> dict[Place, float]:
        """Return a hypothesis's gain in squares in each residual, beyond the others."""
        base = self.columns(h for h in chosen if h is not hypothesis)
        both = self.beside(base, hypothesis)
        without, left = (
            self.gram.left(columns, self.sums.weights(columns)) for columns in (base, both)
        )
        return {place: without[place] - left[place] for place in left}

    def is_plausible(self, hypotheses: Sequence[Hypothesis], loosely: bool = False) -> bool:
        """Return whether the catalogue allows the parameters, within their intervals.

        Args:
            hypotheses: fitted together.
            loosely: whether dependent weights may deviate by the model-form error as well. For
                alternatives, which have to be kept unless clearly contradicted.
        """
        values = self.values(hypotheses)
        if all(is_allowed(c, own) and not c.effect.signature.tied for c, own in values.items()):
            return True
        found = at_once(self.weights(hypotheses))
        if not all(is_allowed(c, bounded(c, own, half)) for c, (own, half) in found.items()):
            return False
        tied = {c: weights for c, weights in found.items() if c.effect.signature.tied}
        return all(
            is_tied(c, own, half + self._undecided(c, own) if loosely else half)
            for c, (own, half) in tied.items()
        )

    def _undecided(self, candidate: Candidate, weights: Array) -> Array:
        """Return the deviation of each weight that is within the model-form error."""
        lengths = self.sums.lengths[self.gram.columns_of([candidate])]
        share = np.sqrt(self.thresholds.model_form_error_share)
        return np.asarray(share * np.linalg.norm(lengths * weights) / lengths)

    def are_early(self, hypotheses: Sequence[Hypothesis]) -> bool:
        """Return whether some readings would then be newer than their stamps."""
        timing = [h for h in hypotheses if is_timing(h.effect)]
        values = self.values(hypotheses) if timing else {}
        return any(is_early(values, h) for h in timing)

    def contradicts(self, hypothesis: Hypothesis, others: Sequence[Hypothesis]) -> bool:
        """Return whether it restates that others are late, as readings that are too new.

        Clocks show differences of times only. So both hypotheses are equivalent where nothing else
        identifies the late one.
        """
        late = [h for h in others if is_timing(h.effect) and not self.is_negligible(h, others)]
        if not late or not is_timing(hypothesis.effect):
            return False
        known = np.concatenate([self.own_columns(h) for h in late])
        own = self.sums.spanned(self.columns([]), known, self.own_columns(hypothesis))
        same = bool(np.all(own > 1.0 - self.thresholds.minor_share))
        return same and self.are_early([*others, hypothesis])

    def is_negligible(self, hypothesis: Hypothesis, chosen: Sequence[Hypothesis]) -> bool:
        """Return whether its weights are within a healthy machine's range, so it is no finding."""
        found = self.values(chosen)
        return is_negligible({c: found[c] for c in hypothesis.candidates})
