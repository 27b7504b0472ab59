"""Hypotheses of effects on elements, and what their coefficients allow."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_sim.effects import Effect

Array = NDArray[np.float64]

# More signals than any block of the machine has.
_SIGNALS = 128


@dataclass(frozen=True)
class Hypothesis:
    """An effect on some elements.

    Attributes:
        effect: of the catalogue.
        candidates: one per element, of the same nonlinear parameters.
        onset: block from which on it acts, 0 for all the time.
        common: whether all elements share its numbers, having one cause.
    """

    effect: Effect
    candidates: tuple[Candidate, ...]
    onset: int = 0
    common: bool = False

    @property
    def elements(self) -> tuple[str, ...]:
        """What it acts on."""
        return tuple(candidate.element for candidate in self.candidates)

    @property
    def causes(self) -> int:
        """How many faults it supposes: one for each element that has numbers of its own."""
        return 1 if self.common else len(self.candidates)

    @property
    def words(self) -> str:
        """What it says, for people."""
        return f"{self.effect.id} on {', '.join(self.elements)}"


class Rival(NamedTuple):
    """A hypothesis that explains nearly as much as one that was chosen.

    Attributes:
        hypothesis: what it says.
        behind: by how many standard deviations of a normal it is worse, over the blocks that were
            not fitted, its further parameters counted; 0 where it is as good or better.
        beside: a wrong number of the file that hides a part of it; None where it stands alone.
    """

    hypothesis: Hypothesis
    behind: float
    beside: Hypothesis | None = None

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """All that it supposes."""
        beside = () if self.beside is None else self.beside.candidates
        return (*self.hypothesis.candidates, *beside)

    @property
    def words(self) -> str:
        """What it says, for people."""
        beside = "" if self.beside is None else f" beside a wrong {self.beside.effect.id}"
        return f"{self.hypothesis.words}{beside}"


def is_constant(effect: Effect) -> bool:
    """Return whether an effect adds the same to its main residual whatever the machine does."""
    signals = np.random.default_rng(0).normal(size=(16, _SIGNALS))
    shape = {name: grid[0] for name, grid in effect.signature.nonlinear.items()}
    with np.errstate(all="ignore"):
        columns = effect.regressors(signals, **shape)
    return bool(np.array_equal(columns[:-1], columns[1:]) and columns.any())


def is_exact(effect: Effect) -> bool:
    """Return whether an effect has no form that may be untrue in its course over a recording.

    It corrects a number of the file or of a reading, other than its time, or it is a constant, and
    what that leaves is a function of time.
    """
    return (effect.is_correction and not is_timing(effect)) or is_constant(effect)


def is_negligible(members: Mapping[Candidate, Array]) -> bool:
    """Return whether weights of an effect on its elements are such as a sound machine has."""
    return all(
        c.effect.is_negligible(c.effect.values(own.tolist(), **c.nonlinear))
        for c, own in members.items()
    )


def may_be_negligible(weights: Mapping[Candidate, tuple[Array, Array]]) -> bool:
    """Return whether weights with half their intervals may be such as a sound machine has."""
    least = {c: np.sign(w) * np.maximum(np.abs(w) - half, 0.0) for c, (w, half) in weights.items()}
    return is_negligible(least)


def may_be_none(weights: Mapping[Candidate, tuple[Array, Array]]) -> bool:
    """Return whether weights with half their intervals all may be zero, where there are any.

    Of what nothing bounds, both ends being beyond what the catalogue allows, this says nothing.
    """
    return bool(weights) and all(
        bool(np.all(np.abs(w) <= half)) and any(is_allowed(c, w + end) for end in (half, -half))
        for c, (w, half) in weights.items()
    )


def is_seen_to_begin(
    hypothesis: Hypothesis, weights: Mapping[Candidate, tuple[Array, Array]]
) -> bool:
    """Return whether weights with half their intervals allow a beginning, where there is one.

    A beginning is looked for in all blocks, so that something always begins somewhere; it may be
    told if any number is surely not zero from then on, which takes an interval.
    """
    significant = (bool(np.any(np.abs(own) > half)) for own, half in weights.values())
    return not hypothesis.onset or any(significant)


def is_seen_to_end(
    candidates: Iterable[Candidate], thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> bool:
    """Return whether a recording shows the ends of all memories, of which time constants tell.

    One that is as long as can be told goes on growing like much else that is not in the catalogue.
    """
    longest = {
        c: next(p.maximum for p in c.effect.parameters if p.name == c.effect.signature.spectrum)
        for c in candidates
        if c.effect.signature.spectrum
    }
    share = thresholds.spectrum_end_share
    return all(
        c.nonlinear[c.effect.signature.spectrum] < share * most for c, most in longest.items()
    )


def bounded(candidate: Candidate, weights: Array, half: Array) -> Array:
    """Return weights with those moved to their bound that lie beyond it by chance.

    Args:
        candidate: of which they are.
        weights: as fitted.
        half: half the widths of their 95 % intervals.
    """
    effect = candidate.effect
    if effect.signature.coefficients:
        return weights
    absent = np.array([p.absent or 0.0 for p in effect.linear])
    low = np.array([p.minimum for p in effect.linear]) - absent
    nearest = np.clip(weights, low, np.array([p.maximum for p in effect.linear]) - absent)
    return np.where(np.abs(nearest - weights) <= half, nearest, weights)


def is_allowed(candidate: Candidate, weights: Array) -> bool:
    """Return whether the catalogue allows such weights, and they do something."""
    values = candidate.effect.values(weights.tolist(), **candidate.nonlinear)
    return candidate.effect.is_plausible(values) and not candidate.effect.is_absent(values)


def is_tied(candidate: Candidate, weights: Array, half: Array) -> bool:
    """Return whether weights that depend on one another are those of some parameters."""
    values = candidate.effect.values(weights.tolist(), **candidate.nonlinear)
    return bool(np.all(np.abs(candidate.effect.weights(values) - weights) <= half))


def joined(chosen: Sequence[Hypothesis], found: Hypothesis) -> list[Hypothesis]:
    """Return hypotheses with a further one; the same effect on more elements is still one."""
    shape, out = found.candidates[0].shape, []
    for other in chosen:
        alike = other.effect.id == found.effect.id and other.candidates[0].shape == shape
        if alike and other.onset == found.onset:
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
    """Return the candidates of hypotheses, and the effects, by id, whose weights they share."""
    own = list(hypotheses)
    common = {h.effect.id for h in own if h.common}
    return [c for h in own for c in h.candidates], common


def freedom(hypothesis: Hypothesis) -> int:
    """Return how many numbers a hypothesis has that are not of a grid.

    Those of its parameters for each fault, and one for each fault beyond the first.
    """
    effect, causes = hypothesis.effect, hypothesis.causes
    return causes * (len(effect.parameters) - len(effect.signature.nonlinear)) + causes - 1


def has_one_system(effect: Effect) -> bool:
    """Return whether one system reads all that an effect can act on."""
    return effect.physics.sense is not None and effect.physics.sense.one_system


def is_number(hypothesis: Hypothesis) -> bool:
    """Return whether it is a wrong number of the file, rather than physics that is missing."""
    return hypothesis.effect.physics.alter is not None


def is_wider(one: Hypothesis, other: Hypothesis) -> bool:
    """Return whether one supposes more faults, whatever the effects."""
    return one.causes > other.causes


def boldness(
    one: Hypothesis, other: Hypothesis | None = None, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> float:
    """Return by how many standard errors one has to explain more than another, or than nothing.

    For a beginning, chosen among many, and for an unlikely extent, where the other has none: one
    number for all elements is unlikely unless one system reads them; then it is for a part of them.
    """
    if one.onset and (other is None or not other.onset):
        return thresholds.onset_sigma
    if other is None:
        return 0.0
    unlikely = one.common != other.common and one.common is not has_one_system(one.effect)
    return thresholds.extent_sigma if unlikely else 0.0


def unusual(weights: Mapping[Candidate, Array], hypothesis: Hypothesis) -> float:
    """Return by how many times its usual error a wrong number is wrong; 0 where none is usual."""
    found = [0.0]
    for candidate in hypothesis.candidates:
        values = candidate.effect.values(weights[candidate].tolist(), **candidate.nonlinear)
        found += [
            abs(values[p.name] - (p.absent or 0.0)) / p.usual
            for p in candidate.effect.parameters
            if p.usual is not None
        ]
    return max(found)


def is_timing(effect: Effect) -> bool:
    """Return whether an effect is that readings are older than their stamps say."""
    return effect.physics.sense is not None and effect.physics.sense.lateness is not None


def is_early(weights: Mapping[Candidate, Array], hypothesis: Hypothesis) -> bool:
    """Return whether readings would be newer than their stamps say, which only clocks can do.

    By more than those of a sound machine.
    """
    sense = hypothesis.effect.physics.sense
    if sense is None or sense.lateness is None:
        return False
    own = {c: weights[c] for c in hypothesis.candidates}
    return min(sense.lateness(0.0, each) for each in own.values()) < 0.0 and not is_negligible(own)


def is_spread(
    one: Hypothesis, whole: Hypothesis, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> bool:
    """Return whether one has the same effect on half of several elements at least.

    Then it is as likely on all of them, which is one cause, as on those alone.
    """
    same = one.effect.id == whole.effect.id and one.candidates[0].shape == whole.candidates[0].shape
    elements = len(whole.elements)
    least = thresholds.spread_element_share * elements
    return same and elements > 2 and len(one.elements) >= least


def members_of(candidates: Iterable[Candidate], hypothesis: Hypothesis) -> list[Candidate]:
    """Return a finding's candidates with their final shapes."""
    own = hypothesis.effect.id, hypothesis.elements
    return [c for c in candidates if c.effect_id == own[0] and c.element in own[1]]
