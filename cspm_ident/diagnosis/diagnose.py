"""The diagnosis of recordings: search, hold-out test, refined parameters and simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.finding import (
    Finding,
    HoldOut,
    Shape,
    Status,
    Unexplained,
    reported_status,
)
from cspm_ident.diagnosis.regression.block_gram import BlockGram, gather
from cspm_ident.diagnosis.residuals.aliased_tension import chatters_of
from cspm_ident.diagnosis.residuals.data_split import first_part, span_of, whole_part
from cspm_ident.diagnosis.residuals.free_shapes import Driver, Knots
from cspm_ident.diagnosis.residuals.load_cell_clock import on_drives_clock
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.residuals.residual_equation import in_noise, steady
from cspm_ident.diagnosis.residuals.spectral_lines import Line
from cspm_ident.diagnosis.selection.refinement import Cut
from cspm_ident.diagnosis.selection.region import region_of
from cspm_ident.diagnosis.selection.search import Search
from cspm_ident.diagnosis.selection.search_pass import (
    Parts,
    Progress,
    Recordings,
    hums_of,
    searched_for,
)
from cspm_ident.diagnosis.selection.search_result import SearchResult
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.diagnosis.validation.acceptance import Acceptance, accepted
from cspm_ident.diagnosis.validation.detection_limits import detection_limits
from cspm_ident.diagnosis.validation.found_model import Data, Model, modelled
from cspm_ident.diagnosis.validation.holdout_residuals import free_functions, judged
from cspm_ident.diagnosis.validation.holdout_simulation import baselines_of
from cspm_ident.diagnosis.validation.residual_curves import held_out_curves
from cspm_ident.diagnosis.validation.reversals import with_wider
from cspm_ident.signals.measurement import Measurement
from cspm_sim.effects import Effect, catalogue

Array = NDArray[np.float64]


def diagnose(
    searched: Sequence[Measurement],
    held_out: Sequence[Measurement] = (),
    progress: Progress = lambda _: None,
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
    effects: Sequence[Effect] | None = None,
) -> Diagnosis:
    """Return the effects that the test-bed file of some recordings lacks.

    Args:
        searched: recordings to search; all of one machine.
        held_out: recordings for the hold-out test. If empty, the last part of each searched one.
        progress: called with the name of each step.
        thresholds: those that decide what is reported.
        effects: the effects to test; None for the whole catalogue.

    Raises:
        InputError: the recordings have no residual to search, or are too short.
    """
    searched, held_out = (
        [on_drives_clock(each, thresholds) for each in own] for own in (searched, held_out)
    )
    effects = list(catalogue().values()) if effects is None else effects
    # The search pass has no name here, so that its columns are freed once they are unused.
    (search_parts, judge_parts, hums, noise, block, search, knots, assumed), found = searched_for(
        Recordings(searched, held_out), effects, progress, thresholds
    )
    gram = search.gram
    found = with_wider(found, in_noise(search_parts, noise), block, thresholds)
    progress("held-out data")
    judge = _judge(in_noise(judge_parts, noise), found, block)
    search_parts, judge_parts = _found_only(search_parts, found), _found_only(judge_parts, found)
    rows = in_noise(search_parts, noise)
    acceptance = accepted(search, found, judge, searched, rows, block)
    starts = [span_of(part)[0] for part in judge_parts]
    retuned = search.retuned()
    progress("parameters, and simulation of held-out data")
    baselines = baselines_of(held_out or searched, starts, retuned)
    cut: Cut = whole_part if held_out else partial(first_part, thresholds=thresholds)
    data = Data(searched, cut, baselines, rows, noise, block, assumed)
    acceptance, model = _useful(search, acceptance, data)
    unexplained = acceptance.unexplained(search, found)
    lines = tuple(line for each in (*searched, *held_out) for line in chatters_of(each, thresholds))
    aliased = {line.place.element for line in lines}
    values = {c: w for c, (w, _) in model.weights.items()}
    first = search.fits.values([each.hypothesis for each in acceptance.kept])
    free = free_functions(gram, judge)
    reported = _reported(search, acceptance, model)
    negligible = (each for each in model.findings if each.status is Status.NEGLIGIBLE)
    gone = (*acceptance.rejected, *acceptance.fed_back)

    def described(finding: Finding) -> Finding:
        status = reported_status(finding, unexplained, aliased, thresholds)
        region = region_of(rows, finding.hypothesis.candidates, first, thresholds)
        return replace(finding, status=status, region=region)

    return Diagnosis(
        searched=searched,
        held_out=held_out,
        findings=(*map(described, reported), *negligible, *gone),
        unexplained=_with_shapes(search, acceptance.tested, knots, unexplained),
        tested=found.tested,
        fit=judged(held_out or searched, starts, retuned, values, noise, free, thresholds),
        simulated=model.simulated,
        lines=(*lines, *_lasting(hums, searched, search_parts, values, thresholds)),
        limits=detection_limits(search, acceptance.kept),
        not_excited=_not_excited(search, effects),
        places=tuple(place.place for place in gram.places),
        curves=held_out_curves(steady(judge_parts), first),
        noise=noise,
        thresholds=thresholds,
    )


def _useful(search: Search, acceptance: Acceptance, data: Data) -> tuple[Acceptance, Model]:
    """Return the acceptance and the model after rejecting findings until none is useless."""
    model = modelled(search, acceptance.kept, data)
    while gone := model.useless:
        acceptance = acceptance.rejecting(gone)
        model = modelled(search, acceptance.kept, data)
    return acceptance, model


def _reported(search: Search, acceptance: Acceptance, model: Model) -> list[Finding]:
    """Return the reported findings, the largest gain first.

    Findings on which the hold-out test is silent come last. Gains and alternatives are those beside
    the accepted findings.
    """
    hypotheses = [each.hypothesis for each in acceptance.kept]
    found = [each for each in model.findings if each.status is not Status.NEGLIGIBLE]
    if acceptance.has_rejected:
        found = [search.judged_again(each, hypotheses) for each in found]
    return sorted(found, key=lambda each: (each.holdout is HoldOut.SILENT, -each.gain.total))


def _lasting(
    lines: Sequence[Sequence[Line]],
    searched: Sequence[Measurement],
    parts: Parts,
    weights: Mapping[Candidate, Array],
    thresholds: Thresholds,
) -> tuple[Line, ...]:
    """Return the spectral lines that remain beyond the final model."""
    found = []
    for own, measurement, part in zip(lines, searched, parts, strict=True):
        now = hums_of(measurement, part, weights, thresholds) if own else ()
        found += [line for line in now if any(line.is_same(before, thresholds) for before in own)]
    return tuple(found)


def _judge(parts: Parts, found: SearchResult, block: float) -> BlockGram:
    """Return Gram matrices of held-out residuals, findings, alternatives and free functions."""
    terms = _candidates(found) | {
        t for part in parts for e in part for t in e.columns if isinstance(t, Driver)
    }
    return gather([[e.only(terms) for e in part] for part in parts], block)


def _candidates(found: SearchResult) -> set[Candidate | Driver]:
    own = [each.hypothesis.candidates for each in found.findings]
    rivals = [rival.candidates for each in found.findings for rival in each.alternatives]
    return {candidate for each in (*own, *rivals) for candidate in each}


def _found_only(parts: Parts, found: SearchResult) -> Parts:
    """Return equations with the columns of findings and alternatives only, to free memory."""
    terms = _candidates(found)
    return [[equation.only(terms) for equation in part] for part in parts]


def _with_shapes(
    search: Search, kept: Sequence[Finding], knots: Knots, unexplained: Sequence[Unexplained]
) -> tuple[Unexplained, ...]:
    """Return unexplained residuals with their free functions, fitted beside the findings `kept`."""
    base = search.fits.columns([each.hypothesis for each in kept])
    found = []
    for each in unexplained:
        values = search.sums.weights_beyond(base, search.gram.columns_of([each.driver]))
        found.append(each._replace(shape=Shape(knots.of(each.driver), values - values.mean())))
    return tuple(found)


def _not_excited(
    search: Search, effects: Sequence[Effect]
) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Return effects whose columns are zero on some or all elements, with those elements."""
    heard = {(c.effect_id, c.element) for c in search.heard}
    seen = {(t.effect_id, t.element) for t in search.gram.terms if isinstance(t, Candidate)}
    found = []
    for effect in effects:
        deaf = sorted(element for name, element in seen - heard if name == effect.id)
        if deaf or not any(name == effect.id for name, _ in seen):
            found.append((effect.id, tuple(deaf)))
    return tuple(found)
