"""What a diagnosis says, in words that a person can act on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.block_simulation import Input
from cspm_ident.diagnosis.diagnose import Diagnosis, Shape
from cspm_ident.diagnosis.reporting.formula_hint import is_even, sketch
from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.residuals.spectral_lines import Line
from cspm_ident.diagnosis.validation.holdout_residuals import HeldOut
from cspm_ident.diagnosis.validation.holdout_simulation import SimulatedFit
from cspm_ident.diagnosis.validation.residual_power import Power
from cspm_msgs_py.dofs import DOFS
from cspm_sim.effects import Channel, EffectParameter

Array = NDArray[np.float64]


class Number(NamedTuple):
    """A parameter of a finding.

    Attributes:
        name: public name.
        value: in `unit`.
        unit: SI.
        low, high: ends of its 95 % interval as far as the catalogue allows; equal to the value
            where it was searched on a grid, or is doubtful.
        is_open: whether they are all that the catalogue allows, the data telling nothing of it.
    """

    name: str
    value: float
    unit: str
    low: float
    high: float
    is_open: bool = False

    @property
    def ci95(self) -> tuple[float, float] | None:
        """Its 95 % interval, if it has one."""
        return (self.low, self.high) if self.low < self.high and not self.is_open else None


def numbers_of(diagnosis: Diagnosis, candidate: Candidate) -> list[Number]:
    """Return the parameters of an effect on one element.

    What is doubtful has no interval: noise says how far others would come with the same law, and
    not by how much what is unknown beside it moves them all.
    """
    weights, widths = diagnosis.weights[candidate]
    effect = candidate.effect
    values = effect.values(weights.tolist(), **candidate.nonlinear)
    if _is_doubtful(diagnosis, candidate):
        own = ((p, values[p.name]) for p in effect.parameters)
        return [Number(p.name, value, p.unit, value, value) for p, value in own]
    if not np.all(np.isfinite(widths)):
        return [_number(p, values[p.name], p.minimum, p.maximum) for p in effect.parameters]
    most = np.maximum(weights + widths, diagnosis.spectra.get(candidate, -np.inf))
    ends = _ends(candidate, weights, weights - widths, most)
    return [
        _number(p, values[p.name], max(p.minimum, low), min(p.maximum, high))
        for p, (low, high) in zip(effect.parameters, ends, strict=True)
    ]


def _ends(
    candidate: Candidate, weights: Array, low: Array, high: Array
) -> list[tuple[float, float]]:
    """Return the intervals of an effect's parameters from those of its weights.

    What each weight moves a parameter down and up within its own interval, in squares (GUM, JCGM
    100:2008, 5.1.2): an amplitude is as sure whatever its phase is.
    """
    names = [p.name for p in candidate.effect.parameters]

    def values(moved: Array) -> Array:
        found = candidate.effect.values(moved.tolist(), **candidate.nonlinear)
        return np.array([found[name] for name in names])

    told = values(weights)
    squares = np.zeros((2, len(names)))
    for k in range(len(weights)):
        ends = [low[k], high[k], np.clip(0.0, low[k], high[k])]
        moved = [values(np.where(np.arange(len(weights)) == k, end, weights)) for end in ends]
        apart = np.array([told, *moved]) - told
        squares += np.square([apart.min(axis=0), apart.max(axis=0)])
    return list(zip(told - np.sqrt(squares[0]), told + np.sqrt(squares[1]), strict=True))


def _number(own: EffectParameter, value: float, low: float, high: float) -> Number:
    return Number(own.name, value, own.unit, low, high, own.is_open(low, high))


def _is_doubtful(diagnosis: Diagnosis, candidate: Candidate) -> bool:
    """Return whether the finding that a candidate is part of is doubtful."""
    findings = diagnosis.findings
    return any(
        candidate.effect_id == named.hypothesis.effect.id
        and candidate.element in named.hypothesis.elements
        and findings.is_doubtful(named)
        for named in findings.named
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
        f" {_unit_in(driver)}, takes {100 * share:.0f} % of the squared"
        f" residual{size}{hint}{_by_direction(shape)}."
    )


def _unit_in(driver: Driver) -> str:
    """Return the unit of what a driver adds; those of the bar's wrench name its component."""
    turns = any(dof in driver.signal for dof in DOFS[3:])
    return _UNITS.get(driver.place.channel, "N·m" if turns else "N")


def _by_direction(shape: Shape) -> str:
    """Return what an even function of a shaft's speed means: friction itself is odd."""
    driver = shape.driver
    of_speed = driver.place.channel is Channel.SHAFT and driver.signal.startswith("speed ")
    if not of_speed or not is_even(shape.knots, shape.values):
        return ""
    return "; it is the same in both directions, so that friction differs by direction"


def tension_statement(diagnosis: Diagnosis) -> str | None:
    """Return where tensions come from if no load cell measured them, else None."""
    measured = all(m.tension is not None for m in diagnosis.searched)
    if measured or not any(place.channel is Channel.TENSION for place in diagnosis.places):
        return None
    return "No load cell was recorded: tensions are drawn from the winches' torques."


def line_statement(line: Line) -> str:
    """Return a periodic part of a residual, or what alternates in a reading, in words."""
    if line.alternates:
        return (
            f"The tension of cable {line.place.element} alternates from one reading to the next, by"
            f" ± {line.amplitude:.3g} N: it swings faster than it is recorded, as where a force"
            " loop is unstable, and what acts between the readings is not known. Whatever is said"
            f" of {line.place.element}, of the bar and of the winch frame is doubtful until it is"
            " calmed."
        )
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
    return "torque" if fit.output.drive is Input.SHAFT else fit.output.drive.value


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
