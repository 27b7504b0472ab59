"""What a diagnosis says, in words that a person can act on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cspm_ident.block_simulation import Drive
from cspm_ident.diagnosis.columns import Candidate
from cspm_ident.diagnosis.diagnose import Diagnosis, Shape
from cspm_ident.diagnosis.hypothesis import Named, members_of
from cspm_ident.diagnosis.judgement import HeldOut
from cspm_ident.diagnosis.lines import Line
from cspm_ident.diagnosis.power import Power
from cspm_ident.diagnosis.region import Region
from cspm_ident.diagnosis.simulation import SimulatedFit, Worth
from cspm_ident.diagnosis.sketch import sketch
from cspm_msgs_py.dofs import DOFS
from cspm_sim.effects import Channel, Effect

_DOUBT = (
    " Doubtful: beside it is much that nothing in the catalogue explains, of which this may be a"
    " part."
)


class Number(NamedTuple):
    """A parameter of a finding.

    Attributes:
        name: public name.
        value: in `unit`.
        unit: SI.
        low, high: ends of its 95 % interval as far as the catalogue allows, all that it allows
            where the data do not tell it; equal to the value where it was searched on a grid.
    """

    name: str
    value: float
    unit: str
    low: float
    high: float


def numbers_of(diagnosis: Diagnosis, candidate: Candidate) -> list[Number]:
    """Return the parameters of an effect on one element."""
    weights, widths = diagnosis.weights[candidate]
    effect = candidate.effect
    values = effect.values(weights.tolist(), **candidate.nonlinear)
    if not np.all(np.isfinite(widths)):
        return [
            Number(p.name, values[p.name], p.unit, p.minimum, p.maximum) for p in effect.parameters
        ]
    low = effect.values((weights - widths).tolist(), **candidate.nonlinear)
    high = effect.values((weights + widths).tolist(), **candidate.nonlinear)
    return [
        Number(
            p.name,
            values[p.name],
            p.unit,
            max(p.minimum, min(low[p.name], high[p.name])),
            min(p.maximum, max(low[p.name], high[p.name])),
        )
        for p in effect.parameters
    ]


def statement_of(diagnosis: Diagnosis, k: int) -> str:
    """Return the k-th finding as one sentence that a person can act on."""
    named, region = diagnosis.findings.named[k], diagnosis.regions[k]
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
    best = max(_concerned(diagnosis, named), key=lambda fit: fit.before / max(fit.after, 1e-300))
    doubt = _DOUBT if diagnosis.findings.is_doubtful(named) else ""
    where = f" It shows where {region_words(region)}." if region is not None else ""
    return (
        f"{_words(effect)} {missing}{_since(diagnosis, k)} ({'; '.join(parts)})."
        f" With it the held-out residual of {channel_of(best)} falls from"
        f" {_amount(best, best.before)} to {_amount(best, best.after)},"
        f" where noise is {_amount(best, best.noise)};"
        f" {_simulated_worth(diagnosis.worth[k])}.{where}{doubt}"
    )


def _since(diagnosis: Diagnosis, k: int) -> str:
    named, onset = diagnosis.findings.named[k], diagnosis.onsets[k]
    if onset is not None:
        return f", from {onset.time:.1f} s on ({onset.low:.1f} to {onset.high:.1f} s)"
    block = named.hypothesis.onset
    return f", from block {block} of the recordings on" if block else ""


def region_words(region: Region) -> str:
    """Return where a finding shows."""
    signal, unit = region.driver.rstrip("]").split(" [")
    return (
        f"{signal} is {region.low:.3g} to {region.high:.3g} {unit}: {100 * region.held:.0f} % of"
        f" what it takes from the squared residual lies in these {100 * region.share:.0f} % of the"
        " data"
    )


def _amount(fit: HeldOut, value: float) -> str:
    """Return a residual in its unit, and as a share of what was measured."""
    return f"{value:.3g} {unit_of(fit)} ({100.0 * value / max(fit.measured, 1e-300):.2g} %)"


def _simulated_worth(worth: Worth | None) -> str:
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
    formula = formula_of(shape)
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


def tension_statement(diagnosis: Diagnosis) -> str | None:
    """Return where tensions come from if no load cell measured them, else None."""
    measured = all(m.tension is not None for m in diagnosis.searched)
    if measured or not any(place.channel is Channel.TENSION for place in diagnosis.places):
        return None
    return "No load cell was recorded: tensions are drawn from the winches' torques."


def line_statement(line: Line) -> str:
    """Return a periodic part of a residual as one sentence."""
    what = _CHANNELS[line.place.channel].format(line.place.element)
    unit = _UNITS.get(line.place.channel, "N")
    if line.place.channel is Channel.WRENCH:
        dof = DOFS[line.channel]
        what, unit = f"{what} in {dof}", "N" if line.channel < 3 else "N·m"
    return (
        f"Something periodic is missing in {what}: {line.amplitude:.3g} {unit} at"
        f" {line.frequency:.2f} Hz, where nothing moves the machine and which keeps its phase, so"
        " that it comes from outside; look for what runs at"
        f" {60.0 * line.frequency:.0f} rounds a minute."
    )


def formula_of(shape: Shape) -> str | None:
    """Return a formula that a shape follows, if a simple one does."""
    return sketch(shape.knots, shape.values, shape.driver.signal.split(" [")[0])


def channel_of(fit: HeldOut | Power) -> str:
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
