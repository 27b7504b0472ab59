"""Which effects explain the residuals, what else would, and what nothing in the catalogue does."""

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
    boldness,
    has_one_system,
    is_number,
    is_spread,
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
from cspm_ident.diagnosis.selection.common_clock import clocks_of
from cspm_ident.diagnosis.selection.element_scope import Scopes
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


class Search:
    """Looks through a catalogue for what explains the residuals of some recordings."""

    def __init__(
        self,
        gram: BlockGram,
        progress: Callable[[str], None] = lambda _: None,
        thresholds: Thresholds = DEFAULT_THRESHOLDS,
    ) -> None:
        """Take the Gram matrices of all residuals."""
        self.gram, self.sums = gram, BlockRegression(gram, thresholds)
        self.thresholds = thresholds
        self.fits = Fits(gram, self.sums)
        self._progress = progress
        self._look_for([c for c in gram.terms if isinstance(c, Candidate) and self._shows(c)])

    def _look_for(self, candidates: Sequence[Candidate]) -> None:
        self._effects = candidates
        self.significance = Significance(self.fits, candidates)
        self.scopes = Scopes(self.fits, self.significance, candidates)

    def run(self) -> SearchResult:
        """Choose effects one by one, each with all elements on which it surely acts."""
        chosen = self._chosen()
        found = [self._judged(hypothesis, chosen) for hypothesis in chosen]
        found.sort(key=lambda each: -each.gain.total)
        self._progress("what is left")
        return SearchResult(tuple(found), self.unexplained(chosen), len(self._effects))

    def first(self) -> Hypothesis | None:
        """Return what explains most, if anything surely is there."""
        return self._best(self._clocks())

    @property
    def heard(self) -> tuple[Candidate, ...]:
        """Candidates whose columns are not zero."""
        return tuple(self._effects)

    def retuned(self) -> dict[Candidate, Array]:
        """Return the weights of the file's own parameters, fitted where it helps, nothing added."""
        narrow = copy(self)
        narrow._look_for([c for c in self._effects if c.effect.physics.alter is not None])
        own = [c for h in narrow._chosen() for c in h.candidates]
        return self.gram.parted(own, self.sums.weights(self.gram.with_nuisance(own)))

    def _chosen(self) -> list[Hypothesis]:
        chosen = self._clocks()
        most = self.thresholds.most_effects
        while sum(not self.fits.is_negligible(h, chosen) for h in chosen) < most:
            self._progress(f"effect {len(chosen) + 1}")
            best = self._best(chosen)
            found = self._beside_clocks(chosen) if best is None else (best,)
            if not found:
                break
            for each in found:
                self._begin(each)
                chosen = joined(chosen, each)
        return self._merged(self._needed(self._exchanged(chosen)))

    def _beside_clocks(self, chosen: Sequence[Hypothesis]) -> tuple[Hypothesis, ...]:
        """Return what shows only beside what clocks of a sound machine do, with that.

        Looked for where something is left that nothing explains.
        """
        if not self._unexplained(chosen, ()):
            return ()
        for clock in clocks_of(self._free(chosen)):
            found = self._best([*chosen, clock])
            if found is None:
                continue
            both = [*chosen, clock, found]
            with self.fits.delayed(found):
                base, gain = self._others(clock, both), self._gain(clock, both)
                significant = self.significance.counts(base, clock, gain, len(chosen) + 1)
                healthy = self.fits.is_negligible(clock, both)
            if significant and healthy:
                return clock, found
        return ()

    def _clocks(self) -> list[Hypothesis]:
        """Return what clocks of a sound machine do to what one system reads, if it surely shows.

        It is looked for first, lest something else that explains as much is taken for a fault.
        """
        late = (
            h
            for h in clocks_of(self._effects)
            if has_one_system(h.effect) and self.fits.is_negligible(h, [h])
        )
        best = self._surest(late, (), self.fits.columns([]))
        return [] if best is None else [best]

    def _merged(self, chosen: list[Hypothesis]) -> list[Hypothesis]:
        """Return one effect instead of several faults wherever it explains all of them."""
        while merging := one_instead(self.fits, self.significance, chosen, self._free(chosen)):
            one, *few = merging
            chosen = joined([h for h in chosen if h not in few], one)
        return chosen

    def _needed(self, chosen: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Return what was chosen less what is not needed beside the others, the weakest first.

        What was chosen first did not know of the others.
        """
        kept = list(chosen)
        for k, hypothesis in enumerate(kept):
            kept[k] = self.scopes.pruned(hypothesis, self._others(hypothesis, kept))
        while (needless := self._needless(kept)) is not None:
            del kept[needless]
        return kept

    def _needless(self, chosen: Sequence[Hypothesis]) -> int | None:
        """Return which is the weakest that is not surely there beside the others, if any.

        Nor is what laws beside it may be untrue by as much, wherever it shows, nor what the others
        hide, so that all its numbers may be none. What is late is needed where other readings would
        be early without it.
        """
        weights = self.fits.weights(chosen) if len(chosen) > 1 else {}
        gains = [self._gain(hypothesis, chosen) for hypothesis in chosen]
        may_be_untruth = self.fits.may_be_untruth(chosen)
        for k in np.argsort([gain.total for gain in gains]):
            own = chosen[k]
            needless = (
                may_be_untruth[k]
                or (
                    not self.fits.is_negligible(own, chosen)
                    and may_be_none({c: weights[c] for c in members_of(weights, own)})
                    and self._is_hidden(own, chosen)
                )
                or not self._is_there(own, self._others(own, chosen), gains[k], chosen)
            )
            rest = [h for h in chosen if h is not own]
            if needless and (self.fits.are_early(chosen) or not self.fits.are_early(rest)):
                return int(k)
        return None

    def _is_hidden(self, hypothesis: Hypothesis, chosen: Sequence[Hypothesis]) -> bool:
        """Return whether others say nearly the same as a part of a hypothesis."""
        others = [self.fits.own_columns(h) for h in chosen if h is not hypothesis]
        own = self.fits.own_columns(hypothesis)
        spanned = self.sums.spanned(self.gram.nuisance, np.concatenate(others), own)
        return bool(np.any(spanned > self.thresholds.collinear_share))

    def _is_there(
        self, hypothesis: Hypothesis, base: Index, gain: Gain, chosen: Sequence[Hypothesis]
    ) -> bool:
        """Return whether a hypothesis, or something that explains less of the same, surely is."""
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
        """Return a pair on one element instead of what was chosen one by one, if it is better."""
        kept = [h for h in chosen if self.fits.is_negligible(h, chosen)]
        return pair_instead(self.fits, self.significance, chosen, kept, self._free(kept)) or chosen

    def _begin(self, hypothesis: Hypothesis) -> None:
        """Let the hypothesis's columns act from its onset on henceforth."""
        if hypothesis.onset:
            own = self.fits.own_columns(hypothesis)
            self.gram.delay(own, hypothesis.onset)
            self.sums.delay(own, hypothesis.onset)

    def _best(self, chosen: Sequence[Hypothesis]) -> Hypothesis | None:
        base = self.fits.columns(chosen)
        free = self._free(chosen)
        gains = self.sums.gains_beyond(base, [self._of(c) for c in free])
        likely = screened(free, gains, self.thresholds.screened_effects)
        scopes = [h for c in likely for h in self.scopes.of(c, free, base)]
        late = [d for h in scopes for d in self._late(h, free, base)]
        best = self._surest([*scopes, *late], chosen, base)
        if best is None:
            return None
        with self.fits.delayed(best):
            rivals = self._rivals(best, free, base)
            found = simplest(self.fits, best, rivals, base, chosen)
        with self.fits.delayed(found):
            return self.scopes.pruned(found, base)

    def _free(self, chosen: Sequence[Hypothesis]) -> list[Candidate]:
        """Return what may be added: no effect twice on an element, nor of two shapes."""
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
        """Return what gains most in blocks that were not fitted, of what is surely there.

        More elements, and a beginning, have to be worth it.
        """
        before, limits = self.sums.held_out(base), self.thresholds
        best: tuple[Array, Hypothesis] | None = None
        for hypothesis in hypotheses:
            with self.fits.delayed(hypothesis):
                gained = self._sure_gain(hypothesis, chosen, base, before)
            if gained is None:
                continue
            needed = boldness(hypothesis, thresholds=limits) * gain_of(gained).error
            if best is not None:
                spread = is_spread(best[1], hypothesis, limits)
                wider = is_wider(hypothesis, best[1]) and not spread
                least = best[0].sum() + limits.wider_scope_sigma * gain_of(gained).error * wider
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
        """Yield the hypothesis from its onset on, if it seems to have one.

        Of the effect's shapes the one that explains most from its onset on.
        """
        # A wrong number of the file is always one.
        if is_number(hypothesis):
            return
        first = self.thresholds.blocks_before_onset
        last = self.sums.blocks - self.thresholds.blocks_after_onset
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
        """Return what a hypothesis gains in each block, not fitted to it, if it surely does."""
        together = [*chosen, hypothesis]
        if not self.fits.is_plausible(together) or self.fits.contradicts(hypothesis, chosen):
            return None
        gained = before - self.fits.held_out(hypothesis, base)
        known = len(chosen)
        return (
            gained if self.significance.counts(base, hypothesis, gain_of(gained), known) else None
        )

    def _rivals(
        self, hypothesis: Hypothesis, free: Sequence[Candidate], base: Index
    ) -> list[Hypothesis]:
        return rivals_of(self.gram, self.sums, base, hypothesis, free)

    def judged_again(self, finding: Finding, chosen: Sequence[Hypothesis]) -> Finding:
        """Return a finding beside what is left of what was found, with what explains the same now.

        What was given up says no more what the finding is, and may be what it is.
        """
        again = self._judged(finding.hypothesis, chosen)
        known = {rival.words for rival in finding.alternatives}
        further = (rival for rival in again.alternatives if rival.words not in known)
        alternatives = (*finding.alternatives, *further)
        return replace(finding, gain=again.gain, share=again.share, alternatives=alternatives)

    def _judged(self, hypothesis: Hypothesis, chosen: Sequence[Hypothesis]) -> Finding:
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
        """Return free functions of what hypotheses leave; see `unexplained`.

        Nor is what sound clocks may have done beside them unknown, though it be no gain elsewhere:
        clocks wander, and what they did in one part of a recording does not foretell another.
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
        return bool(self.sums.excited[self._of(candidate)].all())

    def _of(self, term: Candidate | Driver) -> Index:
        return self.gram.columns_of([term])
