"""The findings as a model: parameters, onsets, and validation by simulation."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import compress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.finding import Finding, HoldOut, Onset, Rejection, Status
from cspm_ident.diagnosis.parameter import Coefficients
from cspm_ident.diagnosis.regression.coefficients import Weights
from cspm_ident.diagnosis.regression.discrepancy import moved_by_functions
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
    of_scales,
    of_shafts,
)
from cspm_ident.diagnosis.residuals.corrected_measurement import is_possible, nearest_possible
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation, steady
from cspm_ident.diagnosis.selection.onset import onset_of
from cspm_ident.diagnosis.selection.refinement import Cut, needs_refining, refine, spectra
from cspm_ident.diagnosis.selection.search import Search
from cspm_ident.diagnosis.thresholds import Thresholds
from cspm_ident.diagnosis.validation.holdout_degradation import harm, raised, squares_left
from cspm_ident.diagnosis.validation.holdout_simulation import (
    Baselines,
    SimulatedFit,
    improvement_by,
    simulate_held_out,
)
from cspm_ident.diagnosis.validation.materiality import acts_immaterially
from cspm_ident.signals.measurement import Measurement

Array = NDArray[np.float64]
Parts = Sequence[Sequence[Equation]]


class Data(NamedTuple):
    """Data for fitting and validating a model.

    Attributes:
        searched: the recordings, of which `searched_part` was searched.
        searched_part: cuts their equations to that part.
        baselines: simulations of the held-out data.
        rows: equations of the searched data, in units of their noise.
        noise: noise of each residual.
        block: length of the blocks [s].
        assumed: weights about which the equations are linearised.
    """

    searched: Sequence[Measurement]
    searched_part: Cut
    baselines: Baselines
    rows: Parts
    noise: dict[Place, Array]
    block: float
    assumed: Mapping[Candidate, Array]


class Assessment(NamedTuple):
    """A finding in a model, with the reasons against it.

    Attributes:
        finding: with its coefficients, onset, and improvement of simulations; negligible where it
            may be no larger than in a healthy machine.
        is_possible: whether a machine can have it, and data show its onset, if it has one, and the
            end of its memory.
        is_insignificant: whether all its coefficients may be zero, and it is not negligible.
        needed: ratio of simulated errors with and without the finding that it has to reach.
        degradation: squares by which it raises hold-out residuals; 0 where it does not.
    """

    finding: Finding
    is_possible: bool = True
    is_insignificant: bool = False
    needed: float = 1.0
    degradation: float = 0.0

    @property
    def excess(self) -> float:
        """Ratio of simulated errors less the needed one; −∞ where no simulation depends on it."""
        gained = self.finding.improvement
        return -np.inf if gained is None else gained.with_it / gained.without - self.needed

    def rejected(self, reason: Rejection) -> Finding:
        """Return the finding, rejected."""
        return replace(self.finding, status=Status.REJECTED, rejection=reason)


class Model(NamedTuple):
    """The findings as a model.

    Attributes:
        assessments: those of the findings, in their order.
        weights: those of all candidates, with half widths of their 95 % intervals.
        simulated: fits of the held-out data by quantity; empty if a finding is untenable.
    """

    assessments: tuple[Assessment, ...]
    weights: Weights
    simulated: tuple[SimulatedFit, ...] = ()

    @property
    def findings(self) -> tuple[Finding, ...]:
        """The findings of the model, assessed."""
        return tuple(each.finding for each in self.assessments)

    @property
    def values(self) -> dict[Candidate, Array]:
        """The weights without intervals."""
        return {candidate: weight for candidate, (weight, _) in self.weights.items()}

    @property
    def untenable(self) -> list[Finding]:
        """Rejected without held-out data: impossible findings, else the last insignificant one.

        A model with any of them is not simulated.
        """
        impossible = [each for each in self.assessments if not each.is_possible]
        if impossible:
            return [each.rejected(Rejection.IMPOSSIBLE) for each in impossible]
        unsure = [each for each in self.assessments if each.is_insignificant]
        return [each.rejected(Rejection.INSIGNIFICANT) for each in unsure[-1:]]

    @property
    def useless(self) -> list[Finding]:
        """Rejected: untenable findings, else the most degrading one, else one of no improvement."""
        if self.untenable or not self.assessments:
            return self.untenable
        worst = max(self.assessments, key=lambda each: each.degradation)
        if worst.degradation:
            return [worst.rejected(Rejection.DEGRADES_HOLDOUT)]
        worst = max(self.assessments, key=lambda each: each.excess)
        return [worst.rejected(Rejection.NO_IMPROVEMENT)] if worst.excess > 0.0 else []


def modelled(
    search: Search, kept: Sequence[Finding], data: Data, beside: Sequence[Hypothesis] = ()
) -> Model:
    """Return the model of the findings, fitted and validated.

    Args:
        search: the search that found them.
        kept: the findings.
        data: for fitting the parameters and validating the model.
        beside: hypotheses that are fitted beside them, and are not in the model.
    """
    limits = search.thresholds
    onsets = _onsets(kept, steady(data.rows), search.gram.times, limits)
    since = max((onset.time for onset in onsets if onset is not None), default=-np.inf)
    together = [*(each.hypothesis for each in kept), *beside]
    weights, upper_ends = _fitted(search, together, data, since)
    open_ones = {c for each in beside for c in members_of(weights, each)}
    weights = {c: own for c, own in weights.items() if c not in open_ones}
    immaterial = _immaterial(search, kept, data)
    weights = of_scales(weights, {place.place for place in search.gram.places})
    weights = of_clocks(of_drives(weights, 2.0 * data.searched[0].torque_age))
    # With the interval that is reported, which includes what the reference clock may be off.
    negligible = [
        small or _may_be_negligible(each, weights)
        for each, small in zip(kept, immaterial, strict=True)
    ]
    weights = {
        c: (_allowed(data.searched[0], c, own, half), half) for c, (own, half) in weights.items()
    }
    weights, zero = _with_forms(search, kept, together, weights)
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


def _with_forms(
    search: Search, kept: Sequence[Finding], together: Sequence[Hypothesis], weights: Weights
) -> tuple[Weights, list[bool]]:
    """Return weights with the model-form error in their intervals, and what noise alone may be."""
    zero = [_is_insignificant(each.hypothesis, weights) for each in kept]
    shown = [
        none and _is_shown_elsewhere(search, each, together)
        for each, none in zip(kept, zero, strict=True)
    ]
    silent = [each.hypothesis for each in kept if each.holdout is HoldOut.SILENT]
    wider = of_forms(weights, _moved(search, together, silent, weights), search.thresholds)
    wider |= _without_intervals(compress(kept, shown), wider)
    return wider, [none and not known for none, known in zip(zero, shown, strict=True)]


def _fitted(
    search: Search, hypotheses: Sequence[Hypothesis], data: Data, since: float
) -> tuple[Weights, dict[Candidate, Array]]:
    """Return weights fitted from a time [s] on, and upper ends over all time constants."""

    def cut(parts: Parts) -> Parts:
        return [[e.within(since, np.inf) for e in part] for part in data.searched_part(parts)]

    rows = [[e.within(since, np.inf) for e in part] for part in data.rows]
    weights = _parameters(search, hypotheses, data, cut, rows)
    return weights, _in_all(hypotheses, weights, data, cut, search.thresholds)


def _may_be_negligible(finding: Finding, weights: Weights) -> bool:
    own = members_of(weights, finding.hypothesis)
    return may_be_negligible({c: weights[c] for c in own})


def _immaterial(search: Search, kept: Sequence[Finding], data: Data) -> list[bool]:
    """Return for each finding whether it changes every residual by less than matters."""
    rows, limits = steady(data.rows), search.thresholds
    weights = search.fits.values([each.hypothesis for each in kept])
    machine = data.searched[0].machine
    return [
        acts_immaterially(
            {c: weights[c] for c in each.hypothesis.candidates}, rows, data.noise, machine, limits
        )
        for each in kept
    ]


def _is_possible(
    hypothesis: Hypothesis, own: Weights, measured: Measurement, thresholds: Thresholds
) -> bool:
    """Return whether a machine can have these weights, and data show their onset and end.

    What is compatible with no machine at all, such as a bar without mass, is on its bound, and no
    estimate: an inertia that shares the noise of its residual is fitted away with it.
    """
    numbers = own if hypothesis.effect.is_correction else {}
    ends = [{c: w + sign * half for c, (w, half) in numbers.items()} for sign in (-1.0, 1.0)]
    bounded_ends = [each for each in ends if all(np.all(np.isfinite(w)) for w in each.values())]
    return (
        all(
            is_possible(measured, each)
            for each in ({c: weights for c, (weights, _) in own.items()}, *bounded_ends)
        )
        and is_seen_to_begin(hypothesis, own)
        and is_seen_to_end(own, thresholds)
    )


def _simulated(
    assessments: Sequence[Assessment], weights: Weights, data: Data, thresholds: Thresholds
) -> Model:
    """Return a model of tenable findings, each validated by simulations of held-out data.

    Negligible findings are exempt: a healthy machine has them too, too small to improve any.
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
            harmed = raised(without, every, thresholds)
            finding = replace(each.finding, improvement=improvement, raises=harmed)
            each = each._replace(finding=finding, degradation=worse)
        judged.append(each)
    return Model(tuple(judged), weights, simulated)


def _is_insignificant(hypothesis: Hypothesis, weights: Weights) -> bool:
    """Return whether all coefficients of a finding may be zero beside the other findings.

    Two kinds are exempt. A saturating effect that has hardly acted is present, though its limit is
    unknown. A sensor's offset is the mean of its drift, which is present as well.
    """
    effect, own = hypothesis.effect, {c: weights[c] for c in members_of(weights, hypothesis)}
    drifts = effect.physics.sense is not None and is_constant(effect)
    return may_be_none(own) and not effect.signature.saturates and not drifts


def _without_intervals(found: Iterable[Finding], weights: Weights) -> Weights:
    """Return the weights of some findings with unbounded intervals."""
    own = [c for each in found for c in members_of(weights, each.hypothesis)]
    return {c: (weights[c][0], np.full_like(weights[c][1], np.inf)) for c in own}


def _is_shown_elsewhere(search: Search, finding: Finding, together: Sequence[Hypothesis]) -> bool:
    """Return whether held-out data show a finding whose interval has too few stretches to hold.

    It then takes most of a held-out residual, and its numbers have no interval.
    """
    own, dominant = finding.hypothesis, finding.holdout is HoldOut.DOMINANT
    return dominant and search.fits.has_few_stretches(own, [h for h in together if h is not own])


def _needed(finding: Finding, thresholds: Thresholds) -> float:
    """Return the ratio of simulated errors with and without a finding that it has to reach.

    A simulation from motor angles is insensitive to small parameter errors. Another model-form
    error may dominate it, such as an open loop that resonates. A finding that explains most of a
    residual therefore need not improve a simulation.
    """
    if finding.holdout is HoldOut.DOMINANT:
        return np.inf
    lenient = finding.is_faint or is_number(finding.hypothesis)
    return 1.0 if lenient else thresholds.whole_share


def _allowed(measured: Measurement, candidate: Candidate, weights: Array, half: Array) -> Array:
    """Return weights moved within the limits of catalogue and machine, as far as noise explains."""
    return nearest_possible(measured, candidate, bounded(candidate, weights, half), half)


def _parameters(
    search: Search,
    hypotheses: Sequence[Hypothesis],
    data: Data,
    cut: Cut,
    rows: Parts,
) -> Weights:
    """Return the weights of hypotheses, refined where regressors depend on them."""
    if any(needs_refining(hypothesis.effect) for hypothesis in hypotheses):
        given = data.noise, data.block, cut, data.assumed, search.thresholds
        return refine(data.searched, hypotheses, *given)
    return of_shafts(search.fits.weights(hypotheses), rows, data.block, search.thresholds)


def _in_all(
    hypotheses: Sequence[Hypothesis],
    weights: Weights,
    data: Data,
    cut: Cut,
    thresholds: Thresholds,
) -> dict[Candidate, Array]:
    """Return upper ends of hypotheses that may have parts with other time constants."""
    given = data.noise, data.block, cut, data.assumed, thresholds
    return spectra(data.searched, hypotheses, weights, *given)


def _moved(
    search: Search,
    hypotheses: Sequence[Hypothesis],
    silent: Sequence[Hypothesis],
    found: Iterable[Candidate],
) -> dict[Candidate, Array]:
    """Return how far free functions may move each candidate's weights, for final shapes.

    What held-out data cannot test may be such a function: it moves the others like one.
    """
    tested = [h for h in hypotheses if h not in silent]
    moved = moved_by_functions(search.fits, hypotheses) if silent else {}
    moved |= moved_by_functions(search.fits, tested)
    at = {(c.effect_id, c.element): half for c, half in moved.items()}
    return {c: at[c.effect_id, c.element] for c in found}


def _onsets(
    kept: Sequence[Finding], rows: Parts, starts: Array, thresholds: Thresholds
) -> tuple[Onset | None, ...]:
    """Return each finding's onset; None where it acts from the start or among recordings."""
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
