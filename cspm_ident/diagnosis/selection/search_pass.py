"""Search passes: residuals and the search in them, about the best virtual load cell."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.block_regression import FOLDS
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.regression.time_constants import covered_within
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

# An equation needs more rows for a usable median of their differences.
_FEWEST_ROWS = 8


class Recordings(NamedTuple):
    """Recordings to search, and recordings for the hold-out test; see `diagnose`."""

    searched: Sequence[Measurement]
    held_out: Sequence[Measurement]

    @property
    def are_drawn(self) -> bool:
        """Whether a recording has virtual load cells: tensions estimated from winch torques."""
        return any(m.tension is None and m.machine.bar is not None for m in self.searched)


class SearchPass(NamedTuple):
    """A search with its input.

    Attributes:
        search_parts: equations of the searched data.
        judge_parts: equations of the held-out data.
        hums: spectral lines in the searched part of each recording.
        noise: standard deviation of each residual's noise, which is its unit.
        block: length of the blocks [s].
        search: the search in these residuals.
        knots: of the free functions.
        assumed: weights about which residuals were linearised.
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
    """Return the last search pass and its result.

    The law of a cable is linearised about its tension. A virtual load cell's tension contains the
    winch's friction. If the effect of largest gain is a winch effect, a second pass linearises
    about the tension without it. If the search then finds further winch effects, one more pass
    follows.

    Args:
        recordings: the recordings to search.
        effects: the effects to test, of the machine's size; see `of_size`.
        progress: called with the name of each step.
        thresholds: of the diagnosis.

    Raises:
        InputError: the recordings have no residual to search, or are too short.
    """
    search_pass = _search_pass(recordings, {}, effects, progress, thresholds)
    if recordings.are_drawn:
        first = search_pass.search.first()
        assumed = _of_winches(search_pass.search, () if first is None else (first,))
        if assumed:
            # Columns take most of the memory, so they are freed before the next pass.
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
    """Return the weights of winch effects on the torque that have no onset."""
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
    knots = Knots()
    visible = [covered_within(e, longest) for e in effects]

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
    if not noise:
        raise _reversing(searched[0])
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


def _reversing(measurement: Measurement) -> InputError:
    return InputError(
        f"{measurement.path}: the shafts reverse all the time, allowed: {_FEWEST_ROWS + 1} or more"
        " windows of 40 ms with a known direction; move slowly over longer ways, or record the"
        " drive's own speed"
    )


def _check(searched: Sequence[Measurement], found: Parts) -> None:
    for measurement, equations in zip(searched, found, strict=True):
        if not equations:
            raise InputError(
                f"{measurement.path}: no residual, allowed: recordings with /winches/state angle"
                " and torque, and with /cables/tension where there are cables, or with /bar/pose"
                " and /cables/tension; poses and motor angles alone: cspm identify lengths"
            )


def hums_of(
    measurement: Measurement,
    part: Sequence[Equation],
    weights: Mapping[Candidate, Array],
    thresholds: Thresholds,
) -> tuple[Line, ...]:
    """Return spectral lines in the searched part of a recording, beyond the fitted effects."""
    if measurement.machine.bar is None:
        return ()
    start, end = span_of(part)
    return lines_of(measurement.within(start, end), weights, thresholds)


def _beside(parts: Parts, lines: Sequence[Sequence[Line]]) -> Parts:
    """Return equations in which each recording's spectral lines are always fitted."""
    return [with_lines(part, own) for part, own in zip(parts, lines, strict=True)]


def noise_of(parts: Parts) -> dict[Place, Array]:
    """Return the noise of every residual: the median over recordings and their equations."""
    found: dict[Place, list[Array]] = {}
    for equations in parts:
        for equation in equations:
            if len(equation.times) > _FEWEST_ROWS:
                found.setdefault(equation.place, []).append(equation.noise)
    return {place: np.median(noises, axis=0) for place, noises in found.items()}
