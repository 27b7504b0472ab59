"""What was found as a model: its parameters, its beginnings, and what simulation says of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.finding import Finding, HoldOut, Onset, Rejection, Status
from cspm_ident.diagnosis.parameter import Coefficients
from cspm_ident.diagnosis.regression.coefficients import Weights
from cspm_ident.diagnosis.regression.hypothesis import (
    Hypothesis,
    bounded,
    is_constant,
    is_number,
    is_seen_to_begin,
    is_seen_to_end,
    may_be_negligible,
    may_be_none,
    members_of,
)
from cspm_ident.diagnosis.regression.parameter_estimates import (
    of_clocks,
    of_drives,
    of_forms,
    of_shafts,
)
from cspm_ident.diagnosis.residuals.corrected_measurement import is_possible, nearest_possible
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation, steady
from cspm_ident.diagnosis.selection.onset import onset_of
from cspm_ident.diagnosis.selection.refinement import Cut, needs_refining, refine, spectra
from cspm_ident.diagnosis.selection.search import Search
from cspm_ident.diagnosis.thresholds import Thresholds
from cspm_ident.diagnosis.validation.holdout_degradation import harm, squares_left
from cspm_ident.diagnosis.validation.holdout_simulation import (
    Baselines,
    SimulatedFit,
    improvement_by,
    simulate_held_out,
)
from cspm_ident.signals.measurement import Measurement

Array = NDArray[np.float64]
Parts = Sequence[Sequence[Equation]]


class Data(NamedTuple):
    """What a model is fitted to and judged by.

    Attributes:
        searched: the recordings, of which `searched_part` was searched.
        searched_part: cuts their equations.
        baselines: simulations of what was not searched.
        rows: of what was searched, in units of their noise.
        noise: of each residual.
        block: length of the blocks [s].
        assumed: about what they were taken to first order.
    """

    searched: Sequence[Measurement]
    searched_part: Cut
    baselines: Baselines
    rows: Parts
    noise: dict[Place, Array]
    block: float
    assumed: Mapping[Candidate, Array]


class Assessment(NamedTuple):
    """A finding in a model, and what speaks against it.

    Attributes:
        finding: with its coefficients, onset, and improvement of simulations; negligible where it
            may be no larger than in a healthy machine.
        is_possible: whether a machine can have it, it is seen to begin where it does not act all
            the time, and its memory is seen to end.
        is_insignificant: whether all its coefficients may be zero, and it is not negligible.
        needed: below which share of its value without the finding a simulated error has to fall.
        degradation: squares by which it raises held-out residuals; 0 where it does not.
    """

    finding: Finding
    is_possible: bool = True
    is_insignificant: bool = False
    needed: float = 1.0
    degradation: float = 0.0

    @property
    def excess(self) -> float:
        """By how much the simulated error is larger than needed; −∞ where none depends on it."""
        gained = self.finding.improvement
        return -np.inf if gained is None else gained.with_it / gained.without - self.needed

    def rejected(self, reason: Rejection) -> Finding:
        """Return the finding, rejected."""
        return replace(self.finding, status=Status.REJECTED, rejection=reason)


class Model(NamedTuple):
    """What was found as a model.

    Attributes:
        assessments: of the findings, in their order.
        weights: of all candidates, with half the widths of their 95 % intervals.
        simulated: held-out data with it, quantity by quantity; empty if a finding is untenable.
    """

    assessments: tuple[Assessment, ...]
    weights: Weights
    simulated: tuple[SimulatedFit, ...] = ()

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What it consists of."""
        return tuple(each.finding for each in self.assessments)

    @property
    def untenable(self) -> list[Finding]:
        """What goes whatever held-out data show: what is impossible, else the least significant.

        With any of them there is no simulation.
        """
        impossible = [each for each in self.assessments if not each.is_possible]
        if impossible:
            return [each.rejected(Rejection.IMPOSSIBLE) for each in impossible]
        unsure = [each for each in self.assessments if each.is_insignificant]
        return [each.rejected(Rejection.INSIGNIFICANT) for each in unsure[-1:]]

    @property
    def useless(self) -> list[Finding]:
        """What goes: what is untenable, else what degrades most, else what improves nothing."""
        if self.untenable or not self.assessments:
            return self.untenable
        worst = max(self.assessments, key=lambda each: each.degradation)
        if worst.degradation:
            return [worst.rejected(Rejection.DEGRADES_HOLDOUT)]
        worst = max(self.assessments, key=lambda each: each.excess)
        return [worst.rejected(Rejection.NO_IMPROVEMENT)] if worst.excess > 0.0 else []


def modelled(search: Search, kept: Sequence[Finding], data: Data) -> Model:
    """Return the model that findings make.

    Args:
        search: in which they were found.
        kept: the findings.
        data: to which parameters are fitted and by which the model is judged.
    """
    limits = search.thresholds
    onsets = _onsets(kept, steady(data.rows), search.gram.times, limits)
    since = max((onset.time for onset in onsets if onset is not None), default=-np.inf)
    weights, upper_ends = _fitted(search, kept, data, since)
    negligible = [_may_be_negligible(each, weights) for each in kept]
    weights = of_clocks(of_drives(weights, 2.0 * data.searched[0].torque_age))
    weights = {
        c: (_allowed(data.searched[0], c, own, half), half) for c, (own, half) in weights.items()
    }
    zero = [_is_insignificant(each.hypothesis, weights) for each in kept]
    weights = of_forms(weights, _untrue(search, kept, weights), limits)
    assessments = []
    for each, onset, small, none in zip(kept, onsets, negligible, zero, strict=True):
        own = {c: weights[c] for c in members_of(weights, each.hypothesis)}
        status = Status.NEGLIGIBLE if small else each.status
        fitted = tuple(Coefficients(c, *of, upper_ends.get(c)) for c, of in own.items())
        finding = replace(each, status=status, onset=onset, coefficients=fitted)
        possible = _is_possible(each.hypothesis, own, data.searched[0], limits)
        needed = _needed(each, limits)
        assessments.append(Assessment(finding, possible, none and not small, needed))
    if any(each.is_insignificant or not each.is_possible for each in assessments):
        return Model(tuple(assessments), weights)
    return _simulated(assessments, weights, data, limits)


def _fitted(
    search: Search, kept: Sequence[Finding], data: Data, since: float
) -> tuple[Weights, dict[Candidate, Array]]:
    """Return weights from some instant [s] on, and upper ends over all time constants."""

    def cut(parts: Parts) -> Parts:
        return [[e.within(since, np.inf) for e in part] for part in data.searched_part(parts)]

    rows = [[e.within(since, np.inf) for e in part] for part in data.rows]
    weights = _parameters(search, kept, data, cut, rows)
    return weights, _in_all(kept, weights, data, cut, search.thresholds)


def _may_be_negligible(finding: Finding, weights: Weights) -> bool:
    own = members_of(weights, finding.hypothesis)
    return may_be_negligible({c: weights[c] for c in own})


def _is_possible(
    hypothesis: Hypothesis, own: Weights, measured: Measurement, thresholds: Thresholds
) -> bool:
    """Return whether a machine can have such weights, and data show where they begin and end."""
    return (
        is_possible(measured, {c: weights for c, (weights, _) in own.items()})
        and is_seen_to_begin(hypothesis, own)
        and is_seen_to_end(own, thresholds)
    )


def _simulated(
    assessments: Sequence[Assessment], weights: Weights, data: Data, thresholds: Thresholds
) -> Model:
    """Return a model of tenable findings with what simulations of held-out data show of each.

    What a healthy machine has too is too small to improve any, and there nevertheless.
    """
    values = {c: w for c, (w, _) in weights.items()}
    simulated = simulate_held_out(data.baselines, values)

    def left(found: Mapping[Candidate, Array]) -> dict[Place, Array]:
        return squares_left(data.baselines, found, data.noise, data.block, thresholds)

    every = left(values)
    judged = []
    for each in assessments:
        if each.finding.status is not Status.NEGLIGIBLE:
            own = {own.candidate for own in each.finding.coefficients}
            improvement = improvement_by(data.baselines, simulated, values, own)
            without = left({c: w for c, w in values.items() if c not in own})
            worse = harm(without, every, thresholds)
            finding = replace(each.finding, improvement=improvement)
            each = each._replace(finding=finding, degradation=worse)
        judged.append(each)
    return Model(tuple(judged), weights, simulated)


def _is_insignificant(hypothesis: Hypothesis, weights: Weights) -> bool:
    """Return whether all numbers of a finding may be zero, together with what else was found.

    What saturates and has hardly acted is there, though nothing is known of where it ends; and a
    reading's zero is the mean of what drifts in it, which is there as well.
    """
    effect, own = hypothesis.effect, {c: weights[c] for c in members_of(weights, hypothesis)}
    drifts = effect.physics.sense is not None and is_constant(effect)
    return may_be_none(own) and not effect.signature.saturates and not drifts


def _needed(finding: Finding, thresholds: Thresholds) -> float:
    """Return below which share of its value without a finding a simulated error has to fall.

    A simulation from motor angles hardly feels a number of the file that is off by little, and it
    may be ruled by something else that is not right, as where an open loop resonates: what takes
    most of a residual need not show there as well.
    """
    if finding.holdout is HoldOut.DOMINANT:
        return np.inf
    lenient = finding.is_faint or is_number(finding.hypothesis)
    return 1.0 if lenient else thresholds.useful_error_share


def _allowed(measured: Measurement, candidate: Candidate, weights: Array, half: Array) -> Array:
    """Return weights moved to what catalogue and machine allow, where chance took them off."""
    return nearest_possible(measured, candidate, bounded(candidate, weights, half), half)


def _parameters(
    search: Search,
    kept: Sequence[Finding],
    data: Data,
    cut: Cut,
    rows: Parts,
) -> Weights:
    """Return the weights of what was kept, refined where columns depend on them."""
    hypotheses = [each.hypothesis for each in kept]
    if any(needs_refining(hypothesis.effect) for hypothesis in hypotheses):
        given = data.noise, data.block, cut, data.assumed, search.thresholds
        return refine(data.searched, hypotheses, *given)
    return of_shafts(search.fits.weights(hypotheses), rows, data.block, search.thresholds)


def _in_all(
    kept: Sequence[Finding], weights: Weights, data: Data, cut: Cut, thresholds: Thresholds
) -> dict[Candidate, Array]:
    """Return how large findings may be that have parts with other time constants."""
    hypotheses = [each.hypothesis for each in kept]
    given = data.noise, data.block, cut, data.assumed, thresholds
    return spectra(data.searched, hypotheses, weights, *given)


def _untrue(
    search: Search, kept: Sequence[Finding], found: Iterable[Candidate]
) -> dict[Candidate, float]:
    """Return by what share of its amplitude each candidate is seen to be off, of final shapes."""
    hypotheses, final = [each.hypothesis for each in kept], list(found)
    shares: dict[Candidate, float] = {}
    for each in hypotheses:
        own = search.fits.model_form_error(each, [h for h in hypotheses if h is not each])
        by_element = {candidate.element: share for candidate, share in own.items()}
        shares |= {c: by_element[c.element] for c in members_of(final, each)}
    return shares


def _onsets(
    kept: Sequence[Finding], rows: Parts, starts: Array, thresholds: Thresholds
) -> tuple[Onset | None, ...]:
    """Return when each finding began; None where it acts all the time, or in which recording."""
    times = {
        c: float(starts[each.hypothesis.onset]) if each.hypothesis.onset else -np.inf
        for each in kept
        for c in each.hypothesis.candidates
    }
    found: list[Onset | None] = []
    for each in kept:
        block, own = each.hypothesis.onset, each.hypothesis.candidates
        if not block or len(rows) > 1:
            found.append(None)
            continue
        others = {c: time for c, time in times.items() if c not in own}
        low, high = starts[max(block - 2, 0)], starts[min(block + 2, len(starts) - 1)]
        found.append(onset_of(rows[0], own, others, float(low), float(high), thresholds))
    return tuple(found)
