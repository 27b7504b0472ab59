"""What a diagnosis says, in words and as `diagnosis.json`."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from math import exp
from typing import Any, NamedTuple

import numpy as np

from cspm_ident.block_simulation import Drive
from cspm_ident.diagnosis.columns import Candidate
from cspm_ident.diagnosis.diagnose import Diagnosis, Shape, members_of
from cspm_ident.diagnosis.hypothesis import Named, Rival
from cspm_ident.diagnosis.judgement import HeldOut
from cspm_ident.diagnosis.onset import Onset
from cspm_ident.diagnosis.simulation import SimulatedFit
from cspm_ident.diagnosis.sketch import sketch
from cspm_ident.signals.measurement import Measurement
from cspm_sim.effects import Block, Channel, Effect

SCHEMA = "cspm.diagnosis/1"
IMPROVED = "testbed.improved.yaml"
UNKNOWN = "unknown"


class Verdict(Enum):
    """What recordings say of a model, as the contract names it."""

    CONSISTENT = "consistent"
    EFFECT = "effect"
    PARAMETER = "parameter"
    TIE = "tie"
    UNKNOWN = "unknown"
    NOT_EXCITED = "not_excited"


class Number(NamedTuple):
    """A parameter of a finding.

    Attributes:
        name: public name.
        value: in `unit`.
        unit: SI.
        low, high: ends of its 95 % interval; equal to the value where it was searched on a grid.
    """

    name: str
    value: float
    unit: str
    low: float
    high: float


def verdict_of(diagnosis: Diagnosis) -> Verdict:
    """Return the verdict in one word."""
    named = diagnosis.findings.named
    if not named:
        if diagnosis.findings.unknown:
            return Verdict.UNKNOWN
        return Verdict.CONSISTENT if diagnosis.places else Verdict.NOT_EXCITED
    if any(each.alternatives for each in named):
        return Verdict.TIE
    if all(each.hypothesis.effect.alter is not None for each in named):
        return Verdict.PARAMETER
    return Verdict.EFFECT


def probability_of(named: Named) -> float:
    """Return how probable a finding is among what explains the same.

    A rival's odds are those of a normal deviate of as many standard deviations as it lies behind.
    """
    return 1.0 / (1.0 + sum(_odds(rival) for rival in named.alternatives))


def _odds(rival: Rival) -> float:
    return exp(-0.5 * max(0.0, rival.behind) ** 2)


def numbers_of(diagnosis: Diagnosis, candidate: Candidate) -> list[Number]:
    """Return the parameters of an effect on one element."""
    weights, widths = diagnosis.weights[candidate]
    effect = candidate.effect
    values = effect.values(weights.tolist(), **candidate.nonlinear)
    low = effect.values((weights - widths).tolist(), **candidate.nonlinear)
    high = effect.values((weights + widths).tolist(), **candidate.nonlinear)
    return [
        Number(
            p.name,
            values[p.name],
            p.unit,
            min(low[p.name], high[p.name]),
            max(low[p.name], high[p.name]),
        )
        for p in effect.parameters
    ]


def statement_of(diagnosis: Diagnosis, named: Named) -> str:
    """Return a finding as one sentence that a person can act on."""
    effect = named.hypothesis.effect
    members = members_of(diagnosis.weights, named.hypothesis)
    parts = []
    for candidate in members:
        numbers = [n for n in numbers_of(diagnosis, candidate) if n.low < n.high]
        told = ", ".join(
            f"{n.name} {n.value:.4g} ({n.low:.4g} to {n.high:.4g}) {n.unit}" for n in numbers
        )
        parts.append(f"{candidate.element}: {told}")
    missing = (
        "differs from the test-bed file" if effect.alter is not None else "is not in the model"
    )
    since = ""
    onset = _onset_of(diagnosis, named)
    if onset is not None:
        since = f", from {onset.time:.1f} s on ({onset.low:.1f} to {onset.high:.1f} s)"
    elif named.hypothesis.onset:
        since = f", from block {named.hypothesis.onset} of the recordings on"
    best = max(_concerned(diagnosis, named), key=lambda fit: fit.before / max(fit.after, 1e-300))
    return (
        f"{_words(effect)} {missing}{since} ({'; '.join(parts)}). With it the held-out residual of"
        f" {channel_of(best)} falls from {_amount(best, best.before)} to"
        f" {_amount(best, best.after)}, where noise is {_amount(best, best.noise)};"
        f" {_simulated_worth(diagnosis, named)}."
    )


def _onset_of(diagnosis: Diagnosis, named: Named) -> Onset | None:
    return diagnosis.onsets[diagnosis.findings.named.index(named)]


def _amount(fit: HeldOut, value: float) -> str:
    """Return a residual in its unit, and as a share of what was measured."""
    return f"{value:.3g} {unit_of(fit)} ({100.0 * value / max(fit.measured, 1e-300):.2g} %)"


def _simulated_worth(diagnosis: Diagnosis, named: Named) -> str:
    worth = diagnosis.worth[diagnosis.findings.named.index(named)]
    if worth is None:
        return "what was recorded does not allow to simulate it"
    if worth.with_it >= worth.without:
        return "simulations of the held-out data do not improve with it"
    return (
        f"simulated, the error of {worth.output.name} falls from {worth.without:.3g} to"
        f" {worth.with_it:.3g} {worth.output.unit}"
    )


def unknown_statement(diagnosis: Diagnosis, k: int) -> str:
    """Return the k-th thing that is missing and cannot be named as one sentence."""
    shape, (driver, _, share) = diagnosis.shapes[k], diagnosis.findings.unknown[k]
    formula = _formula(shape)
    hint = f"; as a hint, it runs like {formula}" if formula else ""
    size = "".join(
        f", {100.0 * np.sqrt(share) * fit.after / max(fit.measured, 1e-300):.2g} % of what was"
        " measured"
        for fit in diagnosis.fit
        if fit.place == driver.place
    )
    return (
        f"Something is missing in {_CHANNELS[driver.place.channel].format(driver.place.element)}"
        f" that nothing in the catalogue explains: a function of {driver.signal}, from"
        f" {shape.values.min():.3g} to {shape.values.max():.3g}"
        f" {_UNITS.get(driver.place.channel, '')}, takes {100 * share:.0f} % of the squared"
        f" residual{size}{hint}."
    )


def _formula(shape: Shape) -> str | None:
    return sketch(shape.knots, shape.values, shape.driver.signal.split(" [")[0])


def channel_of(fit: HeldOut) -> str:
    """Return the public name of a residual's measured quantity."""
    return _CHANNELS[fit.place.channel].format(fit.place.element)


def drive_of(fit: SimulatedFit) -> str:
    """Return the public name of what drove a simulation."""
    return "torque" if fit.output.drive is Drive.SHAFT else fit.output.drive.value


def unit_of(fit: HeldOut) -> str:
    """Return the unit of a residual; none where channels of several units were put together."""
    return _UNITS.get(fit.place.channel, "times its noise")


_CHANNELS = {
    Channel.DRIVE: "winches/torque_command/{}",
    Channel.SHAFT: "winches/torque/{}",
    Channel.TENSION: "cables/tension/{}",
    Channel.WRENCH: "{}/wrench",
}
_UNITS = {Channel.DRIVE: "N·m", Channel.SHAFT: "N·m", Channel.TENSION: "N"}
_DRIVES = {
    Channel.DRIVE: "torque",
    Channel.SHAFT: "torque",
    Channel.TENSION: "winch",
    Channel.WRENCH: "tension",
}


def diagnosis_data(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return a diagnosis as `diagnosis.json` has it."""
    first = diagnosis.searched[0]
    roles = [("search", m) for m in diagnosis.searched]
    roles += [("held_out", m) for m in diagnosis.held_out]
    return {
        "schema": SCHEMA,
        "recordings": [_recording(role, m) for role, m in roles],
        "testbed": {"path": _testbed_path(first), "sha256": first.testbed.sha256},
        "verdict": verdict_of(diagnosis).value,
        "findings": [_finding(diagnosis, each) for each in diagnosis.findings.named]
        + [_unknown(diagnosis, k) for k in range(len(diagnosis.shapes))],
        "not_excited": [
            {"effect": name, "elements": list(elements)} for name, elements in diagnosis.silent
        ],
        "detection_limits": [limit._asdict() for limit in diagnosis.limits],
        "fit": [_simulated_fit(each) for each in diagnosis.simulated],
        "residuals": [_equation_fit(each) for each in diagnosis.fit],
        "model": IMPROVED if diagnosis.findings.named else None,
    }


def _recording(role: str, measurement: Measurement) -> dict[str, str]:
    return {"path": str(measurement.path), "sha256": measurement.sha256, "role": role}


def _testbed_path(measurement: Measurement) -> str:
    return f"{measurement.path}: testbed.yaml"


def _finding(diagnosis: Diagnosis, named: Named) -> dict[str, Any]:
    hypothesis = named.hypothesis
    probability = probability_of(named)
    onset = _onset_of(diagnosis, named)
    return {
        "subsystem": hypothesis.effect.block.value,
        "elements": list(hypothesis.elements),
        "effect": hypothesis.effect.id,
        "probability": probability,
        "statement": statement_of(diagnosis, named),
        "onset_s": onset.time if onset is not None else None,
        "onset_ci95_s": [onset.low, onset.high] if onset is not None else None,
        "region": {},
        "parameters": [
            {
                "element": candidate.element,
                "name": n.name,
                "value": n.value,
                "unit": n.unit,
                "ci95": [n.low, n.high] if n.low < n.high else None,
            }
            for candidate in members_of(diagnosis.weights, hypothesis)
            for n in numbers_of(diagnosis, candidate)
        ],
        "alternatives": [
            {
                "effect": rival.hypothesis.effect.id,
                "elements": list(rival.hypothesis.elements),
                "probability": probability * _odds(rival),
                "separating_experiment": None,
            }
            for rival in named.alternatives
        ],
    }


def _unknown(diagnosis: Diagnosis, k: int) -> dict[str, Any]:
    blocks = {
        Channel.DRIVE: Block.WINCH,
        Channel.SHAFT: Block.WINCH,
        Channel.TENSION: Block.CABLE,
        Channel.WRENCH: Block.BAR,
    }
    shape = diagnosis.shapes[k]
    driver = shape.driver
    return {
        "subsystem": blocks[driver.place.channel].value,
        "elements": [driver.place.element],
        "effect": UNKNOWN,
        "probability": None,
        "statement": unknown_statement(diagnosis, k),
        "onset_s": None,
        "region": {
            "driver": driver.signal,
            "at": shape.knots.tolist(),
            "adds": shape.values.tolist(),
            "hint": _formula(shape),
        },
        "parameters": [],
        "alternatives": [],
    }


def _equation_fit(fit: HeldOut) -> dict[str, Any]:
    numbers = fit.before, fit.after, fit.retuned, fit.noise
    drive = _DRIVES[fit.place.channel]
    found = _fit(channel_of(fit), drive, fit.measured, *numbers)
    found["held_out"]["nrmse_black_box"] = fit.ceiling / max(fit.measured, 1e-300)
    return found


def _simulated_fit(fit: SimulatedFit) -> dict[str, Any]:
    numbers = fit.before, fit.after, fit.retuned, fit.floor
    return _fit(fit.output.name, drive_of(fit), fit.measured, *numbers)


def _fit(
    channel: str,
    drive: str,
    measured: float,
    before: float,
    after: float,
    retuned: float,
    floor: float,
) -> dict[str, Any]:
    """Return one entry; all RMS, told as shares of the measured quantity's spread.

    Of a quantity that stands still, as shares of its noise.
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
    """Return the variance accounted for [%] of an error that is a share of the spread."""
    return 100.0 * (1.0 - min(1.0, share) ** 2)


def _concerned(diagnosis: Diagnosis, named: Named) -> Sequence[HeldOut]:
    places = {
        regression.channel
        for regression in (named.hypothesis.effect.regression, *named.hypothesis.effect.partners)
    }
    own = [
        f
        for f in diagnosis.fit
        if f.place.channel in places and f.place.element in (*named.hypothesis.elements, "bar")
    ]
    return own or list(diagnosis.fit)


def _words(effect: Effect) -> str:
    return effect.id.replace("_", " ").capitalize()
