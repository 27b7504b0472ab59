"""The verdict of a diagnosis, and its contents as `diagnosis.json`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from math import exp
from pathlib import Path
from typing import Any

from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.finding import Finding, Region, Unexplained
from cspm_ident.diagnosis.regression.hypothesis import Rival
from cspm_ident.diagnosis.reporting.completeness import explained_share, left_entries
from cspm_ident.diagnosis.reporting.empirical_statement import empirical_entries
from cspm_ident.diagnosis.reporting.finding_statement import statement_of
from cspm_ident.diagnosis.reporting.shown_place import shown_place
from cspm_ident.diagnosis.reporting.statement import (
    channel_of,
    drive_of,
    formula_of,
    line_statement,
    remainder_statement,
    simulated_statement,
    unknown_statement,
)
from cspm_ident.diagnosis.residuals.regressors import Place
from cspm_ident.diagnosis.residuals.spectral_lines import Line
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.diagnosis.validation.holdout_residuals import HeldOut
from cspm_ident.diagnosis.validation.holdout_simulation import SimulatedFit
from cspm_ident.diagnosis.validation.remainder import Remainder
from cspm_ident.diagnosis.validation.residual_power import Power, lost_powers
from cspm_ident.diagnosis_file import IMPROVED, SCHEMA
from cspm_ident.signals.measurement import Measurement
from cspm_sim.effects import Block, Channel

UNKNOWN = "unknown"


class Verdict(Enum):
    """Result of comparing recordings with a model, with the names of the contract."""

    CONSISTENT = "consistent"
    EFFECT = "effect"
    PARAMETER = "parameter"
    TIE = "tie"
    UNKNOWN = "unknown"
    NOT_EXCITED = "not_excited"


SENTENCES = {
    Verdict.CONSISTENT: "The recordings agree with the model: the residual on held-out data is"
    " noise or immaterial, and a relevant difference is above the detection limit.",
    Verdict.EFFECT: "Physics is missing in the model.",
    Verdict.PARAMETER: "A number of the test-bed file is wrong; no physics is missing.",
    Verdict.TIE: "Something is missing, and several causes explain these recordings equally well.",
    Verdict.UNKNOWN: "Something is missing that nothing in the catalogue explains for certain.",
    Verdict.NOT_EXCITED: "These recordings cannot tell: nothing that was measured moves enough"
    " beyond its noise to decide.",
}


def verdict_of(diagnosis: Diagnosis) -> Verdict:
    """Return the verdict; only findings that are named count.

    The model is consistent only where all that is left on held-out data is noise or immaterial, no
    simulation of cables or bar is far from what was measured, nothing lowers one residual and
    raises another, and some measured quantity exceeds its noise enough to show a difference.
    """
    certain = diagnosis.reported
    if not certain:
        if any(_open(diagnosis)):
            return Verdict.UNKNOWN
        return Verdict.CONSISTENT if diagnosis.is_excited else Verdict.NOT_EXCITED
    if any(each.alternatives for each in certain):
        return Verdict.TIE
    if all(each.is_of_file for each in certain):
        return Verdict.PARAMETER
    return Verdict.EFFECT


def _open(diagnosis: Diagnosis) -> Sequence[Sequence[object]]:
    """Return what shows that something is missing."""
    residuals = diagnosis.unexplained, diagnosis.lines, diagnosis.beyond_noise
    stand_ins = [each for each in diagnosis.doubtful if each.raises]
    return (*residuals, diagnosis.simulated_beyond, stand_ins)


def probability_of(finding: Finding, thresholds: Thresholds = DEFAULT_THRESHOLDS) -> float:
    """Return the probability of a finding against its alternatives and causes not considered.

    A rival's odds are exp(−k²/2), where it lies k standard deviations behind the finding.
    """
    rivals = sum(_odds(rival) for rival in finding.alternatives)
    return thresholds.trusted_probability / (1.0 + rivals)


def _odds(rival: Rival) -> float:
    return exp(-0.5 * rival.behind**2)


_BLOCKS = {
    Channel.DRIVE: Block.WINCH,
    Channel.SHAFT: Block.WINCH,
    Channel.TENSION: Block.CABLE,
    Channel.WRENCH: Block.BAR,
}
_DRIVES = {
    Channel.DRIVE: "torque",
    Channel.SHAFT: "torque",
    Channel.TENSION: "winch",
    Channel.WRENCH: "tension",
}


def diagnosis_data(diagnosis: Diagnosis, testbed: Path | None = None) -> dict[str, Any]:
    """Return the contents of `diagnosis.json`.

    Args:
        diagnosis: the diagnosis.
        testbed: test-bed file of the assumed machine; None for the first recording's own.
    """
    first = diagnosis.searched[0]
    roles = [("search", m) for m in diagnosis.searched]
    roles += [("held_out", m) for m in diagnosis.held_out]
    return {
        "schema": SCHEMA,
        "recordings": [_recording(role, m) for role, m in roles],
        "testbed": {
            "path": str(testbed or f"{first.path}: testbed.yaml"),
            "sha256": first.testbed.sha256,
        },
        "verdict": verdict_of(diagnosis).value,
        "thresholds": diagnosis.thresholds.values,
        "findings": _findings(diagnosis),
        "considered": [considered_entry(each) for each in diagnosis.considered],
        "calibrated": [entry for each in diagnosis.calibrated for entry in _calibrated(each)],
        "not_excited": [
            {"effect": name, "elements": list(elements)} for name, elements in diagnosis.not_excited
        ],
        "explained": explained_share(diagnosis) if diagnosis.reported else None,
        "left": left_entries(diagnosis),
        "extrapolated": [
            each._asdict() | {"place": channel_of(each)} for each in diagnosis.extrapolated
        ],
        "detection_limits": [limit._asdict() for limit in diagnosis.limits],
        "empirical": empirical_entries(diagnosis),
        "fit": [_simulated_fit(each) for each in diagnosis.simulated],
        "residuals": [_equation_fit(each, diagnosis.thresholds) for each in diagnosis.fit],
        "energy": [_power(each) for each in lost_powers(diagnosis.curves)],
        "model": IMPROVED if diagnosis.in_model or diagnosis.tables else None,
    }


def named_in(data: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the findings of `diagnosis.json` that name an effect, in their order."""
    return [finding for finding in data["findings"] if finding["effect"] != UNKNOWN]


def _findings(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Return the findings, the most important first.

    Findings are in descending order of gain; a larger unexplained residual precedes them.
    """
    found = diagnosis.reported
    named = [_finding(diagnosis, each) for each in found]
    most = max((each.gain.total for each in diagnosis.unexplained), default=0.0)
    ahead = sum(each.gain.total >= most for each in found)
    unknown = [_unknown(diagnosis, each) for each in diagnosis.unexplained]
    lines = map(_line, diagnosis.lines)
    # Beside a finding, what is left is reported with the residuals: no model is exact.
    left = [] if found else map(_remainder, diagnosis.undescribed)
    entries = [*named[:ahead], *unknown, *lines, *left, *named[ahead:]]
    return entries or [_simulated_remainder(each) for each in diagnosis.simulated_beyond[:1]]


def _recording(role: str, measurement: Measurement) -> dict[str, Any]:
    return {
        "path": str(measurement.path),
        "sha256": measurement.sha256,
        "role": role,
        "complete": measurement.complete,
    }


def _finding(diagnosis: Diagnosis, finding: Finding) -> dict[str, Any]:
    onset, probability = finding.onset, probability_of(finding, diagnosis.thresholds)
    return {
        "subsystem": finding.hypothesis.effect.block.value,
        "elements": list(finding.elements),
        "effect": finding.effect,
        "probability": probability,
        "presence": "tied" if finding.alternatives else "certain",
        "statement": statement_of(diagnosis, finding),
        "onset_s": onset.time if onset is not None else None,
        "onset_ci95_s": [onset.low, onset.high] if onset is not None else None,
        "region": _region(finding.region),
        "shows_at": shown_place(diagnosis, finding),
        "parameters": _numbers(finding),
        "alternatives": [
            {
                "effect": rival.hypothesis.effect.id,
                "elements": list(rival.hypothesis.scope),
                "beside": None if rival.beside is None else rival.beside.effect.id,
                "probability": probability * _odds(rival),
                "separating_experiment": None,
            }
            for rival in finding.alternatives
        ],
    }


def considered_entry(finding: Finding) -> dict[str, Any]:
    """Return an entry of `considered`: what is not named, with the reason and its numbers."""
    return {
        "effect": finding.effect,
        "elements": list(finding.elements),
        "reason": finding.reason_not_kept,
        "parameters": _numbers(finding),
    }


def _numbers(finding: Finding) -> list[dict[str, Any]]:
    return [
        {
            "element": n.element,
            "name": n.name,
            "value": n.value,
            "unit": n.unit,
            "ci95": None if n.ci95 is None else list(n.ci95),
        }
        for n in finding.parameters
    ]


def _calibrated(finding: Finding) -> Iterator[dict[str, Any]]:
    """Yield the entries of a survey's errors, each with the accuracy of such a survey."""
    usual = {parameter.name: parameter.usual for parameter in finding.hypothesis.effect.parameters}
    for entry in _numbers(finding):
        yield {"effect": finding.effect, **entry, "accuracy": usual[entry["name"]]}


def _region(region: Region | None) -> dict[str, Any]:
    return {} if region is None else region._asdict()


def _line(line: Line) -> dict[str, Any]:
    at, adds = [line.frequency], [line.amplitude]
    region = {"driver": "frequency [Hz]", "at": at, "adds": adds, "hint": None}
    return _unnamed(line.place, line_statement(line), region)


def _remainder(left: Remainder) -> dict[str, Any]:
    driver = left.driver or "time [s]"
    region: dict[str, Any] = {"driver": driver, "at": [], "adds": [], "hint": None}
    return _unnamed(left.place, remainder_statement(left), region)


def _simulated_remainder(fit: SimulatedFit) -> dict[str, Any]:
    """Return the finding of a simulation that is far from what was measured."""
    return _unnamed(Place(fit.output.kind, fit.output.element), simulated_statement(fit), {})


def _unknown(diagnosis: Diagnosis, unexplained: Unexplained) -> dict[str, Any]:
    driver, _, _, shape = unexplained
    assert shape is not None
    region = {
        "driver": driver.signal,
        "at": shape.knots.tolist(),
        "adds": shape.values.tolist(),
        "hint": formula_of(driver, shape, diagnosis.thresholds),
    }
    return _unnamed(driver.place, unknown_statement(diagnosis, unexplained), region)


def _unnamed(place: Place, statement: str, region: Mapping[str, Any]) -> dict[str, Any]:
    """Return a finding that names no effect."""
    return {
        "subsystem": _BLOCKS[place.channel].value,
        "elements": [place.element],
        "effect": UNKNOWN,
        "probability": None,
        "statement": statement,
        "onset_s": None,
        "region": dict(region),
        "parameters": [],
        "alternatives": [],
    }


def _equation_fit(fit: HeldOut, thresholds: Thresholds) -> dict[str, Any]:
    numbers = fit.before, fit.final, fit.retuned, fit.noise
    drive = _DRIVES[fit.place.channel]
    found = _fit(channel_of(fit), drive, fit.measured, *numbers)
    if fit.tabled is not None:
        found["held_out"]["nrmse_named"] = fit.after / max(fit.measured, fit.noise, 1e-300)
    found["held_out"]["nrmse_black_box"] = fit.ceiling / max(fit.measured, 1e-300)
    found["at_noise"] = fit.is_at_noise(thresholds)
    found["left"] = [_left(each, thresholds) for each in fit.remainders]
    return found


def _left(left: Remainder, thresholds: Thresholds) -> dict[str, Any]:
    """Return what is left of a component of a residual; numbers in the unit that was measured."""
    return {
        "component": left.component or None,
        "rms": left.rms,
        "noise": left.noise if left.is_judged else None,
        "measured": left.measured,
        "at_noise": left.is_at_noise(thresholds) if left.is_judged else None,
        "excited": left.is_excited(thresholds),
        "function_of": left.driver or None,
        "function_share": left.share,
        "most_from_s": left.stretch.start,
        "most_to_s": left.stretch.end,
        "most_share": left.stretch.share,
    }


def _power(power: Power) -> dict[str, Any]:
    known = power.half < float("inf")
    return {
        "channel": channel_of(power),
        "lost_before_w": power.before,
        "lost_after_w": power.after,
        "ci95_after_w": [power.after - power.half, power.after + power.half] if known else None,
    }


def _simulated_fit(fit: SimulatedFit) -> dict[str, Any]:
    numbers = fit.before, fit.final, fit.retuned, fit.floor
    found = _fit(fit.output.name, drive_of(fit), fit.measured, *numbers)
    if fit.tabled is not None:
        found["held_out"]["nrmse_named"] = fit.after / max(fit.measured, fit.floor, 1e-300)
    return found


def _fit(
    channel: str,
    drive: str,
    measured: float,
    before: float,
    after: float,
    retuned: float,
    floor: float,
) -> dict[str, Any]:
    """Return one entry, with every RMS as a share of the measured quantity's standard deviation.

    Where the quantity is constant, they are shares of its noise.
    """
    spread = max(measured, floor, 1e-300)
    before, after, retuned, floor = (each / spread for each in (before, after, retuned, floor))
    return {
        "channel": channel,
        "drive": drive,
        "held_out": {
            "vaf_before": _vaf(before),
            "vaf_after": _vaf(after),
            "nrmse_before": before,
            "nrmse_after": after,
            "nrmse_retuned_nominal": retuned,
            "noise_floor": floor,
        },
    }


def _vaf(share: float) -> float:
    """Return the variance accounted for [%] from an error relative to the standard deviation."""
    return 100.0 * (1.0 - min(1.0, share) ** 2)
