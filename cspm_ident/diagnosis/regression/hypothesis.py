"""Hypotheses: an effect on some elements, and tests of the fitted coefficients."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_sim.effects import Effect, Elements

Array = NDArray[np.float64]

# Exponents of factors are compared up to here, far beyond any that is allowed.
_LARGEST = 50.0
# Number of random signals, larger than any effect reads.
_SIGNALS = 128


@dataclass(frozen=True)
class Hypothesis:
    """An effect on some elements.

    Attributes:
        effect: of the catalogue.
        candidates: one per element, all with the same nonlinear parameters.
        onset: first block in which it acts, 0 for the whole recording.
        common: whether all elements share one set of parameters, having one cause.
    """

    effect: Effect
    candidates: tuple[Candidate, ...]
    onset: int = 0
    common: bool = False

    @property
    def elements(self) -> tuple[str, ...]:
        """The elements it acts on."""
        return tuple(candidate.element for candidate in self.candidates)

    @property
    def scope(self) -> tuple[str, ...]:
        """The elements by the name under which a test-bed file lists them."""
        every = self.common and self.effect.acts_on is Elements.CELLS
        return (Elements.CELLS.value,) if every else self.elements

    @property
    def causes(self) -> int:
        """Number of faults it assumes: one for each element that has its own parameters."""
        return 1 if self.common else len(self.candidates)

    @property
    def words(self) -> str:
        """Effect and elements, as readable text."""
        return f"{self.effect.id} on {', '.join(self.scope)}"


class Rival(NamedTuple):
    """A hypothesis that explains nearly as much as a chosen one.

    Attributes:
        hypothesis: the alternative.
        behind: standard deviations of a normal by which it is worse over hold-out blocks. Its
            additional parameters are counted; 0 where it is as good or better.
        beside: a wrong parameter of the file that masks a part of it; None where there is none.
    """

    hypothesis: Hypothesis
    behind: float
    beside: Hypothesis | None = None

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """All candidates it assumes, those of the wrong parameter included."""
        beside = () if self.beside is None else self.beside.candidates
        return (*self.hypothesis.candidates, *beside)

    @property
    def words(self) -> str:
        """Effects and elements, as readable text."""
        beside = "" if self.beside is None else f" beside a wrong {self.beside.effect.id}"
        return f"{self.hypothesis.words}{beside}"


def is_constant(effect: Effect) -> bool:
    """Return whether an effect adds the same to its main residual whatever the motion."""
    signals = np.random.default_rng(0).normal(size=(16, _SIGNALS))
    shape = {name: grid[0] for name, grid in effect.signature.nonlinear.items()}
    with np.errstate(all="ignore"):
        columns = effect.regressors(signals, **shape)
    return bool(np.array_equal(columns[:-1], columns[1:]) and columns.any())


def is_exact(effect: Effect) -> bool:
    """Return whether an effect has no model-form error in its time course.

    True for a correction of a parameter or a reading, except for timing corrections. Also true for
    a constant, whose model-form error would be a function of time.
    """
    return (effect.is_correction and not is_timing(effect)) or is_constant(effect)


def is_negligible(members: Mapping[Candidate, Array]) -> bool:
    """Return whether weights of an effect on its elements are within a healthy machine's range.

    Args:
        members: weights by candidate.
    """
    return all(
        c.effect.is_negligible(c.effect.values(own.tolist(), **c.nonlinear))
        for c, own in members.items()
    )


def may_be_negligible(weights: Mapping[Candidate, tuple[Array, Array]]) -> bool:
    """Return whether the intervals reach into the range of a healthy machine.

    Args:
        weights: weights and half the widths of their intervals, by candidate.
    """
    least = {c: np.sign(w) * np.maximum(np.abs(w) - half, 0.0) for c, (w, half) in weights.items()}
    return is_negligible(least)


def may_be_none(weights: Mapping[Candidate, tuple[Array, Array]]) -> bool:
    """Return whether the intervals of all weights contain 0; False where there are no weights.

    False as well for an unbounded weight, where both ends of its interval are beyond the
    catalogue's range.
    """
    return bool(weights) and all(
        bool(np.all(np.abs(w) <= half)) and any(is_allowed(c, w + end) for end in (half, -half))
        for c, (w, half) in weights.items()
    )


def is_seen_to_begin(
    hypothesis: Hypothesis, weights: Mapping[Candidate, tuple[Array, Array]]
) -> bool:
    """Return whether the intervals support the hypothesis's onset; True where it has none.

    The onset search covers all blocks and so always finds one. It may be reported if at least one
    weight is significant from the onset on, which requires an interval.
    """
    significant = (bool(np.any(np.abs(own) > half)) for own, half in weights.values())
    return not hypothesis.onset or any(significant)


def is_seen_to_end(
    candidates: Iterable[Candidate], thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> bool:
    """Return whether the recording covers all relaxations described by a time constant.

    A time constant at the end of its range cannot be separated from steady growth, which many
    causes outside the catalogue share.
    """
    longest = {
        c: next(p.maximum for p in c.effect.parameters if p.name == c.effect.signature.spectrum)
        for c in candidates
        if c.effect.signature.spectrum
    }
    share = thresholds.whole_share
    return all(
        c.nonlinear[c.effect.signature.spectrum] < share * most for c, most in longest.items()
    )


def bounded(candidate: Candidate, weights: Array, half: Array) -> Array:
    """Return weights, with insignificant ones outside their range moved to its bound.

    A friction is never negative, yet noise makes an estimate so. A significant weight on its bound
    would be no estimate: it stays where it was fitted, and the catalogue does not allow it.

    Args:
        candidate: that the weights belong to.
        weights: as fitted.
        half: half the widths of their 95 % intervals.
    """
    effect = candidate.effect
    if effect.signature.coefficients:
        return weights
    absent = np.array([p.absent or 0.0 for p in effect.linear])
    low = np.array([p.minimum for p in effect.linear]) - absent
    nearest = np.clip(weights, low, np.array([p.maximum for p in effect.linear]) - absent)
    return np.where(np.abs(weights) <= half, nearest, weights)


def is_allowed(candidate: Candidate, weights: Array) -> bool:
    """Return whether the catalogue allows such weights, and they have an effect.

    To first order a factor is 1 + w, or exp(w) just as well: a cable of half the stiffness may have
    a weight of −1. A gain of the compared quantity is 1/(1 − w) as well; see `of_scales`. One of
    them has to be allowed.
    """
    effect = candidate.effect
    steps = np.where(factors_of(effect), np.expm1(np.minimum(weights, _LARGEST)), weights)
    inverse = effect.signature.rescales & (weights < 1.0) & np.isfinite(weights)
    gains = np.divide(weights, 1.0 - weights, out=weights.copy(), where=inverse)
    for each in (weights, steps, gains):
        values = effect.values(each.tolist(), **candidate.nonlinear)
        if effect.is_plausible(values) and not effect.is_absent(values):
            return True
    return False


def factors_of(effect: Effect) -> NDArray[np.bool_]:
    """Return which weights of a correction are factors, less 1: of the file or of a reading."""
    usual = effect.is_correction and not effect.signature.coefficients
    return np.array([usual and parameter.absent == 1.0 for parameter in effect.linear])


def is_tied(candidate: Candidate, weights: Array, half: Array) -> bool:
    """Return whether dependent weights agree, within their intervals, with a set of parameters."""
    values = candidate.effect.values(weights.tolist(), **candidate.nonlinear)
    return bool(np.all(np.abs(candidate.effect.weights(values) - weights) <= half))


def joined(chosen: Sequence[Hypothesis], found: Hypothesis) -> list[Hypothesis]:
    """Return hypotheses with a further one; merge those of the same effect, shape and onset."""
    shape, out = found.candidates[0].shape, []
    for other in chosen:
        same_effect = other.effect.id == found.effect.id and other.candidates[0].shape == shape
        if same_effect and other.onset == found.onset:
            found = replace(other, candidates=(*other.candidates, *found.candidates))
        else:
            out.append(other)
    return [*out, found]


def shapes_of(hypothesis: Hypothesis, candidates: Iterable[Candidate]) -> list[Hypothesis]:
    """Return the hypothesis with every shape that its effect has on all its elements."""
    groups: dict[tuple[tuple[str, float], ...], list[Candidate]] = {}
    for candidate in candidates:
        if candidate.effect_id == hypothesis.effect.id and candidate.element in hypothesis.elements:
            groups.setdefault(candidate.shape, []).append(candidate)
    return [
        replace(hypothesis, candidates=tuple(own))
        for own in groups.values()
        if len(own) == len(hypothesis.candidates)
    ]


def parts_of(hypotheses: Iterable[Hypothesis]) -> tuple[list[Candidate], set[str]]:
    """Return the candidates of hypotheses, and the ids of effects with common weights."""
    own = list(hypotheses)
    common = {h.effect.id for h in own if h.common}
    return [c for h in own for c in h.candidates], common


def freedom(hypothesis: Hypothesis) -> int:
    """Return the number of free parameters of a hypothesis, those on a grid excluded.

    Those of the effect for each fault, and one for each fault beyond the first.
    """
    effect, causes = hypothesis.effect, hypothesis.causes
    return causes * (len(effect.parameters) - len(effect.signature.nonlinear)) + causes - 1


def has_one_system(effect: Effect) -> bool:
    """Return whether one sensor system reads all elements that an effect can act on."""
    return effect.physics.sense is not None and effect.physics.sense.one_system


def is_number(hypothesis: Hypothesis) -> bool:
    """Return whether it is a wrong parameter of the file rather than missing physics."""
    return hypothesis.effect.physics.alter is not None


def is_wider(one: Hypothesis, other: Hypothesis) -> bool:
    """Return whether one hypothesis assumes more faults than the other, whatever the effects."""
    return one.causes > other.causes


def boldness(
    one: Hypothesis, other: Hypothesis | None = None, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> float:
    """Return the standard errors by which one must explain more than another, or than nothing.

    Non-zero for an onset, which is selected among many, and for an unlikely element scope, where
    the other has none. Common parameters on all elements are unlikely unless one system reads them.
    If one does, separate parameters are unlikely.
    """
    if one.onset and (other is None or not other.onset):
        return thresholds.certain_sigma
    if other is None:
        return 0.0
    unlikely = one.common != other.common and one.common is not has_one_system(one.effect)
    return thresholds.tie_sigma if unlikely else 0.0


def unusual(weights: Mapping[Candidate, Array], hypothesis: Hypothesis) -> float:
    """Return the largest error of a parameter of the file, in units of its usual error.

    At least 1: of errors that are usual, the smaller is no likelier. 1 where no usual error is
    given.
    """
    found = [1.0]
    for candidate in hypothesis.candidates:
        values = candidate.effect.values(weights[candidate].tolist(), **candidate.nonlinear)
        found += [
            abs(values[p.name] - (p.absent or 0.0)) / p.usual
            for p in candidate.effect.parameters
            if p.usual is not None
        ]
    return max(found)


def is_timing(effect: Effect) -> bool:
    """Return whether an effect makes readings older than their stamps, or slower."""
    sense = effect.physics.sense
    return sense is not None and (sense.lateness or sense.time_constant) is not None


def is_surveyed(effect: Effect) -> bool:
    """Return whether an effect moves a surveyed place, which no machine knows exactly."""
    return effect.physics.alter is not None and bool(effect.signature.negligible)


def are_places(effect: Effect) -> bool:
    """Return whether an effect moves places, surveyed or of markers, by numbers of a usual size."""
    sizes = [parameter.usual for parameter in effect.linear]
    return len(sizes) > 1 and None not in sizes and not effect.signature.coefficients


def is_early(weights: Mapping[Candidate, Array], hypothesis: Hypothesis) -> bool:
    """Return whether readings would be newer than their stamps by more than a healthy clock allows.

    Only clock offsets can cause this.
    """
    sense = hypothesis.effect.physics.sense
    if sense is None or sense.lateness is None:
        return False
    own = {c: weights[c] for c in hypothesis.candidates}
    return min(sense.lateness(0.0, each) for each in own.values()) < 0.0 and not is_negligible(own)


def is_spread(
    one: Hypothesis, whole: Hypothesis, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> bool:
    """Return whether one has the same effect on at least half of more than two elements.

    Then one cause on all elements is as likely as separate faults on those alone.
    """
    same = one.effect.id == whole.effect.id and one.candidates[0].shape == whole.candidates[0].shape
    elements = len(whole.elements)
    least = thresholds.majority_share * elements
    return same and elements > 2 and len(one.elements) >= least


def members_of(candidates: Iterable[Candidate], hypothesis: Hypothesis) -> list[Candidate]:
    """Return a finding's candidates with their final shapes."""
    own = hypothesis.effect.id, hypothesis.elements
    return [c for c in candidates if c.effect_id == own[0] and c.element in own[1]]
