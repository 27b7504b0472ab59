"""Hold-out residuals of the findings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

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
from cspm_ident.diagnosis.validation.materiality import accuracy_of
from cspm_ident.diagnosis.validation.recalibration import recalibrated, surveyed_in
from cspm_ident.diagnosis.validation.remainder import Remainder, independent_noise, remainders_of
from cspm_ident.signals.measurement import Measurement

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
        noise: white part of what is left with the findings, from rows that share no window.
        remainders: what is left with the findings of each channel, without reversals; empty without
            such rows.
        steady: with the findings, without the rows of a reversal; None where there is no reversal.
        tabled: with the findings and tables of what is unexplained; None without tables.
    """

    place: Place
    measured: float
    before: float
    retuned: float
    after: float
    ceiling: float
    noise: float
    remainders: tuple[Remainder, ...] = ()
    steady: float | None = None
    tabled: float | None = None

    @property
    def final(self) -> float:
        """The residual with all that the improved test-bed file has."""
        return self.after if self.tabled is None else self.tabled

    def is_at_noise(self, thresholds: Thresholds = DEFAULT_THRESHOLDS) -> bool | None:
        """Return whether what is left is noise or immaterial; None where that is not known."""
        known = [each for each in self.remainders if each.is_judged]
        return all(each.is_at_noise(thresholds) for each in known) if known else None


def judged(
    measurements: Sequence[Measurement],
    starts: Sequence[float],
    retuned: Mapping[Candidate, Array],
    found: Mapping[Candidate, Array],
    noise: Mapping[Place, Array],
    free: Mapping[Place, float],
    searched: Mapping[Place, Sequence[Equation]] = MappingProxyType({}),
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
        searched: what the findings leave of the searched data, without reversals. Its noise counts
            as well.
        thresholds: those of residuals.
    """
    parts = list(zip(measurements, starts, strict=True))
    described = residuals_of(parts, {}, noise, thresholds)
    tuned = residuals_of(parts, retuned, noise, thresholds) if retuned else described
    after = residuals_of(parts, found, noise, thresholds) if found else described
    return tuple(
        _held_out(
            [each.get(place, ()) for each in (described, tuned, after)],
            searched.get(place, ()),
            noise[place],
            free.get(place, float("nan")),
            accuracy_of(measurements[0].machine, place),
        )
        for place in described
    )


def _held_out(
    stages: Sequence[Sequence[Equation]],
    searched: Sequence[Equation],
    noise: Array,
    free: float,
    accuracy: float,
) -> HeldOut:
    """Return one hold-out residual: with the file's model, re-tuned, and with the findings."""
    described, _, after = stages
    unit = float(noise[0]) if len(noise) == 1 else 1.0
    measured = np.concatenate([e.measured for e in described])
    spread = float(np.sqrt(np.mean((measured - measured.mean(axis=0)) ** 2)))
    before, tuned, found = (unit * rms(stage) for stage in stages)
    steady = _steady(after)
    calm = [each.steady for each in after]
    # Noise may grow with the motion; few held-out rows leave it to chance.
    floor = np.fmax(independent_noise(calm), independent_noise([*calm, *searched]))
    return HeldOut(
        place=described[0].place,
        measured=unit * spread,
        before=before,
        retuned=tuned,
        after=found,
        ceiling=unit * free,
        noise=unit * float(np.sqrt(np.mean(floor**2))),
        remainders=remainders_of(calm, floor, noise, accuracy),
        steady=None if steady is None else unit * steady,
    )


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
        left = equation.left
        squares, count = squares + float(np.sum(left**2)), count + left.size
    return float(np.sqrt(squares / max(count, 1)))


def _steady(equations: Sequence[Equation]) -> float | None:
    """Return the root mean square of the rows without a reversal; None if there is no reversal."""
    if not any(equation.turning.any() for equation in equations):
        return None
    return rms([equation.steady for equation in equations])


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
    ends = surveyed_in(weights)
    parts = [
        [
            equation.within(start, np.inf)
            for equation in equations_of(
                as_found(m.since(start - LEAD_S), weights), ends, thresholds=thresholds
            )
        ]
        for m, start in measurements
    ]
    found: dict[Place, list[Equation]] = {}
    for part in in_noise(parts, noise):
        for equation in part:
            if len(equation.times):
                found.setdefault(equation.place, []).append(recalibrated(equation, weights))
    return found
