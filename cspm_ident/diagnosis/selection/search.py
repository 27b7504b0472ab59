"""Stepwise selection of the effects that explain the residuals of some recordings.

It also returns their alternatives and the residuals that no effect of the catalogue explains.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from copy import copy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.finding import Finding, Unexplained
from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.regression.block_regression import BlockRegression, Gain, gain_of
from cspm_ident.diagnosis.regression.hypothesis import (
    Hypothesis,
    are_places,
    boldness,
    has_one_system,
    is_number,
    is_spread,
    is_surveyed,
    is_wider,
    joined,
    may_be_none,
    members_of,
    shapes_of,
)
from cspm_ident.diagnosis.regression.joint_fit import Fits
from cspm_ident.diagnosis.regression.significance import Significance
from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.selection.alternatives import alternatives_of
from cspm_ident.diagnosis.selection.element_scope import Scopes
from cspm_ident.diagnosis.selection.healthy_errors import clocks_of, survey_of
from cspm_ident.diagnosis.selection.merge import one_instead
from cspm_ident.diagnosis.selection.onset import first_block
from cspm_ident.diagnosis.selection.pair_exchange import pair_instead
from cspm_ident.diagnosis.selection.parsimony import simplest
from cspm_ident.diagnosis.selection.rivals import rivals_of
from cspm_ident.diagnosis.selection.screening import screened
from cspm_ident.diagnosis.selection.search_result import SearchResult
from cspm_ident.diagnosis.selection.unexplained import unexplained
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds

Array = NDArray[np.float64]
Index = NDArray[np.intp]

# Hypotheses beside each of which a further one is looked for, where none is significant alone.
_PROMISING = 3


class Search:
    """Searches a catalogue for the effects that explain the residuals of some recordings."""

    def __init__(
        self,
        gram: BlockGram,
        progress: Callable[[str], None] = lambda _: None,
        thresholds: Thresholds = DEFAULT_THRESHOLDS,
    ) -> None:
        """Store the Gram matrices of all residuals; `progress` receives the name of each step."""
        self.thresholds, self._progress = thresholds, progress
        self.fits = Fits(gram, BlockRegression(gram, thresholds))
        self._look_for([c for c in gram.terms if isinstance(c, Candidate) and self._shows(c)])

    def _look_for(self, candidates: Sequence[Candidate]) -> None:
        self._effects = candidates
        self.significance = Significance(self.fits, candidates)
        self.scopes = Scopes(self.fits, self.significance, candidates)

    @property
    def gram(self) -> BlockGram:
        """Block Gram matrices, in which selected effects act from their onsets on."""
        return self.fits.gram

    @property
    def sums(self) -> BlockRegression:
        """The regression on these."""
        return self.fits.sums

    def delayed(self, hypothesis: Hypothesis) -> Search:
        """Return the same search with a hypothesis acting only from its onset on."""
        if not hypothesis.onset:
            return self
        other = copy(self)
        other._begin(hypothesis)
        return other

    def without(self, candidates: Sequence[Candidate]) -> Search:
        """Return the same search, with candidates fewer."""
        other = copy(self)
        other._look_for([c for c in self._effects if c not in candidates])
        return other

    def run(self) -> SearchResult:
        """Select effects one by one, each on all elements where it is significant."""
        chosen = self._chosen()
        found = [self.finding_of(hypothesis, chosen) for hypothesis in chosen]
        found.sort(key=lambda each: -each.gain.total)
        self._progress("unmodelled residual")
        return SearchResult(tuple(found), self.unexplained(chosen), len(self._effects))

    def first(self) -> Hypothesis | None:
        """Return the significant hypothesis of the largest gain, or None."""
        return self._best(self._clocks())

    @property
    def heard(self) -> tuple[Candidate, ...]:
        """Candidates whose columns are not zero."""
        return tuple(self._effects)

    def retuned(self) -> dict[Candidate, Array]:
        """Return fitted weights of the test-bed file's own parameters, without any added effect.

        Only significant corrections are included.
        """
        narrow = copy(self)
        narrow._look_for([c for c in self._effects if c.effect.physics.alter is not None])
        own = [c for h in narrow._chosen() for c in h.candidates]
        return self.gram.parted(own, self.sums.weights(self.gram.with_nuisance(own)))

    def _chosen(self) -> list[Hypothesis]:
        chosen = self._surveyed(self._clocks())
        most = self.thresholds.most_effects
        while sum(not self.fits.is_negligible(h, chosen) for h in chosen) < most:
            self._progress(f"effect {len(chosen) + 1}")
            best = self._best(chosen)
            found = self._pair(chosen) if best is None else (best,)
            if not found:
                break
            for each in found:
                self._begin(each)
                chosen = joined(chosen, each)
            chosen = self._surveyed(chosen)
        return self._merged(self._needed(self._exchanged(chosen)))

    def _pair(self, chosen: Sequence[Hypothesis]) -> tuple[Hypothesis, ...]:
        """Return two hypotheses of which each is significant only beside the other; else none.

        Two large errors hide each other, and a clock error of healthy size hides any.
        """
        if not self._unexplained(chosen, ()):
            return ()
        clocks = tuple(clocks_of(self._free(chosen)))
        for first in (*clocks, *self._promising(chosen)):
            found = self._best([*chosen, first])
            if found is None:
                continue
            both = [*chosen, first, found]
            late = self.delayed(found)
            base, gain = self._others(first, both), late._gain(first, both)
            significant = late.significance.counts(base, first, gain, len(chosen) + 1)
            if significant and (first not in clocks or late.fits.is_negligible(first, both)):
                return first, found
        return ()

    def _promising(self, chosen: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Return plausible hypotheses that take most of hold-out blocks, significant or not."""
        base, scopes = self.fits.columns(chosen), self._scopes(chosen)
        gained = [self.fits.gain(h, base).total for h in scopes]
        best = [scopes[k] for k in np.argsort(gained)[::-1] if gained[k] > 0.0]
        return [h for h in best if self.fits.is_plausible([*chosen, h])][:_PROMISING]

    def _scopes(self, chosen: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Return what takes most beside the chosen, each on the elements that it may have."""
        base, free = self.fits.columns(chosen), self._free(chosen)
        gains = self.sums.gains_beyond(base, [self._of(c) for c in free])
        likely = screened(free, gains, self.thresholds.screened_candidates)
        return [h for c in likely for h in self.scopes.of(c, free, base)]

    def _clocks(self) -> list[Hypothesis]:
        """Return the clock effect of healthy size, on signals that one system reads.

        The list is empty if none is significant. It is searched first, because a fault may explain
        the same residual equally well.
        """
        late = (
            h
            for h in clocks_of(self._effects)
            if has_one_system(h.effect) and self.fits.is_negligible(h, [h])
        )
        best = self._surest(late, (), self.fits.columns([]))
        return [] if best is None else [best]

    def _surveyed(self, chosen: list[Hypothesis]) -> list[Hypothesis]:
        """Return the selection with errors of the survey, if hold-out blocks show them.

        Only where all of them are as small as in a healthy machine.
        """
        survey = survey_of(self._free(chosen))
        base, own = self.fits.columns(chosen), [self.fits.own_columns(h) for h in survey]
        gain = self.sums.gain(base, np.concatenate([base[:0], *own]))
        if gain.total <= self.thresholds.certain_sigma * gain.error:
            return chosen
        both = [*chosen, *survey]
        return both if all(self.fits.is_calibration(h, both) for h in survey) else chosen

    def _merged(self, chosen: list[Hypothesis]) -> list[Hypothesis]:
        """Return the selection after each merge of several faults into one effect."""
        while merging := one_instead(self.fits, self.significance, chosen, self._free(chosen)):
            one, *few = merging
            chosen = joined([h for h in chosen if h not in few], one)
        return chosen

    def _needed(self, chosen: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Return the selection without redundant hypotheses, all scopes and tests repeated."""
        kept = list(chosen)
        for k, hypothesis in enumerate(kept):
            if not self.fits.is_calibration(hypothesis, kept):
                kept[k] = self.scopes.pruned(hypothesis, self._others(hypothesis, kept))
        while (needless := self._needless(kept)) is not None:
            del kept[needless]
        return kept

    def _needless(self, chosen: Sequence[Hypothesis]) -> int | None:
        """Return the index of the weakest redundant hypothesis, or None.

        Redundant is a hypothesis of one of three kinds:

        1. Its gain is within the model-form error of the laws beside it, in every residual.
        2. It is collinear with the others, and all its 95 % intervals contain zero.
        3. It fails the significance test beside the others.

        A delay stays if without it other readings would precede their stamps.
        """
        weights = self.fits.weights(chosen) if len(chosen) > 1 else {}
        gains = [self._gain(hypothesis, chosen) for hypothesis in chosen]
        may_be_untruth = self.fits.may_be_untruth(chosen)
        for k in np.argsort([gain.total for gain in gains]):
            own = chosen[k]
            if gains[k].total > 0.0 and self.fits.is_calibration(own, chosen):
                continue
            needless = (
                may_be_untruth[k]
                or (
                    not self.fits.is_negligible(own, chosen)
                    and may_be_none({c: weights[c] for c in members_of(weights, own)})
                    and self.fits.is_hidden(own, chosen)
                )
                or not self._is_there(own, self._others(own, chosen), gains[k], chosen)
            )
            rest = [h for h in chosen if h is not own]
            if needless and (self.fits.are_early(chosen) or not self.fits.are_early(rest)):
                return int(k)
        return None

    def _is_there(
        self, hypothesis: Hypothesis, base: Index, gain: Gain, chosen: Sequence[Hypothesis]
    ) -> bool:
        """Return whether a hypothesis, or a plausible rival of smaller gain, is significant."""
        known = len(chosen) - 1
        if self.significance.counts(base, hypothesis, gain, known):
            return True
        others = [h for h in chosen if h is not hypothesis]
        rivals = self._rivals(hypothesis, self._effects, base) if gain.total > 0.0 else []
        return any(
            self.significance.counts(base, rival, rival_gain, known)
            for rival in rivals
            if (rival_gain := self.fits.gain(rival, base)).total < gain.total
            and self.fits.is_plausible([*others, rival])
        )

    def _others(self, hypothesis: Hypothesis, chosen: Sequence[Hypothesis]) -> Index:
        return self.fits.columns(h for h in chosen if h is not hypothesis)

    def _gain(self, hypothesis: Hypothesis, chosen: Sequence[Hypothesis]) -> Gain:
        return self.fits.gain(hypothesis, self._others(hypothesis, chosen))

    def _exchanged(self, chosen: list[Hypothesis]) -> list[Hypothesis]:
        """Return the selection after a pair exchange on one element, if that is better."""
        kept = [h for h in chosen if self.fits.is_negligible(h, chosen)]
        return pair_instead(self.fits, self.significance, chosen, kept, self._free(kept)) or chosen

    def _begin(self, hypothesis: Hypothesis) -> None:
        """Let the hypothesis's columns act from its onset only, from now on."""
        if hypothesis.onset:
            self.fits = self.fits.delayed(hypothesis)
            self._look_for(self._effects)

    def _best(self, chosen: Sequence[Hypothesis]) -> Hypothesis | None:
        base, free, scopes = self.fits.columns(chosen), self._free(chosen), self._scopes(chosen)
        late = [d for h in scopes for d in self._late(h, free, base)]
        best = self._surest([*scopes, *late], chosen, base)
        if best is None:
            return None
        begun = self.delayed(best)
        rivals = begun._rivals(best, free, base)
        found = simplest(begun.fits, best, rivals, base, chosen)
        return self.delayed(found).scopes.pruned(found, base)

    def _free(self, chosen: Sequence[Hypothesis]) -> list[Candidate]:
        """Return candidates that may be added: no effect twice on an element or with two shapes."""
        taken = {(c.effect_id, c.element) for h in chosen for c in h.candidates}
        shapes = {c.effect_id: c.shape for h in chosen for c in h.candidates}
        return [
            c
            for c in self._effects
            if (c.effect_id, c.element) not in taken and shapes.get(c.effect_id, c.shape) == c.shape
        ]

    def _surest(
        self, hypotheses: Iterable[Hypothesis], chosen: Sequence[Hypothesis], base: Index
    ) -> Hypothesis | None:
        """Return the significant hypothesis of the largest gain in hold-out blocks, or None.

        A wider element scope and an onset must each gain more by a number of standard errors.
        """
        before, limits = self.sums.held_out(base), self.thresholds
        best: tuple[Array, Hypothesis] | None = None
        for hypothesis in hypotheses:
            gained = self.delayed(hypothesis)._sure_gain(hypothesis, chosen, base, before)
            if gained is None:
                continue
            needed = boldness(hypothesis, thresholds=limits) * gain_of(gained).error
            if best is not None:
                spread = is_spread(best[1], hypothesis, limits)
                wider = is_wider(hypothesis, best[1]) and not spread
                least = best[0].sum() + limits.certain_sigma * gain_of(gained).error * wider
                sigmas = boldness(hypothesis, best[1], limits)
                if sigmas:
                    least = best[0].sum() + sigmas * gain_of(gained - best[0]).error
                needed = max(needed, least)
            if gained.sum() > needed:
                best = gained, hypothesis
        return None if best is None else best[1]

    def _late(
        self, hypothesis: Hypothesis, free: Sequence[Candidate], base: Index
    ) -> Iterable[Hypothesis]:
        """Yield the hypothesis with an onset, if one is better than acting all the time.

        Its shape is the one that leaves the smallest sum of squares.
        """
        if is_number(hypothesis):  # It acts all the time.
            return
        first = self.thresholds.onset_blocks
        last = self.sums.blocks - 2 * first
        late: list[tuple[float, Hypothesis]] = []
        for shape in shapes_of(hypothesis, free):
            onset, left = first_block(self.sums, base, self.fits.own_columns(shape))
            if first <= onset <= last:
                late.append((left, replace(shape, onset=onset)))
        if late:
            yield min(late, key=lambda each: each[0])[1]

    def _sure_gain(
        self, hypothesis: Hypothesis, chosen: Sequence[Hypothesis], base: Index, before: Array
    ) -> Array | None:
        """Return the gain of a hypothesis in each hold-out block, (blocks,).

        It is None if the hypothesis is implausible, contradicts others or is not significant.
        """
        together = [*chosen, hypothesis]
        if not self.fits.is_plausible(together) or self.fits.contradicts(hypothesis, chosen):
            return None
        if self._is_of_survey(hypothesis, chosen):
            return None
        gained = before - self.fits.held_out(hypothesis, base)
        known = len(chosen)
        return (
            gained if self.significance.counts(base, hypothesis, gain_of(gained), known) else None
        )

    def _is_of_survey(self, hypothesis: Hypothesis, chosen: Sequence[Hypothesis]) -> bool:
        """Return whether a survey's accuracy explains it, or places that are calibrated already.

        A body's markers that are off cannot be distinguished from all its cables' ends that are.
        """
        if are_places(hypothesis.effect) and any(
            are_places(each.effect) and self.fits.is_calibration(each, chosen) for each in chosen
        ):
            return True
        own = [*chosen, hypothesis]
        return is_surveyed(hypothesis.effect) and self.fits.is_negligible(hypothesis, own)

    def _rivals(
        self, hypothesis: Hypothesis, free: Sequence[Candidate], base: Index
    ) -> list[Hypothesis]:
        return rivals_of(self.gram, self.sums, base, hypothesis, free)

    def judged_again(self, finding: Finding, chosen: Sequence[Hypothesis]) -> Finding:
        """Return a finding with gain, share and alternatives beside the hypotheses that are kept.

        Rejected hypotheses no longer exclude alternatives, and may be alternatives themselves.
        """
        again = self.finding_of(finding.hypothesis, chosen)
        known = {rival.words for rival in finding.alternatives}
        further = (rival for rival in again.alternatives if rival.words not in known)
        alternatives = (*finding.alternatives, *further)
        return replace(finding, gain=again.gain, share=again.share, alternatives=alternatives)

    def finding_of(self, hypothesis: Hypothesis, chosen: Sequence[Hypothesis]) -> Finding:
        """Return the finding of a hypothesis beside others: gain, share and alternatives."""
        others = [h for h in chosen if h is not hypothesis]
        base, own = self.fits.columns(others), self.fits.own_columns(hypothesis)
        gain = self.sums.gain(base, own)
        return Finding(
            hypothesis,
            gain,
            self.significance.share(base, own),
            tuple(alternatives_of(self.fits, self._effects, hypothesis, others)),
        )

    def unexplained(
        self, chosen: Sequence[Hypothesis], healthy: Sequence[Hypothesis] = ()
    ) -> tuple[Unexplained, ...]:
        """Return the residuals that hypotheses leave unexplained; see `unexplained`.

        A residual that a clock error of healthy size explains is not unexplained. It need not gain
        in hold-out blocks, because clocks wander from one part of a recording to another.
        """
        beside = list(healthy)
        left = self._unexplained(chosen, beside)
        for clock in clocks_of(self._free([*chosen, *healthy])) if left else ():
            if self.fits.is_negligible(clock, [*chosen, *beside, clock]):
                less = self._unexplained(chosen, [*beside, clock])
                if len(less) < len(left):
                    beside, left = [*beside, clock], less
        return left

    def _unexplained(
        self, chosen: Sequence[Hypothesis], healthy: Sequence[Hypothesis]
    ) -> tuple[Unexplained, ...]:
        clocks = [h for h in chosen if self.fits.is_negligible(h, [*chosen, *healthy])]
        reported = [h for h in chosen if h not in clocks]
        return unexplained(self.gram, self.sums, self.significance, reported, [*clocks, *healthy])

    def _shows(self, candidate: Candidate) -> bool:
        excited = self.sums.excited[self._of(candidate)]
        # Of springs at the bar, those along coordinates that rest are left out.
        partly = candidate.effect.signature.shares_noise
        return bool(excited.any() if partly else excited.all())

    def _of(self, term: Candidate | Driver) -> Index:
        return self.gram.columns_of([term])
