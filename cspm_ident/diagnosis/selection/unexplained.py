"""Unexplained residuals: free functions of a signal or of time that no effect explains."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.finding import Unexplained
from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.regression.block_regression import BlockRegression, Gain
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.regression.significance import Significance
from cspm_ident.diagnosis.residuals.free_shapes import Driver

Index = NDArray[np.intp]

# Lower bound of a denominator.
_LEAST = 1e-300


def unexplained(
    gram: BlockGram,
    sums: BlockRegression,
    significance: Significance,
    chosen: Sequence[Hypothesis],
    healthy: Sequence[Hypothesis] = (),
) -> tuple[Unexplained, ...]:
    """Return free functions that explain what some hypotheses do not, the largest gain first.

    Args:
        gram: Gram matrices of all columns, free functions included.
        sums: the block regression of its columns.
        significance: of hypotheses in this regression.
        chosen: the selected hypotheses.
        healthy: hypotheses that hold for a healthy machine too, whose size may drift.
    """
    drivers = [d for d in gram.terms if isinstance(d, Driver)]
    assumed = [*chosen, *healthy]
    base = _columns(gram, assumed)
    found: dict[Driver, Unexplained] = {}
    limits, chance = sums.thresholds, sums.thresholds.false_alarm_rate / max(1, len(drivers))
    for driver in drivers:
        own = gram.columns_of([driver])
        gained = sums.gain_within if driver.of_time else sums.gain
        gain, p_value = gained(base, own), sums.p_value(base, own)
        if gain.total > limits.unknown_sigma * gain.error and p_value < chance:
            share = significance.share(base, own)
            if share >= limits.unknown_share:
                found[driver] = Unexplained(driver, gain, share)
    found |= {each.driver: each for each in _drifting(gram, sums, significance, chosen, healthy)}
    began = [h.onset for h in assumed if h.onset]
    found |= {each.driver: each for each in _once(gram, sums, base, began)}
    reported = [
        e for e in found.values() if e.gain.total > _unreported(gram, sums, assumed, e.driver)
    ]
    return tuple(sorted(reported, key=lambda each: -each.gain.total))


def _once(
    gram: BlockGram, sums: BlockRegression, base: Index, began: Sequence[int]
) -> Iterator[Unexplained]:
    """Yield functions of time of residuals that one block dominates.

    A disturbance in a single block has no other block for a hold-out test, and is inconsistent with
    the model. Blocks at an onset are skipped, because the effect begins within one of them.
    """
    within, limits = [k for onset in began for k in (onset - 1, onset)], sums.thresholds
    for place, squares in gram.left_by_block(base, sums.weights(base)).items():
        squares = np.delete(squares, within)
        most = float(squares.max(initial=0.0))
        share = most / max(float(squares.sum()), _LEAST)
        drivers = [d for d in gram.terms if isinstance(d, Driver) and d.place == place]
        gains = {d: sums.gain_within(base, gram.columns_of([d])) for d in drivers if d.of_time}
        several = len(squares) >= limits.unknown_fewest_blocks
        if gains and several and share > limits.majority_share:
            excess = most - float(np.median(squares))
            driver = max(gains, key=lambda d: gains[d].total)
            yield Unexplained(driver, Gain(excess, excess), share)


def _unreported(
    gram: BlockGram, sums: BlockRegression, chosen: Sequence[Hypothesis], driver: Driver
) -> float:
    """Return the squares within the model-form error of the hypotheses that act in a residual."""
    (place,) = (p for p in gram.places if p.place == driver.place)
    taken = 0.0
    for hypothesis in chosen:
        own = gram.columns_of(hypothesis.candidates)
        if len(place.at(own)):
            base = _columns(gram, [h for h in chosen if h is not hypothesis])
            taken += max(0.0, sums.gain(base, own).total)
    return sums.thresholds.model_form_error_share * taken


def _drifting(
    gram: BlockGram,
    sums: BlockRegression,
    significance: Significance,
    chosen: Sequence[Hypothesis],
    healthy: Sequence[Hypothesis],
) -> Iterator[Unexplained]:
    """Yield functions of time that replace hypotheses whose size drifts over the blocks.

    Example: a load cell that warms up has no constant bias, yet a bias explains most of its error.
    """
    for hypothesis in chosen:
        base = _columns(gram, [h for h in (*chosen, *healthy) if h is not hypothesis])
        own = gram.columns_of(hypothesis.candidates)
        drift, p_value = sums.drift(base, own)
        held = drift.total <= sums.thresholds.minor_share * sums.gain(base, own).total
        if held or p_value >= sums.thresholds.false_alarm_rate / len(chosen):
            continue
        times = [d for d in _concerned(gram, hypothesis, own) if d.of_time]
        gains = [sums.gain_within(base, gram.columns_of([d])) for d in times]
        if times:
            k = int(np.argmax([gain.total for gain in gains]))
            share = significance.share(base, gram.columns_of([times[k]]))
            yield Unexplained(times[k], gains[k], share)


def _concerned(gram: BlockGram, hypothesis: Hypothesis, own: Index) -> list[Driver]:
    """Return drivers of the residuals where a hypothesis acts, on its own elements if possible."""
    places = gram.places_of(own)
    found = [d for d in gram.terms if isinstance(d, Driver) and d.place in places]
    near = [d for d in found if d.place.element in hypothesis.elements]
    return near or found


def _columns(gram: BlockGram, chosen: Iterable[Hypothesis]) -> Index:
    return gram.with_nuisance(c for h in chosen for c in h.candidates)
