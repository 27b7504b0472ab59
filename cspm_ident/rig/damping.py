"""The damping of one kind of cable from multi-sines at several lengths (thesis, 3-2-3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt
from scipy.stats import t as student

from cspm_ident.estimation import Estimate, Interval, Parameter, Problem, fit
from cspm_ident.estimation.objection import Objection, error_objections, sign_objections
from cspm_ident.rig.law import TensionCurve, law_of, tension_curve
from cspm_ident.rig.specimen import Specimen
from cspm_ident.rig.stiffness import SIGN_REMEDY, split
from cspm_ident.vaf import error_percent, vaf
from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]

# Twice the highest frequency of the thesis's multi-sine, below most of the sensors' noise.
CUTOFF = 20.0
ORDER = 4
SAMPLES = 5.0
ROUNDING = 1e-6
# What the filter needs to settle at either end, in periods of its cut-off frequency.
SETTLING = 10.0
FEWEST = 100
DAMPING, STRETCH = "damping", "stretch"


@dataclass(frozen=True)
class Signals:
    """A specimen's measured tension after a filter without phase, and that filter.

    The model is computed from what was measured and filtered like the measured tension: to filter
    its inputs would not be the same, since the tension is a curved function of them.

    Attributes:
        sections: of the filter.
        kept: which samples are left, without the ends and no closer than the filter resolves.
        time: of those left, (n,) [s].
        tension: filtered, (n,) [N].
    """

    sections: Array
    kept: slice
    time: Array
    tension: Array

    def smooth(self, values: Array) -> Array:
        """Return values at all samples, filtered, at the samples left, (n,)."""
        return np.asarray(sosfiltfilt(self.sections, values)[self.kept])


@dataclass(frozen=True)
class SpecimenDamping:
    """The damper of one specimen.

    Attributes:
        specimen: the cable.
        fitted: whether the linear law was fitted to it.
        estimate: `damping` [N·s/m] and `stretch` [m], the elongation at the first sample.
        offset: tension of the stretched cable at rest at the first sample [N].
        mean_length: its mean elastic length [m].
        vaf: of the measured tension by the model with its own damping [%].
        lowest: lowest measured tension [N].
        signals: the filtered measurement.
        modelled: tension by the model with its own damping, (n,) [N].
    """

    specimen: Specimen
    fitted: bool
    estimate: Estimate
    offset: float
    mean_length: float
    vaf: float
    lowest: float
    signals: Signals
    modelled: Array

    @property
    def objections(self) -> list[Objection]:
        """Why its damping is no result; none where it is."""
        own = self.estimate.without(STRETCH)
        return [
            *sign_objections(own, set(), {DAMPING}, SIGN_REMEDY),
            *error_objections(own, [("the recording", error_percent(self.vaf))], "tension"),
        ]


class LinearDamping(NamedTuple):
    """constant − slope·length [N·s/m], thesis (3-13).

    Attributes:
        constant: [N·s/m].
        slope: [N·s/m²].
        constant_interval: 95 %.
        slope_interval: 95 %.
        scatter: how far the specimens lie from the line, in their own standard deviations; 1 is
            what chance alone gives, NaN with two lengths.
    """

    constant: float
    slope: float
    constant_interval: tuple[float, float]
    slope_interval: tuple[float, float]
    scatter: float

    def at(self, length: float) -> float:
        """Return the damping [N·s/m] at an elastic length [m]."""
        return self.constant - self.slope * length


@dataclass(frozen=True)
class DampingResult:
    """The damping of one kind of cable.

    Attributes:
        specimens: those fitted, then those that verify.
        law: the linear function of the length; None with one length.
        verified: by label of those that verify, VAF of the tension [%] by both laws, with the
            offset that the first measured value gives, as in table 4-1.
        cutoff: of the filter [Hz].
    """

    specimens: tuple[SpecimenDamping, ...]
    law: LinearDamping | None
    verified: dict[str, float]
    cutoff: float

    @property
    def objections(self) -> tuple[Objection, ...]:
        """Why dampings are no result; none where they are."""
        return tuple(
            each._replace(reason=f"{one.specimen.label}: {each.reason}")
            for one in self.specimens
            if one.fitted
            for each in one.objections
        )

    def data(self) -> dict[str, Any]:
        """Return everything as plain data for JSON."""
        law = self.law
        return {
            "cutoff_hz": self.cutoff,
            "law": None
            if law is None
            else {
                "constant": {"value": law.constant, "ci95": list(law.constant_interval)},
                "slope": {"value": law.slope, "ci95": list(law.slope_interval)},
                "scatter": None if np.isnan(law.scatter) else law.scatter,
            },
            "specimens": [_specimen_data(one, self.verified) for one in self.specimens],
        }


def identify_damping(
    specimens: Sequence[Specimen], verify: Sequence[str] = (), cutoff: float = CUTOFF
) -> DampingResult:
    """Return the damping of specimens of one kind whose motors were driven by a multi-sine.

    The stiffness is that of the test-bed file; thesis (3-11), t = t_el(ε) + b·ε̇, is fitted for b
    and for the elongation at the start, which takes the place of the tension offset.

    Args:
        specimens: cables of one diameter, always taut.
        verify: labels of those that judge the law without being fitted.
        cutoff: of the filter on all signals [Hz].

    Raises:
        InputError: nothing to fit, cables of several diameters, a slack cable, a short recording.
    """
    fitted, others = split(specimens, verify)
    found = [_fit(one, one.label not in verify, cutoff) for one in (*fitted, *others)]
    law = linear_law(found[: len(fitted)])
    verified = {} if law is None else _verified(found[len(fitted) :], law)
    return DampingResult(tuple(found), law, verified, cutoff)


def linear_law(specimens: Sequence[SpecimenDamping]) -> LinearDamping | None:
    """Return the line through the dampings by weighted least squares, None with one length.

    Where the specimens scatter by more than their own intervals say, the line's intervals grow with
    that scatter.
    """
    lengths = np.array([one.mean_length for one in specimens])
    if lengths.max() < 1.02 * lengths.min():
        return None
    values = np.array([one.estimate.value(DAMPING) for one in specimens])
    weights = 1.0 / np.array([float(one.estimate.sd[0]) for one in specimens])
    matrix = np.stack([np.ones_like(lengths), -lengths], axis=1) * weights[:, None]
    solution, *_ = np.linalg.lstsq(matrix, values * weights, rcond=None)
    covariance = np.linalg.inv(matrix.T @ matrix)
    freedom = len(lengths) - 2
    misfit = float(np.sum((values * weights - matrix @ solution) ** 2))
    scatter = np.sqrt(misfit / freedom) if freedom else float("nan")
    quantile = 1.96
    if freedom and scatter > 1.0:
        covariance, quantile = covariance * scatter**2, float(student.ppf(0.975, freedom))
    half = quantile * np.sqrt(np.diag(covariance))
    ends = [(float(v - h), float(v + h)) for v, h in zip(solution, half, strict=True)]
    return LinearDamping(float(solution[0]), float(solution[1]), ends[0], ends[1], float(scatter))


def _fit(specimen: Specimen, fitted: bool, cutoff: float) -> SpecimenDamping:
    signals = filtered(specimen, cutoff)
    lowest = float(specimen.tension.min())
    if lowest <= 0.0:
        raise InputError(
            f"{specimen.label}: {lowest:.3g} N at its least, allowed: a cable that is always taut"
        )
    curve = _curve(specimen, signals)
    estimate = _estimate(specimen, signals, curve)
    damping, stretch = (float(value) for value in estimate.values)
    modelled = _modelled(specimen, signals, curve, damping, stretch)
    unstretched = _unstretched(specimen, stretch)
    return SpecimenDamping(
        specimen=specimen,
        fitted=fitted,
        estimate=estimate,
        offset=float(np.interp(stretch, curve.elongations, curve.tensions)),
        mean_length=float(unstretched.mean()) + specimen.cable.offset_length,
        vaf=vaf(signals.tension, modelled),
        lowest=lowest,
        signals=signals,
        modelled=modelled,
    )


def _estimate(specimen: Specimen, signals: Signals, curve: TensionCurve) -> Estimate:
    """Return damping and stretch by least squares with intervals for coloured residuals."""
    start = _stretch(specimen, signals, curve, 0.0)
    stroke, rate = float(np.ptp(specimen.wound)), float(np.std(signals.smooth(specimen.rate)))
    if stroke <= 0.0 or rate <= 0.0:
        raise InputError(f"{specimen.label}: its winch stands still, allowed: a multi-sine")

    def residual(theta: Array) -> list[Array]:
        damping, stretch = (float(value) for value in theta)
        return [signals.tension - _modelled(specimen, signals, curve, damping, stretch)]

    scale = float(np.std(signals.tension)) / rate
    parameters = [
        Parameter(DAMPING, "N*s/m", -10.0 * scale, 10.0 * scale, scale=scale),
        Parameter(STRETCH, "m", 0.0, start + 10.0 * stroke, scale=stroke),
    ]
    problem = Problem(residual, parameters)
    return fit(problem, [0.0, start], whiten=False, interval=Interval.SANDWICH).estimate


def filtered(specimen: Specimen, cutoff: float) -> Signals:
    """Return a specimen's tension after a Butterworth filter without phase, without the ends.

    Raises:
        InputError: samples too far apart for the filter, or too few of them.
    """
    rate = 1.0 / specimen.period
    if rate < 4.0 * cutoff:
        raise InputError(
            f"{specimen.label}: {rate:.3g} Hz, allowed with a cut-off at {cutoff:g} Hz: at least"
            f" {4.0 * cutoff:g} Hz"
        )
    ends = int(SETTLING / cutoff * rate)
    step = max(1, int(rate / (SAMPLES * cutoff) + ROUNDING))
    if len(specimen.time) < 2 * ends + FEWEST * step:
        raise InputError(
            f"{specimen.label}: {specimen.time[-1] - specimen.time[0]:.3g} s, allowed: at least"
            f" {(2 * ends + FEWEST * step) / rate:.3g} s"
        )
    sections, kept = butter(ORDER, cutoff, fs=rate, output="sos"), slice(ends, -ends, step)
    tension = np.asarray(sosfiltfilt(sections, specimen.tension)[kept])
    return Signals(np.asarray(sections), kept, specimen.time[kept], tension)


def _curve(specimen: Specimen, signals: Signals) -> TensionCurve:
    highest = 2.0 * float(signals.tension.max())
    return tension_curve(law_of(specimen.cable), specimen.length, highest)


def _stretch(specimen: Specimen, signals: Signals, curve: TensionCurve, damping: float) -> float:
    """Return the elongation [m] at the first sample that gives the first filtered tension."""
    rate, wound = (signals.smooth(x)[0] for x in (specimen.rate, specimen.wound))
    at_rest = float(signals.tension[0] - damping * rate)
    return float(np.interp(at_rest, curve.tensions, curve.elongations) - wound)


def _unstretched(specimen: Specimen, stretch: float) -> Array:
    """Return l0 [m]: the winch takes l0/l of what it winds, thesis (2-18)."""
    first = specimen.distance - stretch
    return np.asarray(first * np.exp(-specimen.wound / specimen.distance))


def _modelled(
    specimen: Specimen, signals: Signals, curve: TensionCurve, damping: float, stretch: float
) -> Array:
    unstretched = _unstretched(specimen, stretch)
    elastic = unstretched + specimen.cable.offset_length
    tension = curve.tension(specimen.distance - unstretched, elastic)
    return signals.smooth(tension + damping * specimen.rate * unstretched / specimen.distance)


def _verified(specimens: Sequence[SpecimenDamping], law: LinearDamping) -> dict[str, float]:
    """Return the VAF by both laws, the offset taken from the first measured value alone."""
    found = {}
    for one in specimens:
        specimen, signals = one.specimen, one.signals
        damping, curve = law.at(one.mean_length), _curve(specimen, signals)
        stretch = _stretch(specimen, signals, curve, damping)
        modelled = _modelled(specimen, signals, curve, damping, stretch)
        found[specimen.label] = vaf(signals.tension, modelled)
    return found


def _specimen_data(one: SpecimenDamping, verified: dict[str, float]) -> dict[str, Any]:
    found = one.specimen
    return {
        "label": found.label,
        "recording": str(found.recording),
        "sha256": found.sha256,
        "window_s": [float(one.signals.time[0]), float(one.signals.time[-1])],
        "length_m": one.mean_length,
        "fitted": one.fitted,
        "estimate": one.estimate.data(),
        "offset_n": one.offset,
        "lowest_tension_n": one.lowest,
        "vaf_percent": one.vaf,
        "vaf_of_the_laws_percent": verified.get(found.label),
    }
