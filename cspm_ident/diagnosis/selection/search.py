"""Search of a catalogue for the effects that explain the residuals of some recordings.

Residual by residual, every subset of the hypotheses that act there is scored by its predictions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.finding import Finding, Reason, Status, Unexplained
from cspm_ident.diagnosis.regression.block_gram import BlockGram, PlaceGram
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.regression.hypothesis import (
    Hypothesis,
    Rival,
    has_one_system,
    is_allowed,
    is_early,
    is_negligible,
    is_number,
    is_timing,
    joined,
)
from cspm_ident.diagnosis.regression.joint_fit import Fits
from cspm_ident.diagnosis.regression.significance import Significance
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.selection.model_set import Model, ModelSet, Weights, model_set
from cspm_ident.diagnosis.selection.onset import first_block
from cspm_ident.diagnosis.selection.presence import exchanged, is_missed, spread
from cspm_ident.diagnosis.selection.screening import gains_of, screened
from cspm_ident.diagnosis.selection.search_result import SearchResult
from cspm_ident.diagnosis.selection.unexplained import unexplained
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds

Array = NDArray[np.float64]
Index = NDArray[np.intp]

# Hypotheses about a residual that may begin late, the most promising ones.
_LATE = 4


class Choice(NamedTuple):
    """The model that was chosen for one residual, and those that predict as well.

    Attributes:
        model: the chosen one.
        models: with it those that predict as well.
        place: the residual; None for clock errors of healthy size.
    """

    model: Model
    models: ModelSet
    place: PlaceGram | None = None


class Search:
    """Searches a catalogue for the effects that explain the residuals of some recordings."""

    def __init__(
        self,
        gram: BlockGram,
        progress: Callable[[str], None] = lambda _: None,
        thresholds: Thresholds = DEFAULT_THRESHOLDS,
        banned: Sequence[Hypothesis] = (),
    ) -> None:
        """Store the Gram matrices of all residuals; `progress` receives the name of each step.

        Hypotheses that are `banned` are not searched.
        """
        self.thresholds, self._progress = thresholds, progress
        self.fits = Fits(gram, BlockRegression(gram, thresholds))
        self._banned, self._undelayed = banned, self.fits
        self._look_for([c for c in gram.terms if isinstance(c, Candidate) and self._shows(c)])

    def _look_for(self, candidates: Sequence[Candidate]) -> None:
        self._effects = candidates
        self.significance = Significance(self.fits, candidates)

    @property
    def gram(self) -> BlockGram:
        """Block Gram matrices, in which selected effects act from their onsets on."""
        return self.fits.gram

    @property
    def sums(self) -> BlockRegression:
        """The regression on these."""
        return self.fits.sums

    @property
    def heard(self) -> tuple[Candidate, ...]:
        """Candidates whose columns are not zero."""
        return tuple(self._effects)

    def run(self) -> SearchResult:
        """Return the effects of the models of all residuals, their ties and what is unexplained."""
        choices = self._choices()
        chosen = _together(choices)
        for each in chosen:
            if each.onset:
                self.fits = self.fits.delayed(each)
        self._look_for(self._effects)
        found = [self._finding(each, chosen, choices) for each in chosen]
        found.sort(key=lambda each: -each.gain.total)
        self._progress("what is left")
        return SearchResult(tuple(found), self.unexplained(chosen), len(self._effects))

    def without(self, banned: Sequence[Hypothesis]) -> Search:
        """Return the search as it was before it ran, without some hypotheses."""
        other = copy(self)
        other.fits, other._banned = self._undelayed, banned
        other._look_for(self._effects)
        return other

    def retuned(self) -> dict[Candidate, Array]:
        """Return fitted weights of the test-bed file's own parameters, without any added effect."""
        narrow = copy(self)
        narrow._progress = lambda _: None
        narrow._look_for([c for c in self._effects if c.effect.physics.alter is not None])
        own = [c for h in _together(narrow._choices()) for c in h.candidates]
        return self.gram.parted(own, self.sums.weights(self.gram.with_nuisance(own)))

    def finding_of(self, hypothesis: Hypothesis, chosen: Sequence[Hypothesis]) -> Finding:
        """Return a finding with its gain and share beside other hypotheses."""
        base = self.fits.columns(h for h in chosen if h is not hypothesis)
        own = self.fits.own_columns(hypothesis)
        gain = self.sums.gain(base, own)
        return Finding(hypothesis, gain, self.significance.share(base, own))

    def unexplained(self, chosen: Sequence[Hypothesis]) -> tuple[Unexplained, ...]:
        """Return the residuals that hypotheses leave unexplained; see `unexplained`."""
        healthy = [h for h in chosen if self.fits.is_negligible(h, chosen)]
        reported = [h for h in chosen if h not in healthy]
        return unexplained(self.gram, self.sums, self.significance, reported, healthy)

    def _choices(self) -> list[Choice]:
        """Return the models of all residuals, each chosen beside those of the others.

        Once all are chosen, each is chosen anew where others came after it.
        """
        choices = self._clocks()
        visited = self._by_gain()
        for k, place in enumerate(visited):
            self._progress(f"residual {k + 1} of {len(visited)}")
            choices += self._choice(place, _together(choices))
        for own in [each for each in choices[:-1] if each.place is not None]:
            assert own.place is not None
            self._progress(f"residual of {own.place.place.element}, beside the others")
            others = [each for each in choices if each is not own]
            choices = [*others, *self._choice(own.place, _together(others))]
        return choices

    def _clocks(self) -> list[Choice]:
        """Return the clock errors of healthy size, on signals that one system reads, if any."""
        clocks = [
            h
            for h in self._on_all(self._effects, 1)
            if has_one_system(h.effect) and h.effect.signature.negligible
        ]

        def is_healthy(_: Sequence[Hypothesis], weights: Weights) -> bool:
            return is_negligible(weights)

        if not clocks:
            return []
        models = model_set(self._undelayed.gram, [], clocks, is_healthy, self.thresholds, 1)
        return [] if models.has_none else [Choice(models.chosen, models)]

    def _by_gain(self) -> list[PlaceGram]:
        """Return the residuals, first that of which one hypothesis alone explains most."""
        gains, gram = [], self._undelayed.gram
        searched = gram.columns_of(self._effects)
        for place in gram.places:
            own = np.flatnonzero(np.isin(place.columns, searched))
            table = place.whole[np.ix_(np.append(own, -1), np.append(own, -1))]
            scale = np.sqrt(np.maximum(np.diag(table), 1e-300))
            scale[-1] = 1.0
            slices = [slice(k, k + 1) for k in range(len(own))]
            gains.append(gains_of(table / (scale[:, None] * scale), slices).max(initial=0.0))
        return [gram.places[k] for k in np.argsort(gains)[::-1]]

    def _choice(self, place: PlaceGram, chosen: Sequence[Hypothesis]) -> list[Choice]:
        """Return the model of a residual beside hypotheses; empty where nothing is needed.

        Where no smaller model is needed, larger ones, which are many, are not tried.
        """
        free = self._free(place, chosen)
        pool = screened(self._undelayed.gram, chosen, free, self.thresholds.screened_candidates)
        given = self._undelayed.gram, chosen
        most = self.thresholds.most_effects
        pool = [*pool, *self._late(pool, chosen), *self._each_alone(pool)]
        pool = [h for h in pool if not self._is_banned(h)]
        small = model_set(*given, pool, self._is_allowed, self.thresholds, most - 1)
        if small.has_none:
            return []
        models = model_set(*given, pool, self._is_allowed, self.thresholds, most)
        model = self._needed(models.chosen, chosen, len(free))
        return [Choice(model, models, place)] if model.hypotheses else []

    def _needed(self, model: Model, chosen: Sequence[Hypothesis], looked_at: int) -> Model:
        """Return a model without what is too small to matter, empty if it may be chance.

        The confidence set compares models, and does not count how many hypotheses were looked at:
        Wald's test of all regressors does, with Bonferroni's correction.
        """
        together, late = [*chosen, *model.hypotheses], self
        for each in together:
            late = late._begun(each)
        least = self.thresholds.material_share
        kept = [h for h in model.hypotheses if late.finding_of(h, together).share >= least]
        own = self.gram.columns_of(c for h in kept for c in h.candidates)
        chance = late.sums.p_value(self.fits.columns(chosen), own) if kept else 1.0
        sure = chance < self.thresholds.false_alarm_rate / max(1, looked_at)
        return model._replace(hypotheses=tuple(kept) if sure else ())

    def _begun(self, own: Hypothesis) -> Search:
        """Return the search with a hypothesis acting from its onset on."""
        if not own.onset:
            return self
        other = copy(self)
        other.fits = self.fits.delayed(own)
        other._look_for(self._effects)
        return other

    def _is_banned(self, own: Hypothesis) -> bool:
        mine = own.effect.key, own.elements, own.common, bool(own.onset)
        return any(
            mine == (b.effect.key, b.elements, b.common, bool(b.onset)) for b in self._banned
        )

    def _free(self, place: PlaceGram, chosen: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Return hypotheses that act on a residual: an effect on one element, or on all at once.

        No effect acts twice on an element, and none with two shapes.
        """
        taken = {(c.effect_id, c.element) for h in chosen for c in h.candidates}
        shapes = {c.effect_id: c.shape for h in chosen for c in h.candidates}
        free = [
            c
            for c in self._effects
            if (c.effect_id, c.element) not in taken and shapes.get(c.effect_id, c.shape) == c.shape
        ]
        here = [
            c for c in free if np.isin(self._undelayed.gram.columns_of([c]), place.columns).any()
        ]
        alone = [Hypothesis(c.effect, (c,)) for c in here]
        known = {(c.effect_id, c.shape) for c in here}
        groups = self._on_all([c for c in free if (c.effect_id, c.shape) in known])
        return [h for h in (*alone, *groups) if not self._is_banned(h)]

    def _on_all(self, candidates: Sequence[Candidate], fewest: int = 2) -> list[Hypothesis]:
        """Return effects on all elements with common parameters, where there are enough."""
        groups: dict[tuple[str, object], list[Candidate]] = {}
        for each in candidates:
            groups.setdefault((each.effect_id, each.shape), []).append(each)
        return [
            Hypothesis(own[0].effect, tuple(own), common=len(own) > 1)
            for own in groups.values()
            if len(own) >= fewest
        ]

    def _each_alone(self, pool: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Return hypotheses with common parameters as such with parameters of each element."""
        return [replace(h, common=False) for h in pool if h.common]

    def _late(self, pool: Sequence[Hypothesis], chosen: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Return the most promising hypotheses with an onset, where one explains more.

        A wrong number of the test-bed file acts all the time.
        """
        first = self.thresholds.onset_blocks
        last = self.sums.blocks - 2 * first
        base, found = self.fits.columns(chosen), []
        for each in [h for h in pool if not is_number(h) and not h.common][:_LATE]:
            onset, _ = first_block(self.sums, base, self.fits.own_columns(each))
            if first <= onset <= last:
                found.append(replace(each, onset=onset))
        return found

    def _is_allowed(self, hypotheses: Sequence[Hypothesis], weights: Weights) -> bool:
        """Return whether the catalogue allows weights, and no reading is newer than its stamp.

        No effect acts twice on an element or with two shapes.
        """
        late = any(is_timing(h.effect) and is_early(weights, h) for h in hypotheses)
        same = len({(c.effect_id, c.element) for c in weights})
        twice = same < sum(len(h.candidates) for h in hypotheses)
        shapes = {(c.effect_id, c.shape) for c in weights}
        several = len(shapes) > len({effect_id for effect_id, _ in shapes})
        possible = all(is_allowed(c, own) for c, own in weights.items())
        return possible and not (late or twice or several)

    def _finding(
        self, own: Hypothesis, chosen: Sequence[Hypothesis], choices: Sequence[Choice]
    ) -> Finding:
        """Return a finding: certain, tied with alternatives, or undecided."""
        found, limits = self.finding_of(own, chosen), self.thresholds
        alternatives: list[Rival] = []
        missed = True
        apart: dict[Candidate, Array] = {}
        for model, models, _ in choices:
            for each in model.hypotheses:
                if _is_part(each, own):
                    alternatives += exchanged(models, model, each, limits)
                    missed &= is_missed(models, model, each, limits)
                    apart |= spread(models, model, each)
        found = replace(found, alternatives=tuple(alternatives), spread=apart)
        if found.share < limits.material_share:
            return replace(found, status=Status.NEGLIGIBLE)
        return found.undecided(Reason.MISSED) if missed else found

    def _shows(self, candidate: Candidate) -> bool:
        excited = self.sums.excited[self.gram.columns_of([candidate])]
        # Of springs at the bar, those along coordinates that rest are left out.
        partly = candidate.effect.signature.shares_noise
        return bool(excited.any() if partly else excited.all())


def _is_part(one: Hypothesis, whole: Hypothesis) -> bool:
    return one.effect.key == whole.effect.key and set(one.candidates) <= set(whole.candidates)


def _together(choices: Sequence[Choice]) -> list[Hypothesis]:
    """Return the hypotheses of all models; those of one effect and onset become one."""
    chosen: list[Hypothesis] = []
    for each in choices:
        for hypothesis in each.model.hypotheses:
            chosen = joined(chosen, hypothesis)
    return chosen
