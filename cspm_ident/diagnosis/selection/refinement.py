"""Refined parameters of selected effects, fitted about a corrected model and measurement.

Regressors hold to first order about the machine of the test-bed file, and nonlinear parameters
come from a coarse grid. A few rounds that fit only the selected effects reduce both errors.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from itertools import product
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_gram import BlockGram, gather
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.regression.coefficients import Weights, values_of, weights_of
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, factors_of, parts_of
from cspm_ident.diagnosis.regression.parameter_estimates import of_reach
from cspm_ident.diagnosis.regression.time_constants import most_in_all, with_spectrum
from cspm_ident.diagnosis.residuals.corrected_measurement import settled, with_found
from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation, in_noise, steady
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.signals.measurement import Measurement
from cspm_msgs_py.errors import InputError
from cspm_sim.effects import Effect

Array = NDArray[np.float64]
Cut = Callable[[Sequence[Sequence[Equation]]], Sequence[Sequence[Equation]]]

# Maximum number of rounds of correction and fit.
_ROUNDS = 4
# Grid steps are about a factor of three; each round halves the step in the logarithm.
_FIRST_FACTOR = 1.7
# Share of the half width of a 95 % interval: a smaller correction is the last one.
_SETTLED = 0.02


def refine(
    searched: Sequence[Measurement],
    hypotheses: Sequence[Hypothesis],
    noise: Mapping[Place, Array],
    block_s: float,
    cut: Cut,
    assumed: Mapping[Candidate, Array] = MappingProxyType({}),
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> Weights:
    """Return weights of candidates with refined shapes, and half widths of their 95 % intervals.

    Args:
        searched: the recordings.
        hypotheses: the selected hypotheses.
        noise: standard deviation of each residual's noise, which is its unit.
        block_s: length of the blocks [s].
        cut: selects the part of the equations that was searched.
        assumed: weights about which residuals are linearised.
        thresholds: of residuals and intervals.
    """
    candidates, common = parts_of(hypotheses)
    shapes = {c.effect_id: dict(c.shape) for c in candidates}
    effects = {c.effect_id: c.effect for c in candidates}
    wanted = [(c.effect_id, c.element) for c in candidates]
    applied: Weights = {}
    factor = _FIRST_FACTOR
    found: Weights = {}
    parts: Sequence[Sequence[Equation]] = ()
    for _ in range(_ROUNDS if candidates else 0):
        near = [_near(effects[name], shape, factor) for name, shape in shapes.items()]
        try:
            values = {c: own for c, (own, _) in applied.items()}
            parts = cut(_about(searched, near, candidates, values, assumed, thresholds))
        except InputError:
            # The corrected machine is impossible: keep the last weights and intervals.
            break
        gram = gather(in_noise(steady(parts), noise), block_s)
        shapes, found = _fitted(gram, shapes, wanted, common, thresholds)
        for candidate, (weights, half) in found.items():
            if candidate.effect.is_correction:
                before = values.get(candidate, np.zeros_like(weights))
                applied[candidate] = _corrected(candidate.effect, before, weights, half)
        factor = float(np.sqrt(factor))
        if _is_settled(found):
            break
    return of_reach({c: applied.get(c, own) for c, own in found.items()}, parts)


def spectra(
    searched: Sequence[Measurement],
    hypotheses: Sequence[Hypothesis],
    found: Weights,
    noise: Mapping[Place, Array],
    block_s: float,
    cut: Cut,
    assumed: Mapping[Candidate, Array] = MappingProxyType({}),
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> dict[Candidate, Array]:
    """Return upper ends of the total weights, over all time constants, of effects with a spectrum.

    Candidates without a bound are left out.

    Args:
        searched: the recordings.
        hypotheses: the selected hypotheses, with the catalogue's grids.
        found: the result of `refine`.
        noise: as in `refine`.
        block_s: as in `refine` [s].
        cut: as in `refine`.
        assumed: as in `refine`.
        thresholds: as in `refine`, and `tie_sigma`.
    """
    wanted = [c for c in found if c.effect.signature.spectrum]
    if not wanted:
        return {}
    longest = max(m.duration for m in searched)
    shapes = {c.effect_id: c.nonlinear for c in found}
    effects = [
        with_spectrum(effect, shapes[effect.id], longest)
        for effect in {h.effect.id: h.effect for h in hypotheses}.values()
    ]
    values = {c: own for c, (own, _) in found.items() if c.effect.is_correction}
    try:
        parts = cut(_about(searched, effects, list(found), values, assumed, thresholds))
    except InputError:
        return {}
    gram = gather(in_noise(steady(parts), noise), block_s)
    most = {c: most_in_all(gram, c, [o for o in found if o != c], thresholds) for c in wanted}
    return {c: own for c, own in most.items() if own is not None}


def _about(
    searched: Sequence[Measurement],
    effects: Sequence[Effect],
    candidates: Sequence[Candidate],
    applied: Mapping[Candidate, Array],
    assumed: Mapping[Candidate, Array],
    thresholds: Thresholds,
) -> list[Sequence[Equation]]:
    """Return the equations of corrected measurements, one list per recording.

    Raises:
        InputError: the corrected machine is impossible.
    """
    moved = [settled(with_found(m, applied)) for m in searched]
    about = {c: own for c, own in assumed.items() if not c.effect.is_correction}
    return [
        equations_of(m, effects, touched=candidates, assumed=about, thresholds=thresholds)
        for m in moved
    ]


def _is_settled(found: Weights) -> bool:
    """Return whether no shape is fitted and corrections are small against their 95 % intervals."""
    return all(
        not c.shape and np.all(np.abs(weights) <= _SETTLED * half)
        for c, (weights, half) in found.items()
        if c.shape or c.effect.is_correction
    )


def needs_refining(effect: Effect) -> bool:
    """Return whether an effect's columns depend on its parameters or on a correction."""
    return effect.is_correction or bool(effect.signature.nonlinear)


def _corrected(effect: Effect, applied: Array, weights: Array, half: Array) -> tuple[Array, Array]:
    """Return a correction after a further step, with half the widths of its intervals.

    A factor of the test-bed file or of a reading multiplies the value corrected so far, by the
    exponential of the step: no step of first order makes a stiffness negative.
    """
    factors = factors_of(effect)
    steps = np.exp(np.where(factors, weights, 0.0))
    value = np.where(factors, (1.0 + applied) * steps - 1.0, applied + weights)
    return value, np.where(factors, (1.0 + applied) * steps, 1.0) * half


def _near(effect: Effect, shape: Mapping[str, float], factor: float) -> Effect:
    """Return the effect with a grid around a shape, within its bounds."""
    bounds = {p.name: (p.minimum, p.maximum) for p in effect.parameters}
    grid = {
        name: tuple(sorted({float(np.clip(value * f, *bounds[name])) for f in _steps(factor)}))
        for name, value in shape.items()
        if name not in effect.signature.whole
    }
    whole = {name: (value,) for name, value in shape.items() if name not in grid}
    return effect.with_grid({**grid, **whole})


def _steps(factor: float) -> tuple[float, ...]:
    return (1.0 / factor, 1.0, factor)


def _fitted(
    gram: BlockGram,
    shapes: dict[str, dict[str, float]],
    wanted: Sequence[tuple[str, str]],
    common: Collection[str],
    thresholds: Thresholds,
) -> tuple[dict[str, dict[str, float]], Weights]:
    """Return the best shapes and the weights there; elements of `common` effects share weights."""
    sums = BlockRegression(gram, thresholds)
    grids = {name: _shapes(gram, name) for name in shapes}
    best: tuple[float, dict[str, tuple[tuple[str, float], ...]]] | None = None
    for point in product(*grids.values()):
        chosen = dict(zip(grids, point, strict=True))
        left = sums.squares_of(gram.with_nuisance(_members(gram, chosen, wanted)))
        if best is None or left < best[0]:
            best = left, chosen
    assert best is not None
    members = _members(gram, best[1], wanted)
    weights = values_of(gram, sums, members, common)
    turns = _turns(gram, weights)
    beside = np.append(gram.nuisance, gram.width + np.arange(turns.shape[1]))
    widths = weights_of(gram, sums.beside(turns), members, common, beside)
    found = {c: (weights[c], widths[c][1]) for c in members}
    return {name: dict(shape) for name, shape in best[1].items()}, found


def _turns(gram: BlockGram, weights: Mapping[Candidate, Array]) -> Array:
    """Return derivatives of the fitted model with respect to each shape's logarithm.

    The result combines columns and has the shape (width, shapes). It widens the interval of a
    weight by the uncertainty of its shape.
    """
    turns: dict[tuple[str, str], Array] = {}
    for candidate, own in weights.items():
        for name in candidate.nonlinear:
            ends = _ends(gram, candidate, name)
            if len(ends) < 2:
                continue
            turn = turns.setdefault((candidate.effect_id, name), np.zeros(gram.width))
            step = float(np.log(ends[-1].nonlinear[name] / ends[0].nonlinear[name]))
            turn[gram.slices[ends[-1]]] += own / step
            turn[gram.slices[ends[0]]] -= own / step
    return np.column_stack([np.zeros((gram.width, 0)), *turns.values()])


def _ends(gram: BlockGram, candidate: Candidate, name: str) -> list[Candidate]:
    """Return the candidates that differ in one nonlinear parameter only, in ascending order."""
    kept = {n: value for n, value in candidate.shape if n != name}
    same = [
        term
        for term in gram.terms
        if isinstance(term, Candidate)
        and (term.effect_id, term.element) == (candidate.effect_id, candidate.element)
        and {n: value for n, value in term.shape if n != name} == kept
    ]
    return sorted(same, key=lambda term: term.nonlinear[name])


def _shapes(gram: BlockGram, name: str) -> list[tuple[tuple[str, float], ...]]:
    candidates = (term for term in gram.terms if isinstance(term, Candidate))
    return sorted({c.shape for c in candidates if c.effect_id == name})


def _members(
    gram: BlockGram,
    shapes: Mapping[str, tuple[tuple[str, float], ...]],
    wanted: Sequence[tuple[str, str]],
) -> list[Candidate]:
    return [
        term
        for term in gram.terms
        if isinstance(term, Candidate)
        and (term.effect_id, term.element) in wanted
        and term.shape == shapes[term.effect_id]
    ]
