"""From recordings to a verdict: where the model misses, what is missing, and how well it helps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import compress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_gram import Evidence, gather
from cspm_ident.diagnosis.regression.coefficients import Weights
from cspm_ident.diagnosis.regression.hypothesis import Findings, Named
from cspm_ident.diagnosis.residuals.aliased_tension import chatters_of
from cspm_ident.diagnosis.residuals.data_split import first_part, span_of, whole_part
from cspm_ident.diagnosis.residuals.free_shapes import Driver, Knots
from cspm_ident.diagnosis.residuals.load_cell_clock import on_drives_clock
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import in_noise, steady
from cspm_ident.diagnosis.residuals.spectral_lines import Line
from cspm_ident.diagnosis.selection.onset import Onset
from cspm_ident.diagnosis.selection.refinement import Cut
from cspm_ident.diagnosis.selection.region import Region, region_of
from cspm_ident.diagnosis.selection.safeguards import ALL_SAFEGUARDS, Safeguards
from cspm_ident.diagnosis.selection.search import Search
from cspm_ident.diagnosis.selection.search_pass import (
    Parts,
    Progress,
    Recordings,
    hums_of,
    searched_for,
)
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.diagnosis.validation.acceptance import Standing, standing_of
from cspm_ident.diagnosis.validation.detection_limits import Limit, detection_limits
from cspm_ident.diagnosis.validation.found_model import Data, Model, modelled
from cspm_ident.diagnosis.validation.holdout_residuals import HeldOut, free_functions, judged
from cspm_ident.diagnosis.validation.holdout_simulation import SimulatedFit, Worth, baselines_of
from cspm_ident.diagnosis.validation.residual_curves import Curve, held_out_curves
from cspm_ident.diagnosis.validation.reversals import with_wider
from cspm_ident.signals.measurement import Measurement
from cspm_sim.effects import Effect

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Shape:
    """A free function that explains what no effect does.

    Attributes:
        driver: of what, in which residual.
        knots: in the signal's unit, shape (k,).
        values: what it adds there, less their mean, in the residual's unit, (k,).
    """

    driver: Driver
    knots: Array
    values: Array


class Detail(NamedTuple):
    """What is known of a finding beside its numbers.

    Attributes:
        onset: when it began; None where it acts all the time.
        region: where it shows; None where it does everywhere.
        worth: of it in simulations of held-out data; None where they cannot tell.
        faint: whether what was not searched shows little of it.
    """

    onset: Onset | None
    region: Region | None
    worth: Worth | None
    faint: bool = False


@dataclass(frozen=True, eq=False, kw_only=True)
class Diagnosis:
    """What a diagnosis found.

    Attributes:
        searched: recordings in which was looked.
        held_out: those on which it was judged; empty where the end of each searched one was.
        findings: what was found, without what did not stand on held-out data.
        details: of each of these that is named.
        rejected: what did not.
        negligible: what is there, but no more than in a sound machine; taken into account.
        weights: of each candidate found or negligible, with half the width of its 95 % interval.
        fit: residual by residual.
        simulated: quantity by quantity, by simulation.
        shapes: of the unknown, in the order of `findings.unknown`.
        lines: periodic forces from outside, and before them tensions that alternate.
        limits: from which size on effects would have been told.
        silent: effects and elements that these recordings cannot show.
        places: the residuals that there are.
        starts: of the blocks [s], shape (blocks,).
        curves: the residuals on what was not searched, over time.
        noise: of each residual, what differs from row to row, one number per channel.
        spectra: of candidates of which there may be more at other time constants, the upper end of
            the interval of the weights of all together.
        thresholds: that decided it.
    """

    searched: Sequence[Measurement]
    held_out: Sequence[Measurement]
    findings: Findings
    details: tuple[Detail, ...]
    rejected: tuple[Named, ...]
    negligible: tuple[Named, ...]
    weights: Weights
    fit: tuple[HeldOut, ...]
    simulated: tuple[SimulatedFit, ...]
    shapes: tuple[Shape, ...]
    lines: tuple[Line, ...]
    limits: tuple[Limit, ...]
    silent: tuple[tuple[str, tuple[str, ...]], ...]
    places: tuple[Place, ...]
    starts: Array
    curves: tuple[Curve, ...]
    noise: dict[Place, Array]
    spectra: Mapping[Candidate, Array] = field(default_factory=dict)
    thresholds: Thresholds = DEFAULT_THRESHOLDS


def diagnose(
    searched: Sequence[Measurement],
    held_out: Sequence[Measurement] = (),
    progress: Progress = lambda _: None,
    safeguards: Safeguards = ALL_SAFEGUARDS,
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> Diagnosis:
    """Look for what the described machine lacks.

    Args:
        searched: recordings in which to look; all of one machine.
        held_out: others on which to judge what was found; none: the last part of each searched one.
        progress: called with what is being done.
        safeguards: all of them, but for comparisons.
        thresholds: that decide what is reported.

    Raises:
        InputError: the recordings have no residual that could be looked at, or are too short.
    """
    searched, held_out = (
        [on_drives_clock(each, thresholds) for each in own] for own in (searched, held_out)
    )
    # No name for the look itself: its columns go as soon as they are not needed.
    (search_parts, judge_parts, hums, noise, block, search, knots, supposed), found = searched_for(
        Recordings(searched, held_out), progress, safeguards, thresholds
    )
    evidence = search.evidence
    found = with_wider(
        found, in_noise(search_parts, noise), block, lambda e: safeguards.sums(e, thresholds)
    )
    progress("held-out data")
    judge = _judge(in_noise(judge_parts, noise), found, block)
    search_parts, judge_parts = _found_only(search_parts, found), _found_only(judge_parts, found)
    rows = in_noise(search_parts, noise)
    judge_by = judge if safeguards.held_out else None
    standing = standing_of(search, found, judge_by, searched, rows, block)
    starts = [span_of(part)[0] for part in judge_parts]
    retuned = search.retuned()
    progress("parameters, and simulation of held-out data")
    baselines = baselines_of(held_out or searched, starts, retuned)
    cut: Cut = whole_part if held_out else partial(first_part, thresholds=thresholds)
    unseen = standing.faint, standing.plain
    data = Data(searched, cut, baselines, rows, noise, block, supposed, *unseen)
    standing, model = _useful(search, standing, data, safeguards)
    kept, unknown = standing.kept, standing.unknown(search, found)
    values = {c: w for c, (w, _) in model.weights.items()}
    first = search.fits.values([each.hypothesis for each in kept])
    told = _told(search, standing, model)
    regions = [region_of(data.rows, kept[k].hypothesis.candidates, first, thresholds) for k in told]
    free = free_functions(evidence, judge)
    chatters = tuple(
        line for each in (*searched, *held_out) for line in chatters_of(each, thresholds)
    )
    return Diagnosis(
        searched=searched,
        held_out=held_out,
        findings=Findings(
            tuple(told.values()),
            unknown,
            found.candidates,
            frozenset(line.place.element for line in chatters),
        ),
        details=tuple(
            Detail(model.onsets[k], region, model.worth[k], kept[k] in standing.faint)
            for k, region in zip(told, regions, strict=True)
        ),
        rejected=(*standing.rejected, *standing.fed_back),
        negligible=tuple(compress(kept, model.negligible)),
        weights=model.weights,
        fit=judged(held_out or searched, starts, retuned, values, noise, free, thresholds),
        simulated=model.simulated,
        shapes=_shapes(search, standing.sure, knots, [each[0] for each in unknown]),
        lines=(*chatters, *_lasting(hums, searched, search_parts, values, thresholds)),
        limits=detection_limits(search, kept),
        silent=_silent(search, safeguards.effects),
        places=tuple(place.place for place in evidence.places),
        starts=evidence.times,
        curves=held_out_curves(steady(judge_parts), first),
        noise=noise,
        spectra=model.spectra,
        thresholds=thresholds,
    )


def _useful(
    search: Search, standing: Standing, data: Data, safeguards: Safeguards
) -> tuple[Standing, Model]:
    """Return what stands and is of use in simulations of held-out data, and its model."""
    model = modelled(search, standing.kept, data)
    while gone := model.useless if safeguards.held_out else model.untenable:
        standing = standing.without(gone)
        model = modelled(search, standing.kept, data)
    return standing, model


def _told(search: Search, standing: Standing, model: Model) -> dict[int, Named]:
    """Return what is told, by where it is in what was kept, the most important first."""
    hypotheses = [each.hypothesis for each in standing.kept]
    told = {
        k: search.judged_again(each, hypotheses) if standing.has_given_up else each
        for k, each in enumerate(standing.kept)
        if not model.negligible[k]
    }

    def rank(k: int) -> tuple[bool, float]:
        return standing.kept[k] in standing.doubted, -told[k].gain.total

    return {k: told[k] for k in sorted(told, key=rank)}


def _lasting(
    lines: Sequence[Sequence[Line]],
    searched: Sequence[Measurement],
    parts: Parts,
    weights: Mapping[Candidate, Array],
    thresholds: Thresholds,
) -> tuple[Line, ...]:
    """Return the lines that are there still, now that all else is known."""
    found = []
    for own, measurement, part in zip(lines, searched, parts, strict=True):
        now = hums_of(measurement, part, weights, thresholds) if own else ()
        found += [line for line in now if any(line.is_same(before, thresholds) for before in own)]
    return tuple(found)


def _judge(parts: Parts, found: Findings, block: float) -> Evidence:
    """Return the sums of held-out residuals beside what was found and all free functions."""
    terms = _named(found) | {
        t for part in parts for e in part for t in e.columns if isinstance(t, Driver)
    }
    return gather([[e.only(terms) for e in part] for part in parts], block)


def _named(found: Findings) -> set[Candidate | Driver]:
    told = [each.hypothesis.candidates for each in found.named]
    rivals = [rival.candidates for each in found.named for rival in each.alternatives]
    return {candidate for own in (*told, *rivals) for candidate in own}


def _found_only(parts: Parts, found: Findings) -> Parts:
    """Return equations without the columns of all that was not found, which nothing needs more."""
    named = _named(found)
    return [[equation.only(named) for equation in part] for part in parts]


def _shapes(
    search: Search, kept: Sequence[Named], knots: Knots, drivers: Sequence[Driver]
) -> tuple[Shape, ...]:
    """Return the free functions, each fitted to what is left by what was kept."""
    base = search.fits.columns([each.hypothesis for each in kept])
    found = []
    for driver in drivers:
        values = search.sums.weights_beyond(base, search.evidence.columns_of([driver]))
        found.append(Shape(driver, knots.of(driver), values - values.mean()))
    return tuple(found)


def _silent(search: Search, effects: Sequence[Effect]) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Return effects that have no column that is not zero, with the elements."""
    heard = {(c.effect_id, c.element) for c in search.heard}
    seen = {(t.effect_id, t.element) for t in search.evidence.terms if isinstance(t, Candidate)}
    found = []
    for effect in effects:
        deaf = sorted(element for name, element in seen - heard if name == effect.id)
        if deaf or not any(name == effect.id for name, _ in seen):
            found.append((effect.id, tuple(deaf)))
    return tuple(found)
