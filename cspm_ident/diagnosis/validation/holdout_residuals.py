"""Hold-out residuals of the findings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.regression.block_gram import BlockGram
from cspm_ident.diagnosis.residuals.corrected_measurement import as_found
from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation, in_noise
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.diagnosis.validation.holdout_simulation import LEAD_S
from cspm_ident.signals.measurement import Measurement
from cspm_model.robust_statistics import difference_noise

Array = NDArray[np.float64]


@dataclass(frozen=True)
class HeldOut:
    """One residual on held-out data.

    All values are root mean squares in the residual's unit. Those of the bar's six channels
    together are in units of their noise.

    Attributes:
        place: which residual.
        measured: standard deviation of the measured quantity.
        before: with the file's model.
        retuned: with the file's parameters fitted to the searched data, nothing added.
        after: with the findings.
        ceiling: with free functions of every driver fitted to the searched data, as a black-box
            model.
        noise: from differences of successive rows with the findings, so that explained signals do
            not count as noise.
        steady: with the findings, without the rows of a reversal; None where there is no reversal.
    """

    place: Place
    measured: float
    before: float
    retuned: float
    after: float
    ceiling: float
    noise: float
    steady: float | None = None


def judged(
    measurements: Sequence[Measurement],
    starts: Sequence[float],
    retuned: Mapping[Candidate, Array],
    found: Mapping[Candidate, Array],
    noise: Mapping[Place, Array],
    free: Mapping[Place, float],
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> tuple[HeldOut, ...]:
    """Return every hold-out residual with the file's model, re-tuned, and with the findings.

    Args:
        measurements: the recordings; rows before the start settle internal states such as creep.
        starts: times from which each recording is held out [s].
        retuned: weights of the file's own parameters.
        found: weights of the findings.
        noise: noise of each residual, its unit.
        free: residual after fitting free functions, root mean square in units of the noise.
        thresholds: those of residuals.
    """
    parts = list(zip(measurements, starts, strict=True))
    described = residuals_of(parts, {}, noise, thresholds)
    tuned = residuals_of(parts, retuned, noise, thresholds) if retuned else described
    after = residuals_of(parts, found, noise, thresholds) if found else described
    out = []
    for place, equations in described.items():
        unit = float(noise[place][0]) if len(noise[place]) == 1 else 1.0
        measured = np.concatenate([e.measured for e in equations])
        spread = float(np.sqrt(np.mean((measured - measured.mean(axis=0)) ** 2)))
        stages = (rms(each.get(place, ())) for each in (described, tuned, after))
        before, then, now = (unit * stage for stage in stages)
        ceiling, floor = unit * free.get(place, float("nan")), unit * _floor(after.get(place, ()))
        steady = _steady(after.get(place, ()))
        away = None if steady is None else unit * steady
        out.append(HeldOut(place, unit * spread, before, then, now, ceiling, floor, away))
    return tuple(out)


def free_functions(searched: BlockGram, judge: BlockGram) -> dict[Place, float]:
    """Return hold-out residuals of free functions of all drivers, fitted to the searched data.

    Root mean squares in units of the noise. They are the reference of a black-box model, which has
    the relevant signals but no physics.
    """
    weights: dict[Candidate | Driver, Array] = {}
    for place in searched.places:
        own = [t for t in searched.terms if isinstance(t, Driver) and t.place == place.place]
        columns = np.intersect1d(place.columns, searched.with_nuisance(own))
        at = np.searchsorted(place.columns, columns)
        gram, target = place.whole[np.ix_(at, at)], place.whole[at, -1]
        fitted = np.linalg.pinv(gram, hermitian=True, rcond=1e-9) @ target
        full = np.zeros(searched.width)
        full[columns] = fitted
        weights |= {term: full[searched.slices[term]] for term in own}
    left = judge.left_with(weights)
    rows = {place.place: max(1.0, float(place.rows.sum())) for place in judge.places}
    return {place: float(np.sqrt(max(0.0, left[place]) / count)) for place, count in rows.items()}


def rms(equations: Sequence[Equation]) -> float:
    """Return the root mean square of residuals, with the nuisance terms fitted to each."""
    squares, count = 0.0, 0
    for equation in equations:
        left = without_nuisance(equation)
        squares, count = squares + float(np.sum(left**2)), count + left.size
    return float(np.sqrt(squares / max(count, 1)))


def _steady(equations: Sequence[Equation]) -> float | None:
    """Return the root mean square of the rows without a reversal; None if there is no reversal."""
    if not any(equation.turning.any() for equation in equations):
        return None
    return rms([equation.steady for equation in equations])


def _floor(equations: Sequence[Equation]) -> float:
    """Return the noise from differences of successive rows, root mean square over channels."""
    noises = [difference_noise(without_nuisance(e)) for e in equations if len(e.times) > 3]
    return float(np.sqrt(np.mean(np.square(noises)))) if noises else float("nan")


def without_nuisance(equation: Equation) -> Array:
    """Return the residual without its fitted nuisance terms, shape (k, channels)."""
    if not equation.nuisance.size:
        return equation.target
    columns = equation.nuisance.reshape(equation.target.size, -1)
    target = equation.target.reshape(-1)
    left = target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0]
    return np.asarray(left.reshape(equation.target.shape))


def residuals_of(
    measurements: Sequence[tuple[Measurement, float]],
    weights: Mapping[Candidate, Array],
    noise: Mapping[Place, Array],
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> dict[Place, list[Equation]]:
    """Return the residuals of recordings, each from a given time on, where there are any rows.

    Args:
        measurements: each with the time [s].
        weights: coefficients of the effects that the machine has.
        noise: noise of each residual, its unit.
        thresholds: those of residuals.
    """
    parts = [
        [
            equation.within(start, np.inf)
            for equation in equations_of(
                as_found(m.within(start - LEAD_S, np.inf), weights), (), thresholds=thresholds
            )
        ]
        for m, start in measurements
    ]
    found: dict[Place, list[Equation]] = {}
    for part in in_noise(parts, noise):
        for equation in part:
            if len(equation.times):
                found.setdefault(equation.place, []).append(equation)
    return found
