"""The diagnosis of recordings: search, hold-out test, refined parameters and simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.empirical.empirical_model import Searched, empirical_tables
from cspm_ident.diagnosis.empirical.table_holdout import (
    confirmed_tables,
    simulated_tables,
    with_tables,
)
from cspm_ident.diagnosis.finding import (
    Finding,
    HoldOut,
    Shape,
    Status,
    Unexplained,
    reported_status,
)
from cspm_ident.diagnosis.judged_search import JudgedSearch, searched_and_judged
from cspm_ident.diagnosis.one_number import with_one_number
from cspm_ident.diagnosis.parameter import Coefficients
from cspm_ident.diagnosis.residuals.aliased_tension import chatters_of
from cspm_ident.diagnosis.residuals.data_split import first_part, whole_part
from cspm_ident.diagnosis.residuals.file_effects import with_file_accuracies, with_file_bounds
from cspm_ident.diagnosis.residuals.free_shapes import Knots
from cspm_ident.diagnosis.residuals.load_cell_clock import on_drives_clock
from cspm_ident.diagnosis.residuals.machine_scales import of_size
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation, steady
from cspm_ident.diagnosis.residuals.spectral_lines import Line
from cspm_ident.diagnosis.selection.refinement import Cut
from cspm_ident.diagnosis.selection.region import region_of
from cspm_ident.diagnosis.selection.search import Search
from cspm_ident.diagnosis.selection.search_pass import (
    Progress,
    Recordings,
    hums_of,
)
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.diagnosis.validation.acceptance import Acceptance, with_rivals
from cspm_ident.diagnosis.validation.detection_limits import detection_limits
from cspm_ident.diagnosis.validation.extrapolation import Extrapolation, extrapolations
from cspm_ident.diagnosis.validation.found_model import Data, Model, modelled
from cspm_ident.diagnosis.validation.holdout_residuals import HeldOut, free_functions, judged
from cspm_ident.diagnosis.validation.holdout_simulation import (
    SimulatedFit,
    baselines_of,
    with_tables_simulated,
)
from cspm_ident.diagnosis.validation.remainder import (
    is_immaterial,
)
from cspm_ident.diagnosis.validation.residual_curves import held_out_curves
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
    recordings = Recordings(
        *([on_drives_clock(each, thresholds) for each in own] for own in (searched, held_out))
    )
    effects = list(catalogue().values()) if effects is None else effects
    effects = with_file_bounds(effects, recordings.searched[0].machine)
    effects = of_size(effects, recordings.searched)
    # What a file states is in its own units, whatever the machine's size.
    effects = with_file_accuracies(effects, recordings.searched[0].testbed)
    own = searched_and_judged(recordings, effects, progress, thresholds)
    progress("parameters, and simulation of held-out data")
    data = _data(own)
    acceptance, model = _useful(own, data)
    own = own._replace(acceptance=acceptance)
    acceptance, model = with_one_number(own, model, data) or (acceptance, model)
    return _diagnosis(own._replace(acceptance=acceptance), model, data, effects)


def _data(own: JudgedSearch) -> Data:
    """Return what models are fitted to, with simulations of the held-out data."""
    (searched, held_out), last = own.recordings, own.last
    cut: Cut = whole_part if held_out else partial(first_part, thresholds=own.thresholds)
    baselines = baselines_of(own.judges, own.starts, own.retuned)
    return Data(searched, cut, baselines, own.rows, last.noise, last.block, last.assumed)


def _diagnosis(own: JudgedSearch, model: Model, data: Data, effects: Sequence[Effect]) -> Diagnosis:
    """Return what is reported of a judged search and the model of its kept findings."""
    recordings, search, acceptance = own.recordings, own.search, own.acceptance
    left = own.searched_left(data, model)
    unexplained = own.beyond_noise(acceptance.unexplained(search, own.found), left)
    lines = _aliased_lines(recordings, own.thresholds)
    first, fit, limits = own.first, _fit(own, model, left), own.thresholds
    open_places = {e.driver.place for e in unexplained} | _not_at_noise(fit, limits)
    tables = _tables(own, model, data, open_places)
    return Diagnosis(
        searched=recordings.searched,
        held_out=recordings.held_out,
        findings=_findings(own, model, lines),
        unexplained=_with_shapes(search, acceptance.tested, own.last.knots, unexplained),
        tested=own.found.tested,
        tables=tables,
        fit=_with_tables(own, model, tables, fit),
        simulated=_simulated(model, data, tables),
        lines=(
            *lines,
            *(line for line in _lasting(own, model) if _matters(line, fit, own.thresholds)),
        ),
        limits=detection_limits(search, acceptance.kept),
        not_excited=_not_excited(search, effects),
        places=tuple(place.place for place in search.gram.places),
        curves=held_out_curves(steady(own.last.judge_parts), first),
        noise=own.last.noise,
        extrapolated=_extrapolated(own, model),
        thresholds=own.thresholds,
    )


def _extrapolated(own: JudgedSearch, model: Model) -> tuple[Extrapolation, ...]:
    """Return the signals that held-out data take beyond what was searched, where findings act."""
    candidates = [c for each in model.findings for c in each.hypothesis.candidates]
    gram = own.search.gram
    places = gram.places_of(gram.columns_of(candidates))
    parts = own.last.search_parts, own.last.judge_parts
    return extrapolations(*parts, places, own.thresholds.material_share)


def _aliased_lines(recordings: Recordings, thresholds: Thresholds) -> tuple[Line, ...]:
    """Return the spectral lines of aliased tensions in all recordings."""
    every = (*recordings.searched, *recordings.held_out)
    return tuple(line for each in every for line in chatters_of(each, thresholds))


def _findings(
    own: JudgedSearch,
    model: Model,
    lines: Sequence[Line],
) -> tuple[Finding, ...]:
    """Return all findings: reported with status and region, negligible, and rejected.

    Args:
        own: the judged search.
        model: of the findings that are kept.
        lines: of aliased tensions.
    """
    aliased = {line.place.element for line in lines}

    def described(finding: Finding) -> Finding:
        status = reported_status(finding, aliased)
        region = region_of(own.rows, finding.hypothesis.candidates, own.first, own.thresholds)
        return replace(finding, status=status, region=region)

    reported = map(described, _reported(own.search, own.acceptance, model))
    negligible = (each for each in model.findings if each.status is Status.NEGLIGIBLE)
    gone = (*own.acceptance.rejected, *own.acceptance.fed_back)
    return (*reported, *negligible, *(_with_numbers(own, each) for each in gone))


def _with_numbers(own: JudgedSearch, finding: Finding) -> Finding:
    """Return a rejected finding with the numbers that it would have beside those in the model."""
    if finding.coefficients:
        return finding
    kept = [each.hypothesis for each in own.acceptance.kept]
    weights = own.search.fits.weights([*kept, finding.hypothesis])
    found = (Coefficients(c, *weights[c]) for c in finding.hypothesis.candidates)
    return replace(finding, coefficients=tuple(found))


def _tables(
    own: JudgedSearch, model: Model, data: Data, places: Set[Place]
) -> dict[Candidate, Array]:
    """Return tables of values for some residuals, as far as they lower held-out ones."""
    values, noise = model.values, own.last.noise
    if not (values or places):
        return {}
    searched = Searched(
        data.searched, data.searched_part, values, noise, own.last.block, own.thresholds
    )
    tables = empirical_tables(searched, places)
    parts = list(zip(own.judges, own.starts, strict=True))
    tables = confirmed_tables(parts, values, tables, noise, own.thresholds)
    return simulated_tables(model.simulated, data.baselines, values, tables)


def _fit(
    own: JudgedSearch, model: Model, left: Mapping[Place, Sequence[Equation]]
) -> tuple[HeldOut, ...]:
    """Return how large the held-out residuals are with and without the model."""
    free = free_functions(own.search.gram, own.judge)
    given = own.retuned, model.values, own.last.noise, free, left
    return judged(own.judges, own.starts, *given, own.thresholds)


def _with_tables(
    own: JudgedSearch,
    model: Model,
    tables: Mapping[Candidate, Array],
    fit: tuple[HeldOut, ...],
) -> tuple[HeldOut, ...]:
    """Return the held-out fits, with the tables where there are any."""
    found = {**model.values, **tables}
    given = own.judges, own.starts, found, own.last.noise
    return with_tables(fit, *given) if tables else fit


def _not_at_noise(fit: Sequence[HeldOut], thresholds: Thresholds) -> set[Place]:
    return {each.place for each in fit if each.is_at_noise(thresholds) is False}


def _simulated(
    model: Model, data: Data, tables: Mapping[Candidate, Array]
) -> tuple[SimulatedFit, ...]:
    """Return the simulations of held-out data, with the tables where there are any."""
    if not tables:
        return model.simulated
    return with_tables_simulated(model.simulated, data.baselines, {**model.values, **tables})


def _useful(own: JudgedSearch, data: Data) -> tuple[Acceptance, Model]:
    """Return the acceptance and the model after rejecting findings until none is useless.

    A rival takes the place of a rejected finding where one passes the hold-out test.
    """
    search, acceptance = own.search, own.acceptance
    model = modelled(search, acceptance.kept, data, acceptance.beside)
    while gone := model.useless:
        acceptance = with_rivals(search, own.judge, acceptance.rejecting(gone), gone)
        model = modelled(search, acceptance.kept, data, acceptance.beside)
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


def _matters(line: Line, fit: Sequence[HeldOut], thresholds: Thresholds) -> bool:
    """Return whether a spectral line is larger than the sensor's accuracy or a material share."""
    own = (each.remainders[line.channel :] for each in fit if each.place == line.place)
    left = [parts[0] for parts in own if parts]
    rms = line.amplitude / np.sqrt(2.0)
    return not any(
        np.isfinite(each.accuracy) and is_immaterial(rms, each.measured, each.accuracy, thresholds)
        for each in left
    )


def _lasting(own: JudgedSearch, model: Model) -> tuple[Line, ...]:
    """Return the spectral lines that remain beyond the final model."""
    found, weights = [], model.values
    searched = zip(own.last.hums, own.recordings.searched, own.last.search_parts, strict=True)
    for before, measurement, part in searched:
        now = hums_of(measurement, part, weights, own.thresholds) if before else ()
        found += [one for one in now if any(one.is_same(b, own.thresholds) for b in before)]
    return tuple(found)


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
