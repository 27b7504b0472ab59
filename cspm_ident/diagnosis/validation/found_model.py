"""What was found as a model: its parameters, its beginnings, and what simulation says of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import compress
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.coefficients import Weights
from cspm_ident.diagnosis.regression.hypothesis import (
    Hypothesis,
    Named,
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
from cspm_ident.diagnosis.selection.onset import Onset, onset_of
from cspm_ident.diagnosis.selection.refinement import Cut, needs_refining, refine, spectra
from cspm_ident.diagnosis.selection.search import Search
from cspm_ident.diagnosis.validation.holdout_degradation import harm, squares_left
from cspm_ident.diagnosis.validation.holdout_simulation import (
    Baselines,
    SimulatedFit,
    Worth,
    simulate_held_out,
    worth_of,
)
from cspm_ident.signals.measurement import Measurement

Array = NDArray[np.float64]
Parts = Sequence[Sequence[Equation]]

# A finding stands if a simulated error falls below this share of what it is without the finding.
WORTH_IT = 0.99


class Data(NamedTuple):
    """What a model is fitted to and judged by.

    Attributes:
        searched: the recordings, of which `searched_part` was searched.
        searched_part: cuts their equations.
        baselines: simulations of what was not searched.
        rows: of what was searched, in units of their noise.
        noise: of each residual.
        block: length of the blocks [s].
        supposed: about what they were taken to first order.
        faint: findings of which what was not searched shows little.
        plain: findings that take most of a residual of that.
    """

    searched: Sequence[Measurement]
    searched_part: Cut
    baselines: Baselines
    rows: Parts
    noise: dict[Place, Array]
    block: float
    supposed: Mapping[Candidate, Array]
    faint: Sequence[Named] = ()
    plain: Sequence[Named] = ()


class Model(NamedTuple):
    """What was found as a model: parameters, beginnings, simulations, what each is worth.

    Attributes:
        weights: as of a diagnosis.
        onsets: likewise.
        simulated: likewise.
        worth: of each finding; None where they cannot tell, or it is negligible.
        possible: whether a machine can have each, it is seen to begin where it does not act all
            the time, and its memory is seen to end.
        negligible: whether each may be no more than in a sound machine.
        wanted: below which share of what it is without each a simulated error has to fall.
        unsure: whether each may be none, as far as noise tells, and is no sound machine's.
        harm: squares by which each makes worse what was not searched; 0 where it does not.
        spectra: as of a diagnosis.
    """

    weights: Weights
    onsets: tuple[Onset | None, ...]
    simulated: tuple[SimulatedFit, ...]
    worth: tuple[Worth | None, ...]
    possible: tuple[bool, ...]
    negligible: tuple[bool, ...]
    wanted: tuple[float, ...]
    unsure: tuple[bool, ...] = ()
    harm: tuple[float, ...] = ()
    spectra: Mapping[Candidate, Array] = MappingProxyType({})

    @property
    def untenable(self) -> list[int]:
        """Findings that go whatever held-out data say: what is not possible, else the least unsure.

        With any of them there is no simulation.
        """
        if not all(self.possible):
            return [k for k, possible in enumerate(self.possible) if not possible]
        return [max(compress(range(len(self.unsure)), self.unsure))] if any(self.unsure) else []

    @property
    def useless(self) -> list[int]:
        """Findings that have to go: what is untenable, else the worst of harm, else of no use.

        Of no use is with what no simulation of held-out data comes nearer to what was measured.
        """
        if self.untenable:
            return self.untenable
        if any(self.harm):
            return [max(range(len(self.harm)), key=lambda k: self.harm[k])]
        shares = {k: worth.with_it / worth.without for k, worth in enumerate(self.worth) if worth}
        worst = max(shares, key=lambda k: shares[k] - self.wanted[k], default=None)
        return [worst] if worst is not None and shares[worst] > self.wanted[worst] else []


def modelled(search: Search, kept: Sequence[Named], data: Data) -> Model:
    """Return the model that findings make.

    Args:
        search: in which they were found.
        kept: the findings.
        data: to which parameters are fitted and by which the model is judged.
    """
    onsets = _onsets(kept, steady(data.rows), search.evidence.times)
    since = max((onset.time for onset in onsets if onset is not None), default=-np.inf)

    def cut(parts: Parts) -> Parts:
        return [[e.within(since, np.inf) for e in part] for part in data.searched_part(parts)]

    rows = [[e.within(since, np.inf) for e in part] for part in data.rows]
    weights = _parameters(search, kept, data, cut, rows)
    most = _in_all(kept, weights, data, cut)
    negligible = tuple(
        may_be_negligible({c: weights[c] for c in members_of(weights, each.hypothesis)})
        for each in kept
    )
    weights = of_clocks(of_drives(weights, 2.0 * data.searched[0].torque_age))
    weights = {
        c: (_allowed(data.searched[0], c, own, half), half) for c, (own, half) in weights.items()
    }
    unsure = tuple(
        not sound and _is_unsure(each.hypothesis, weights)
        for each, sound in zip(kept, negligible, strict=True)
    )
    weights = of_forms(weights, _untrue(search, kept, weights))
    values = {c: w for c, (w, _) in weights.items()}
    members = [{c: values[c] for c in members_of(values, each.hypothesis)} for each in kept]
    possible = tuple(
        is_possible(data.searched[0], own)
        and is_seen_to_begin(each.hypothesis, {c: weights[c] for c in own})
        and is_seen_to_end(own)
        for each, own in zip(kept, members, strict=True)
    )
    wanted = tuple(_wanted(each, data) for each in kept)
    if any(unsure) or not all(possible):
        return Model(weights, onsets, (), (), possible, negligible, wanted, unsure, spectra=most)
    simulated = simulate_held_out(data.baselines, values)
    # What a sound machine has too is too little to be of use, and there nevertheless.
    worth = tuple(
        None if sound else worth_of(data.baselines, simulated, values, own)
        for own, sound in zip(members, negligible, strict=True)
    )
    harms = _harms(data, values, members, negligible)
    given = possible, negligible, wanted, unsure, harms
    return Model(weights, onsets, simulated, worth, *given, most)


def _is_unsure(hypothesis: Hypothesis, weights: Weights) -> bool:
    """Return whether all numbers of a finding may be zero, together with what else was found.

    What saturates and has hardly acted is there, though nothing is known of where it ends; and a
    reading's zero is the mean of what drifts in it, which is there as well.
    """
    effect, own = hypothesis.effect, {c: weights[c] for c in members_of(weights, hypothesis)}
    drifts = effect.physics.sense is not None and is_constant(effect)
    return may_be_none(own) and not effect.signature.saturates and not drifts


def _harms(
    data: Data,
    values: Mapping[Candidate, Array],
    members: Sequence[Mapping[Candidate, Array]],
    negligible: Sequence[bool],
) -> tuple[float, ...]:
    """Return by how many squares each finding makes worse what was not searched.

    None does that is no more than in a sound machine.
    """

    def left(found: Mapping[Candidate, Array]) -> dict[Place, Array]:
        return squares_left(data.baselines, found, data.noise, data.block)

    every = left(values)
    return tuple(
        0.0 if sound else harm(left({c: w for c, w in values.items() if c not in own}), every)
        for own, sound in zip(members, negligible, strict=True)
    )


def _wanted(named: Named, data: Data) -> float:
    """Return below which share of what it is without a finding a simulated error has to fall.

    A simulation from motor angles hardly feels a number of the file that is off by little, and it
    may be ruled by something else that is not right, as where an open loop resonates: what takes
    most of a residual need not show there as well.
    """
    if named in data.plain:
        return np.inf
    return 1.0 if named in data.faint or is_number(named.hypothesis) else WORTH_IT


def _allowed(measured: Measurement, candidate: Candidate, weights: Array, half: Array) -> Array:
    """Return weights moved to what catalogue and machine allow, where chance took them off."""
    return nearest_possible(measured, candidate, bounded(candidate, weights, half), half)


def _parameters(
    search: Search,
    kept: Sequence[Named],
    data: Data,
    cut: Cut,
    rows: Parts,
) -> Weights:
    """Return the weights of what was kept, refined where columns depend on them."""
    hypotheses = [each.hypothesis for each in kept]
    if any(needs_refining(hypothesis.effect) for hypothesis in hypotheses):
        return refine(data.searched, hypotheses, data.noise, data.block, cut, data.supposed)
    return of_shafts(search.fits.weights(hypotheses), rows, data.block)


def _in_all(
    kept: Sequence[Named], weights: Weights, data: Data, cut: Cut
) -> dict[Candidate, Array]:
    """Return how large findings may be that have parts with other time constants."""
    hypotheses = [each.hypothesis for each in kept]
    return spectra(data.searched, hypotheses, weights, data.noise, data.block, cut, data.supposed)


def _untrue(
    search: Search, kept: Sequence[Named], found: Iterable[Candidate]
) -> dict[Candidate, float]:
    """Return by what share of its amplitude each candidate is seen to be off, of final shapes."""
    hypotheses, final = [each.hypothesis for each in kept], list(found)
    shares: dict[Candidate, float] = {}
    for each in hypotheses:
        own = search.fits.untrue(each, [h for h in hypotheses if h is not each])
        by_element = {candidate.element: share for candidate, share in own.items()}
        shares |= {c: by_element[c.element] for c in members_of(final, each)}
    return shares


def _onsets(kept: Sequence[Named], rows: Parts, starts: Array) -> tuple[Onset | None, ...]:
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
        found.append(onset_of(rows[0], own, others, float(low), float(high)))
    return tuple(found)
