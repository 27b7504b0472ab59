"""Statements of a diagnosis on unexplained residuals, tensions and spectral lines."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cspm_ident.block_simulation import Input
from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.finding import Shape, Unexplained
from cspm_ident.diagnosis.reporting.formula_hint import is_even, sketch
from cspm_ident.diagnosis.reporting.quantity import amount_words, percent_words
from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.spectral_lines import Line
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.diagnosis.validation.extrapolation import Extrapolation
from cspm_ident.diagnosis.validation.holdout_residuals import HeldOut
from cspm_ident.diagnosis.validation.holdout_simulation import SimulatedFit
from cspm_ident.diagnosis.validation.remainder import Remainder
from cspm_ident.diagnosis.validation.residual_curves import Curve
from cspm_ident.diagnosis.validation.residual_power import Power
from cspm_msgs_py.dofs import DOFS
from cspm_sim.effects import Channel

Array = NDArray[np.float64]


def unknown_statement(diagnosis: Diagnosis, unexplained: Unexplained) -> str:
    """Return one sentence on a residual that no effect of the catalogue explains."""
    driver, _, share, shape = unexplained
    assert shape is not None
    formula = formula_of(driver, shape, diagnosis.thresholds)
    hint = f"; as a hint, it runs like {formula}" if formula else ""
    size = "".join(
        f", {percent_words(np.sqrt(share) * fit.after, fit.measured)} of what was measured"
        for fit in diagnosis.fit
        if fit.place == driver.place
    )
    return (
        f"Something is missing in {_CHANNELS[driver.place.channel].format(driver.place.element)}"
        f" that nothing in the catalogue explains: a function of {driver.signal}, from"
        f" {shape.values.min():.3g} to {shape.values.max():.3g}"
        f" {_unit_in(driver)}, takes {100 * share:.0f} % of the squared"
        f" residual{size}{hint}{_by_direction(driver, shape, diagnosis.thresholds)}."
    )


def _unit_in(driver: Driver) -> str:
    """Return the unit of a driver's free function; for the wrench it depends on the component."""
    turns = any(dof in driver.signal for dof in DOFS[3:])
    return _UNITS.get(driver.place.channel, "N·m" if turns else "N")


def _by_direction(driver: Driver, shape: Shape, thresholds: Thresholds) -> str:
    """Return the meaning of an even function of a shaft's speed, as friction itself is odd."""
    of_speed = driver.place.channel is Channel.SHAFT and driver.signal.startswith("speed ")
    if not of_speed or not is_even(shape.knots, shape.values, thresholds):
        return ""
    return "; it is the same in both directions, so that friction differs by direction"


def tension_statement(diagnosis: Diagnosis) -> str | None:
    """Return a note on virtual load cells if no load cell was recorded, else None."""
    measured = all(m.tension is not None for m in diagnosis.searched)
    if measured or not any(place.channel is Channel.TENSION for place in diagnosis.places):
        return None
    return "No load cell was recorded: tensions are drawn from the winches' torques."


def line_statement(line: Line) -> str:
    """Return a spectral line of a residual, or an aliased tension, in words."""
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


def remainder_statement(left: Remainder) -> str:
    """Return what is left of a residual beyond its noise: size, function of what, and when."""
    turns = left.place.channel in (Channel.DRIVE, Channel.SHAFT) or left.component in DOFS[3:]
    unit = "N·m" if turns else "N"
    where = _CHANNELS[left.place.channel].format(left.place.element)
    where += f" in {left.component}" if left.component else ""
    words = (
        f"On held-out data {where} differs from the model by {amount_words(left.rms, unit)},"
        f" {left.ratio:.2g} times its noise and {percent_words(left.rms, left.measured)} of what"
        " was measured"
    )
    if left.share >= _SHOWN:
        words += f"; {100 * left.share:.0f} % of the squares are a function of {left.driver}"
    if left.stretch.share >= _SHOWN:
        words += (
            f"; {100 * left.stretch.share:.0f} % of the squares lie between"
            f" {left.stretch.start:.3g} and {left.stretch.end:.3g} s"
        )
    return f"{words}. Nothing in the catalogue explains it."


def extrapolation_statement(beyond: Extrapolation) -> str:
    """Return how far held-out data take a signal beyond what was searched."""
    name, unit = beyond.signal.rstrip("]").split(" [")
    searched, reached = (
        f"{low:.3g} to {high:.3g}" for low, high in (beyond.searched, beyond.held_out)
    )
    return (
        f"Held-out data of {channel_of(beyond)} take the {name} from {reached} {unit}, where"
        f" {searched} {unit} was searched: for {100 * beyond.share:.0f} % of their rows the"
        " findings are extrapolated."
    )


def simulated_statement(fit: SimulatedFit) -> str:
    """Return how far a simulation of held-out data is from what was measured."""
    return (
        f"Simulated from measured {drive_of(fit)}, {fit.output.name} differs by"
        f" {amount_words(fit.final, fit.output.unit)} on held-out data,"
        f" {fit.final / fit.floor:.2g} times its noise. Nothing in the catalogue explains it."
    )


def formula_of(
    driver: Driver, shape: Shape, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> str | None:
    """Return a simple formula that fits a free function of a signal, or None."""
    name = driver.signal.split(" [")[0]
    return sketch(shape.knots, shape.values, name, thresholds)


def channel_of(fit: HeldOut | Power | Remainder | Curve | Extrapolation) -> str:
    """Return the public name of a residual's measured quantity."""
    return _CHANNELS[fit.place.channel].format(fit.place.element)


def drive_of(fit: SimulatedFit) -> str:
    """Return the public name of a simulation's input."""
    return "torque" if fit.output.drive is Input.SHAFT else fit.output.drive.value


def unit_of(fit: HeldOut) -> str:
    """Return the unit of a residual; its noise where channels of several units are combined."""
    return _UNITS.get(fit.place.channel, "times its noise")


# Share of squares from which on a signal or a stretch is named.
_SHOWN = 0.3
_CHANNELS = {
    Channel.DRIVE: "winches/torque_command/{}",
    Channel.SHAFT: "winches/torque/{}",
    Channel.TENSION: "cables/tension/{}",
    Channel.WRENCH: "{}/wrench",
}
_UNITS = {Channel.DRIVE: "N·m", Channel.SHAFT: "N·m", Channel.TENSION: "N"}
