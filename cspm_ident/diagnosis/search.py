"""Which effects explain the residuals, what else would, and what nothing in the catalogue does."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from copy import copy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.absorbed import absorbed_pairs
from cspm_ident.diagnosis.columns import Candidate
from cspm_ident.diagnosis.drivers import Driver
from cspm_ident.diagnosis.evidence import Evidence
from cspm_ident.diagnosis.hypothesis import (
    Findings,
    Hypothesis,
    Named,
    Rival,
    Unknown,
    bounded,
    freedom,
    is_allowed,
    is_negligible,
    is_tied,
    is_wider,
    joined,
    parts_of,
    shapes_of,
)
from cspm_ident.diagnosis.likeness import (
    RIVAL_SHARE,
    TIED,
    UNTRUE_SHARE,
    contains,
    distance,
    freely_gained,
)
from cspm_ident.diagnosis.rivals import rivals_of
from cspm_ident.diagnosis.short_list import short_list
from cspm_ident.diagnosis.sums import Sums, behind, gain_of, paired
from cspm_ident.diagnosis.sureness import MATERIAL_SHARE, Sureness
from cspm_ident.diagnosis.unexplained import unexplained
from cspm_ident.diagnosis.weights import Weights, values_of, weights_of
from cspm_sim.effects import Effect

Array = NDArray[np.float64]
Index = NDArray[np.intp]

MOST_EFFECTS = 3
# In which an effect has to act to be told.
_FEWEST_BLOCKS = 10
# Standard errors by which a beginning has to explain more than an effect that was always there.
_SIGMAS = 2.0


class Search:
    """Looks through a catalogue for what explains the residuals of some recordings."""

    def __init__(
        self,
        evidence: Evidence,
        progress: Callable[[str], None] = lambda _: None,
        sums: Callable[[Evidence], Sums] = Sums,
    ) -> None:
        """Take the sums of all residuals, of which `sums` tells what is sure."""
        self.evidence = evidence
        self.sums = sums(evidence)
        self._progress = progress
        self._effects = [c for c in evidence.terms if isinstance(c, Candidate) and self._shows(c)]
        self.sureness = Sureness(evidence, self.sums, self._effects)

    def run(self) -> Findings:
        """Choose effects one by one, each with all elements on which it surely acts."""
        chosen = self._chosen()
        named = [self._judged(k, chosen) for k in range(len(chosen))]
        named.sort(key=lambda each: -each.gain.total)
        self._progress("what is left")
        return Findings(tuple(named), self.unknown(chosen), len(self._effects))

    @property
    def heard(self) -> tuple[Candidate, ...]:
        """Candidates whose columns are not zero."""
        return tuple(self._effects)

    def retuned(self) -> dict[Candidate, Array]:
        """Return the weights of the file's own parameters, fitted where it helps, nothing added."""
        narrow = copy(self)
        narrow._effects = [c for c in self._effects if c.effect.alter is not None]
        narrow.sureness = Sureness(self.evidence, self.sums, narrow._effects)
        own = [c for h in narrow._chosen(onsets=False) for c in h.candidates]
        return self.evidence.parted(own, self.sums.weights(self.evidence.with_nuisance(own)))

    def columns(self, hypotheses: Iterable[Hypothesis]) -> Index:
        """Return indices of the nuisance and of some hypotheses' columns."""
        return self.evidence.with_nuisance(c for h in hypotheses for c in h.candidates)

    def own_columns(self, hypothesis: Hypothesis) -> Index:
        """Return indices of one hypothesis's columns."""
        return self.evidence.columns_of(hypothesis.candidates)

    def weights(self, hypotheses: Sequence[Hypothesis]) -> Weights:
        """Return the weights of hypotheses that are fitted together, with half their intervals."""
        return weights_of(self.evidence, self.sums, *parts_of(hypotheses))

    def values(self, hypotheses: Sequence[Hypothesis]) -> dict[Candidate, Array]:
        """Return the weights alone, which takes less time."""
        return values_of(self.evidence, self.sums, *parts_of(hypotheses))

    def _chosen(self, *, onsets: bool = True) -> list[Hypothesis]:
        chosen: list[Hypothesis] = []
        while sum(not self._is_negligible(h, chosen) for h in chosen) < MOST_EFFECTS:
            self._progress(f"effect {len(chosen) + 1}")
            found = self._best(chosen)
            if found is None:
                break
            chosen = joined(chosen, self._begun(found, chosen) if onsets else found)
        # What was chosen first did not know of the others.
        for hypothesis in tuple(chosen):
            others = [h for h in chosen if h is not hypothesis]
            base, k = self.columns(others), chosen.index(hypothesis)
            chosen[k] = self._pruned(hypothesis, base)
            if self.sums.gain(base, self.own_columns(chosen[k])).total <= 0.0:
                del chosen[k]
        return chosen

    def _is_negligible(self, hypothesis: Hypothesis, chosen: Sequence[Hypothesis]) -> bool:
        """Return whether a sound machine has as much of it, so that it counts for no effect."""
        found = self.values(chosen)
        return is_negligible({c: found[c] for c in hypothesis.candidates})

    def _begun(self, hypothesis: Hypothesis, chosen: Sequence[Hypothesis]) -> Hypothesis:
        """Return the hypothesis with its onset, from which on its columns act henceforth."""
        own, onset = self.own_columns(hypothesis), hypothesis.onset
        if not onset and _may_begin(hypothesis.effect):
            onset, _ = self._onset(self.columns(chosen), own)
        if onset:
            self.evidence.delay(own, onset)
            self.sums.delay(own, onset)
        return replace(hypothesis, onset=onset)

    def _best(self, chosen: Sequence[Hypothesis]) -> Hypothesis | None:
        base = self.columns(chosen)
        taken = {(c.effect_id, c.element) for h in chosen for c in h.candidates}
        free = [c for c in self._effects if (c.effect_id, c.element) not in taken]
        gains = self.sums.gains_beyond(base, [self._of(c) for c in free])
        scopes = [h for c in short_list(free, gains) for h in self._scopes(c, free, base)]
        late = [d for h in scopes for d in self._late(h, free, base)]
        best = self._surest([*scopes, *late], chosen, base)
        if best is None:
            return None
        with self._delayed(best):
            found = self._simplest(best, free, base, chosen)
        with self._delayed(found):
            return self._pruned(found, base)

    def _surest(
        self, hypotheses: Iterable[Hypothesis], chosen: Sequence[Hypothesis], base: Index
    ) -> Hypothesis | None:
        """Return what gains most in blocks that were not fitted, of what is surely there.

        More elements, and a beginning, have to be worth it.
        """
        before = self.sums.held_out(base)
        best: tuple[Array, Hypothesis] | None = None
        for hypothesis in hypotheses:
            with self._delayed(hypothesis):
                gained = self._sure_gain(hypothesis, chosen, base, before)
            if gained is None:
                continue
            needed = 0.0
            if best is not None:
                wider = is_wider(hypothesis, best[1])
                needed = best[0].sum() + 3.0 * gain_of(gained).error * wider
                if _is_bolder(hypothesis, best[1]):
                    needed = best[0].sum() + _SIGMAS * gain_of(gained - best[0]).error
            if best is None or gained.sum() > needed:
                best = gained, hypothesis
        return None if best is None else best[1]

    def _late(
        self, hypothesis: Hypothesis, free: Sequence[Candidate], base: Index
    ) -> Iterable[Hypothesis]:
        """Yield the hypothesis from its onset on, if it seems to have one.

        Of the effect's shapes the one that explains most from its onset on.
        """
        if not _may_begin(hypothesis.effect):
            return
        late: list[tuple[float, Hypothesis]] = []
        for shape in shapes_of(hypothesis, free):
            onset, left = self._onset(base, self.own_columns(shape))
            if 0 < onset <= self.sums.blocks - _FEWEST_BLOCKS:
                late.append((left, replace(shape, onset=onset)))
        if late:
            yield min(late, key=lambda each: each[0])[1]

    def _sure_gain(
        self, hypothesis: Hypothesis, chosen: Sequence[Hypothesis], base: Index, before: Array
    ) -> Array | None:
        """Return what a hypothesis gains in each block, not fitted to it, if it surely does."""
        if not self._is_plausible([*chosen, hypothesis]):
            return None
        gained = before - self._held_out(hypothesis, base)
        return gained if self.sureness.counts(base, hypothesis, gain_of(gained)) else None

    def _and(self, base: Index, further: Hypothesis | None) -> Index:
        """Return a base with a hypothesis's columns, if there is one."""
        return base if further is None else np.concatenate([base, self.own_columns(further)])

    def _held_out(self, hypothesis: Hypothesis, base: Index) -> Array:
        """Return Σ residual² of each block beside a hypothesis that was not fitted to it."""
        if not hypothesis.common:
            return self.sums.held_out(np.concatenate([base, self.own_columns(hypothesis)]))
        sums, base, own = self.sureness.shared(base, hypothesis)
        return sums.held_out(np.concatenate([base, own]))

    @contextmanager
    def _delayed(self, hypothesis: Hypothesis) -> Iterator[None]:
        """Let a hypothesis act from its onset on, for a while."""
        if not hypothesis.onset:
            yield
            return
        own = self.own_columns(hypothesis)
        with (
            self.sums.delayed(own, hypothesis.onset),
            self.evidence.delayed(own, hypothesis.onset),
        ):
            yield

    def _pruned(self, hypothesis: Hypothesis, base: Index) -> Hypothesis:
        """Return the hypothesis without elements on which the effect may as well be absent."""
        if hypothesis.common:
            return hypothesis
        own_columns = self.own_columns(hypothesis)
        weights = self.sums.weights(np.concatenate([base, own_columns]))[len(base) :]
        sizes = np.abs(weights) / self.sums.half_width(base, own_columns)
        own = self.evidence.parted(hypothesis.candidates, sizes)
        kept = tuple(c for c in hypothesis.candidates if own[c].max() > 1.0)
        return replace(hypothesis, candidates=kept) if kept else hypothesis

    def _scopes(
        self, candidate: Candidate, free: Sequence[Candidate], base: Index
    ) -> list[Hypothesis]:
        """Return the candidate's effect where it surely acts, and on all elements together.

        What is too little to see in any one element may be plain in all of them, with the same
        numbers or with others for each.
        """
        alike = [
            c for c in free if c.effect_id == candidate.effect_id and c.shape == candidate.shape
        ]
        whole = Hypothesis(candidate.effect, tuple(alike))
        own = self._extended(candidate, alike, base)
        if len(alike) == 1:
            return [own]
        common = replace(whole, common=True)
        if len(own.candidates) < len(alike):
            return [own, common, whole]
        return [common, own] if _has_one_system(own) else [own]

    def _extended(
        self, candidate: Candidate, alike: Sequence[Candidate], base: Index
    ) -> Hypothesis:
        """Return the candidate's effect on all elements where it surely acts beside the others."""
        found, sure = [candidate], self.sureness
        others = [c for c in alike if c.element != candidate.element]
        gains = self.sums.gains_beyond(base, [self._of(c) for c in others])
        for k in np.argsort(-gains):
            beside = np.concatenate([base, self.evidence.columns_of(found)])
            further = Hypothesis(candidate.effect, (others[k],))
            if sure.counts(beside, further, self.sums.gain(beside, self._of(others[k]))):
                found.append(others[k])
        return Hypothesis(candidate.effect, tuple(c for c in alike if c in found))

    def _simplest(
        self,
        best: Hypothesis,
        free: Sequence[Candidate],
        base: Index,
        chosen: Sequence[Hypothesis],
    ) -> Hypothesis:
        """Return the hypothesis of fewest numbers, or elements, that is no worse than the best one.

        One that explains more in most blocks is taken instead, though it be less sure by itself.
        """
        rivals = [h for h in self._rivals(best, free, base) if self._is_plausible([*chosen, h])]
        reference = self._held_out(best, base)
        gained = gain_of(self.sums.held_out(base) - reference)
        fewest, least = best, 0.0
        for rival in rivals:
            with self.sums.delayed(self.own_columns(rival), best.onset):
                apart = self._held_out(rival, base) - reference
            worse, wider = gain_of(apart), freedom(rival) - freedom(fewest)
            fewer = is_wider(fewest, rival)
            if wider <= 0 and worse.total < least and behind(paired(apart)) <= -TIED:
                fewest, least = replace(rival, onset=best.onset), worse.total
            elif (wider < 0 or (wider == 0 and fewer)) and worse.total <= min(
                2.0 * gained.error, MATERIAL_SHARE * gained.total
            ):
                fewest = replace(rival, onset=best.onset)
        return fewest

    def _rivals(
        self, hypothesis: Hypothesis, free: Sequence[Candidate], base: Index
    ) -> list[Hypothesis]:
        return rivals_of(self.evidence, self.sums, base, hypothesis, free)

    def _judged(self, k: int, chosen: Sequence[Hypothesis]) -> Named:
        hypothesis, others = chosen[k], [h for i, h in enumerate(chosen) if i != k]
        base, own = self.columns(others), self.own_columns(hypothesis)
        gain = self.sums.gain(base, own)
        return Named(
            hypothesis,
            gain,
            self.sureness.share(base, own),
            tuple(self._alternatives(hypothesis, others, base, own)),
        )

    def _alternatives(
        self, hypothesis: Hypothesis, others: Sequence[Hypothesis], base: Index, own: Index
    ) -> Iterable[Rival]:
        """Yield what explains the same nearly as well, the chosen one taken out.

        A difference that models are too untrue for counts as much less, and every further parameter
        as in Schwarz's criterion, blocks being what there is to tell it from.
        """
        taken = {(c.effect_id, c.element) for h in others for c in h.candidates}
        free = [c for c in self._effects if (c.effect_id, c.element) not in taken]
        reference = self._held_out(hypothesis, base)
        gained = float(np.sum(self.sums.held_out(base) - reference))
        undecided = max(UNTRUE_SHARE * gained, freely_gained(self.evidence, self.sums, base, own))
        for rival, beside in self._alike(hypothesis, free, base):
            supposed = [rival] if beside is None else [rival, beside]
            columns = self.evidence.columns_of(c for h in supposed for c in h.candidates)
            wider = max(0, sum(map(freedom, supposed)) - freedom(hypothesis))
            nested = wider and beside is None and contains(self.sums, base, columns, own)
            if nested or not self._is_plausible([*others, *supposed]):
                continue
            beyond = self._and(base, beside)
            with self.sums.delayed(np.setdiff1d(columns, own), hypothesis.onset):
                worse = self._held_out(rival, beyond) - reference
            if worse.sum() > RIVAL_SHARE * gained:
                continue
            apart = distance(worse, undecided, wider)
            if apart <= TIED:
                yield Rival(rival, apart, beside)

    def _alike(
        self, hypothesis: Hypothesis, free: Sequence[Candidate], base: Index
    ) -> Iterable[tuple[Hypothesis, Hypothesis | None]]:
        """Yield what explains the same, alone or beside a wrong number of the file."""
        rivals = self._rivals(hypothesis, free, base)
        yield from ((rival, None) for rival in rivals)
        alone = {rival.effect.id for rival in rivals}
        for pair in absorbed_pairs(self.evidence, self.sums, base, hypothesis, free):
            if pair[0].effect.id not in alone:
                yield pair

    def _is_plausible(self, hypotheses: Sequence[Hypothesis]) -> bool:
        """Return whether parameters are what the catalogue allows, but for chance."""
        values = self.values(hypotheses)
        if all(is_allowed(c, own) and not c.effect.tied for c, own in values.items()):
            return True
        found = self.weights(hypotheses)
        return all(
            is_allowed(c, bounded(c, own, half)) and (not c.effect.tied or is_tied(c, own, half))
            for c, (own, half) in found.items()
        )

    def _onset(self, base: Index, own: Index) -> tuple[int, float]:
        """Return the block from which on columns act, and what is left then.

        The block is 0 unless a later one is surely better.
        """
        left = self.sums.left_from(base, own)[:-2]
        best = int(np.argmin(left))
        gained = self.sums.squares_of(base) - left[0]
        if left[best] < left[0] - MATERIAL_SHARE * max(gained, 0.0):
            return best, float(left[best])
        return 0, float(left[0])

    def unknown(self, chosen: Sequence[Hypothesis]) -> tuple[Unknown, ...]:
        """Return free functions of what some hypotheses leave, the most important first."""
        return unexplained(self.evidence, self.sums, self.sureness, chosen)

    def _shows(self, candidate: Candidate) -> bool:
        return bool(self.sums.excited[self._of(candidate)].all())

    def _of(self, term: Candidate | Driver) -> Index:
        return self.evidence.columns_of([term])


def _may_begin(effect: Effect) -> bool:
    """Return whether an effect may be absent at first; a wrong number of the file is always one."""
    return effect.alter is None


def _is_bolder(one: Hypothesis, other: Hypothesis) -> bool:
    """Return whether one has a beginning, or an unlikely extent, and another has not.

    One number for all elements is unlikely unless one system reads them; then it is for a part of
    them.
    """
    if one.onset and not other.onset:
        return True
    return one.common != other.common and one.common is not _has_one_system(one)


def _has_one_system(hypothesis: Hypothesis) -> bool:
    """Return whether one system reads all that an effect can act on."""
    sense = hypothesis.effect.sense
    return sense is not None and sense.one_system
