"""Joint fits of hypotheses to the residuals."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.regression.block_regression import BlockRegression, Gain
from cspm_ident.diagnosis.regression.coefficients import Weights, at_once, values_of, weights_of
from cspm_ident.diagnosis.regression.hypothesis import (
    Hypothesis,
    bounded,
    freedom,
    is_allowed,
    is_early,
    is_exact,
    is_negligible,
    is_surveyed,
    is_tied,
    is_timing,
    parts_of,
)
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
        # Intervals take most of a search, and are asked for of the same hypotheses again.
        self._weights: dict[tuple[tuple[Candidate, ...], frozenset[str]], Weights] = {}

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
        candidates, common = parts_of(hypotheses)
        key = tuple(candidates), frozenset(common)
        if key not in self._weights:
            self._weights[key] = weights_of(self.gram, self.sums, candidates, common)
        return self._weights[key]

    def values(
        self, hypotheses: Sequence[Hypothesis], beside: Sequence[Hypothesis] = ()
    ) -> dict[Candidate, Array]:
        """Return the weights without intervals, which takes less time.

        Args:
            hypotheses: fitted together.
            beside: fitted with them, their weights left out.
        """
        found = values_of(self.gram, self.sums, *parts_of([*hypotheses, *beside]))
        return {c: found[c] for each in hypotheses for c in each.candidates}

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

    def has_few_stretches(self, hypothesis: Hypothesis, others: Sequence[Hypothesis]) -> bool:
        """Return whether too few independent stretches of time determine its weights.

        Their intervals then hold too rarely to decide anything.
        """
        base, own, sums = self.columns(others), self.own_columns(hypothesis), self.sums
        if hypothesis.common:
            sums, base, own = self.shared(base, hypothesis)
        return bool(np.all(sums.long_run(base, own).few_stretches))

    def is_hidden(self, hypothesis: Hypothesis, chosen: Sequence[Hypothesis]) -> bool:
        """Return whether a column of a hypothesis is collinear with those of the others."""
        others = [self.own_columns(h) for h in chosen if h is not hypothesis]
        own = self.own_columns(hypothesis)
        spanned = self.sums.spanned(self.gram.nuisance, np.concatenate(others), own)
        return bool(np.any(spanned > 1.0 - self.thresholds.material_share))

    def delayed(self, hypothesis: Hypothesis) -> Fits:
        """Return the same with a hypothesis acting only from its onset on."""
        if not hypothesis.onset:
            return self
        own, onset = self.own_columns(hypothesis), hypothesis.onset
        return Fits(self.gram.delayed(own, onset), self.sums.delayed(own, onset))

    def delayed_columns(self, columns: Index, block: int) -> Fits:
        """Return the same with the regression's columns acting only from a block on."""
        return Fits(self.gram, self.sums.delayed(columns, block))

    def may_be_untruth(self, chosen: Sequence[Hypothesis]) -> list[bool]:
        """Return for each hypothesis whether the model-form error of the others may explain it.

        True where that error is as large as the hypothesis's gain in every residual it acts on. It
        counts as far as it can look like the hypothesis; see `_likeness`. Three kinds have no such
        error: corrections of the file or of readings, clock offsets of a healthy machine, and
        constants, whose error is a function of time.
        """
        taken = [self._taken(h, chosen) for h in chosen]
        share = self.thresholds.model_form_error_share
        laws = [
            k
            for k, h in enumerate(chosen)
            if not is_exact(h.effect) and not self.is_negligible(h, chosen)
        ]

        def mistaken(k: int, place: Place) -> float:
            return share * sum(
                taken[i][place] * self._likeness(chosen[i], chosen[k], place)
                for i in laws
                if i != k and taken[i][place] > 0.0
            )

        return [
            all(
                taken[k][place] <= mistaken(k, place)
                for place in self.gram.places_of(self.own_columns(h))
            )
            for k, h in enumerate(chosen)
        ]

    def _likeness(self, law: Hypothesis, other: Hypothesis, place: Place) -> float:
        """Return the share of a law's model-form error that can look like another hypothesis.

        The error of a function of a signal is a function of that signal. So it is the share of the
        other's columns that free functions of the law's signal span; all of it, as far as the law
        is no function of a single signal.
        """
        (every,) = (p.columns for p in self.gram.places if p.place == place)
        own, others = (np.intersect1d(self.own_columns(h), every) for h in (law, other))
        shares = [(0.0, 1.0)] if len(own) else [(1.0, 0.0)]
        for driver in self.gram.terms:
            if isinstance(driver, Driver) and driver.place == place and not driver.of_time:
                free, base = self.gram.columns_of([driver]), self.gram.nuisance
                like = self.sums.spanned(base, free, own).min(initial=1.0)
                shares.append((float(like), float(self.sums.spanned(base, free, others).max())))
        function, alike = max(shares)
        return 1.0 - function + function * alike

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

    def is_calibration(self, hypothesis: Hypothesis, chosen: Sequence[Hypothesis]) -> bool:
        """Return whether it moves surveyed places by no more than their accuracy.

        What is not significant does not count: motion in few directions leaves some undetermined.
        """
        if not is_surveyed(hypothesis.effect):
            return False
        found = self.weights(chosen)
        sure = {
            c: np.where(np.abs(weights) > half, weights, 0.0)
            for c, (weights, half) in found.items()
            if c in hypothesis.candidates
        }
        return is_negligible(sure)
