"""Residuals and the search through them, about the best of what is known of drawn tensions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.block_regression import FOLDS
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.regression.time_constants import told_within
from cspm_ident.diagnosis.residuals.data_split import first_part, last_part, span_of
from cspm_ident.diagnosis.residuals.free_shapes import Knots
from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation, in_noise, steady
from cspm_ident.diagnosis.residuals.spectral_lines import Line, lines_of, with_lines
from cspm_ident.diagnosis.selection.search import Search
from cspm_ident.diagnosis.selection.search_result import SearchResult
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.signals.measurement import Measurement
from cspm_msgs_py.errors import InputError
from cspm_sim.effects import Channel, Effect

Array = NDArray[np.float64]
Progress = Callable[[str], None]
Parts = Sequence[Sequence[Equation]]

# Below which differences of rows have no median to speak of.
_FEWEST_ROWS = 8


class Recordings(NamedTuple):
    """In which to look, and on which to judge what was found; see `diagnose`."""

    searched: Sequence[Measurement]
    held_out: Sequence[Measurement]

    @property
    def are_drawn(self) -> bool:
        """Whether torques tell tensions that no load cell measured."""
        return any(m.tension is None and m.machine.bar is not None for m in self.searched)


class SearchPass(NamedTuple):
    """A search, and what it was done in.

    Attributes:
        search_parts: equations of what was searched.
        judge_parts: of what was not.
        hums: lines in what was searched of each recording.
        noise: of each residual, its unit.
        block: length of the blocks [s].
        search: through the residuals.
        knots: of the free functions.
        assumed: weights about which residuals were taken to first order.
    """

    search_parts: Parts
    judge_parts: Parts
    hums: Sequence[tuple[Line, ...]]
    noise: dict[Place, Array]
    block: float
    search: Search
    knots: Knots
    assumed: Mapping[Candidate, Array]


def searched_for(
    recordings: Recordings,
    effects: Sequence[Effect],
    progress: Progress,
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> tuple[SearchPass, SearchResult]:
    """Return what a search finds, and the search.

    The law of a cable holds to first order about its tension. One that was drawn from a torque has
    the winch's friction in it: what explains most is looked for first, and if it is a winch's, laws
    are taken about the tensions without it; so again if more was found of winches in the end.

    Args:
        recordings: what to look in.
        effects: that are looked for.
        progress: called with what is being done.
        thresholds: of the diagnosis.

    Raises:
        InputError: the recordings have no residual that could be looked at, or are too short.
    """
    search_pass = _search_pass(recordings, {}, effects, progress, thresholds)
    if recordings.are_drawn:
        first = search_pass.search.first()
        assumed = _of_winches(search_pass.search, () if first is None else (first,))
        if assumed:
            # Before the next is made: columns are most of the memory.
            del search_pass
            search_pass = _search_pass(recordings, assumed, effects, progress, thresholds)
    found = search_pass.search.run()
    if recordings.are_drawn:
        assumed = _of_winches(search_pass.search, [each.hypothesis for each in found.findings])
        if not assumed.keys() <= search_pass.assumed.keys():
            del search_pass
            search_pass = _search_pass(recordings, assumed, effects, progress, thresholds)
            found = search_pass.search.run()
    return search_pass, found


def _of_winches(search: Search, hypotheses: Iterable[Hypothesis]) -> dict[Candidate, Array]:
    """Return the weights of what winches add to torques all the time."""
    lasting = [h for h in hypotheses if not h.onset]
    weights = search.fits.values(lasting) if lasting else {}
    return {
        c: own
        for c, own in weights.items()
        if c.effect.signature.regression.channel is Channel.SHAFT
    }


def _search_pass(
    recordings: Recordings,
    assumed: Mapping[Candidate, Array],
    effects: Sequence[Effect],
    progress: Progress,
    thresholds: Thresholds,
) -> SearchPass:
    searched, held_out = recordings
    longest = max(m.duration for m in searched)
    visible, knots = [told_within(e, longest) for e in effects], Knots()

    def equations(measurements: Sequence[Measurement]) -> Parts:
        return [
            equations_of(m, visible, knots, progress, assumed=assumed, thresholds=thresholds)
            for m in measurements
        ]

    found = equations(searched)
    _check(searched, found)
    parts = found if held_out else first_part(found, thresholds)
    hums = [hums_of(m, part, {}, thresholds) for m, part in zip(searched, parts, strict=True)]
    parts = _beside(parts, hums)
    judged = equations(held_out) if held_out else _beside(last_part(found, thresholds), hums)
    noise = noise_of(steady(parts))
    seconds = sum(b - a for a, b in map(span_of, parts))
    block = max(thresholds.shortest_block_s, seconds / thresholds.block_count)
    gram = gather(in_noise(steady(parts), noise), block)
    if gram.blocks < FOLDS:
        raise _too_short(searched[0], seconds, thresholds)
    search = Search(gram, progress, thresholds)
    return SearchPass(parts, judged, hums, noise, block, search, knots, assumed)


def _too_short(measurement: Measurement, seconds: float, thresholds: Thresholds) -> InputError:
    least, share = FOLDS * thresholds.shortest_block_s, 100.0 * thresholds.searched_share
    return InputError(
        f"{measurement.path}: {seconds:.1f} s to search, allowed: {least:g} s or more; without"
        f" --held-out {share:.3g} % of a recording are searched"
    )


def _check(searched: Sequence[Measurement], found: Parts) -> None:
    for measurement, equations in zip(searched, found, strict=True):
        if not equations:
            raise InputError(
                f"{measurement.path}: no residual, allowed: recordings with /winches/state angle"
                " and torque, and with /cables/tension where there are cables"
            )


def hums_of(
    measurement: Measurement,
    part: Sequence[Equation],
    weights: Mapping[Candidate, Array],
    thresholds: Thresholds,
) -> tuple[Line, ...]:
    """Return the lines in what was searched of a recording, beyond what was found."""
    if measurement.machine.bar is None:
        return ()
    start, end = span_of(part)
    return lines_of(measurement.within(start, end), weights, thresholds)


def _beside(parts: Parts, lines: Sequence[Sequence[Line]]) -> Parts:
    """Return equations in which each recording's lines are fitted always."""
    return [with_lines(part, own) for part, own in zip(parts, lines, strict=True)]


def noise_of(parts: Parts) -> dict[Place, Array]:
    """Return the noise of every residual, the median over recordings and stretches."""
    found: dict[Place, list[Array]] = {}
    for equations in parts:
        for equation in equations:
            if len(equation.times) > _FEWEST_ROWS:
                found.setdefault(equation.place, []).append(equation.noise)
    return {place: np.median(noises, axis=0) for place, noises in found.items()}
