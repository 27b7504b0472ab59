"""Residual of a winch's drive: commanded less reported torque."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.free_shapes import Driver, Knots
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place, shapes_of
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.signals.measurement import Measurement
from cspm_ident.winch.weak_form import HALF_WIDTH_S, make_window, weigh
from cspm_sim.effect_entries import Action
from cspm_sim.effects import Channel, Effect
from cspm_sim.effects.signals import WinchSignal

Array = NDArray[np.float64]

_DRIVERS = {
    "reported torque [N·m]": WinchSignal.TORQUE,
    "time [s]": WinchSignal.TIME,
}


def sampled_constant(constant: Array, period: float) -> Array:
    """Return the lag of reports behind a held command, per rate of the torque [s].

    A first-order lag of time constant T sampled with period h leaves command − report = h/(exp(h/T)
    − 1) · (report − report before)/h; about T − h/2 where T is longer than h.
    """
    if period <= 0.0:
        return constant
    return np.asarray(period / np.expm1(period / np.maximum(constant, 1e-5)))


def time_constant(sampled: Array, period: float) -> Array:
    """Return the time constant for a lag of samples: the inverse of `sampled_constant` [s]."""
    if period <= 0.0:
        return sampled
    return np.asarray(period / np.log1p(period / np.maximum(sampled, 1e-9)))


def drive_equations(
    measurement: Measurement,
    effects: Sequence[Effect],
    known: Sequence[Action],
    knots: Knots | None = None,
) -> list[Equation]:
    """Return commanded less reported torque of every winch, known effects subtracted.

    A drive applies a command from its stamp on and reports it a period later, as given by the
    measurement's `torque_age`. Empty where commands or torques were not recorded.

    Args:
        measurement: recorded signals.
        effects: the catalogue.
        known: effects in the test-bed file.
        knots: of the free functions; None: without these.
    """
    command, torque = measurement.command, measurement.torque
    if command is None or torque is None:
        return []
    held = 2.0 * measurement.torque_age
    # The command that was held up to a stamp; stamps scatter by less than half a period.
    last = np.searchsorted(command.times, torque.times - 0.5 * held, side="right") - 1
    known_from = last >= 0
    found = []
    for i, cable in enumerate(measurement.machine.cables):
        rows = np.zeros((len(torque.times), len(WinchSignal)))
        rows[:, WinchSignal.TIME] = torque.times
        rows[:, WinchSignal.TORQUE] = torque.values[:, i]
        rows[1:, WinchSignal.TORQUE_RATE] = np.diff(torque.values[:, i]) / np.diff(torque.times)
        reported = command.values[np.maximum(last, 0), i]
        # A saturated drive does not follow its command.
        reported[(np.abs(reported) >= cable.torque_limit) | ~known_from] = np.nan
        own = [
            a
            for a in known
            if a.element == i and a.effect.signature.regression.channel is Channel.DRIVE
        ]
        missing = reported - rows[:, WinchSignal.TORQUE]
        equation = _equation(cable.name, missing, rows, effects, own, held, knots)
        if equation is not None:
            found.append(equation.compact)
    return found


def _equation(
    name: str,
    missing: Array,
    rows: Array,
    effects: Sequence[Effect],
    known: Sequence[Action],
    held: float,
    knots: Knots | None,
) -> Equation | None:
    whole = np.isfinite(missing)
    rows, missing = rows[whole], missing[whole]
    step = float(np.median(np.diff(rows[:, WinchSignal.TIME]))) if len(rows) > 1 else 0.0
    half = max(2, round(HALF_WIDTH_S / step)) if step > 0.0 else 0
    if not half or len(rows) < 2 * half + 1:
        return None
    window, stride = make_window(half, step).weights, max(1, half // 2)
    for action in known:
        shape = {n: action.values[n] for n in action.effect.signature.nonlinear}
        columns = action.effect.regressors(rows, **shape)[:, 0]
        missing = missing - columns @ sampled_constant(action.effect.weights(action.values), held)
    place = Place(Channel.DRIVE, name)
    found: dict[Candidate | Driver, Array] = {
        Candidate(effect, name, shape): weigh(
            window, regression.columns(rows, **dict(shape))[:, 0], stride
        )[:, None, :]
        for effect in effects
        for regression in (effect.signature.regression, *effect.signature.partners)
        if regression.channel is Channel.DRIVE
        for shape in shapes_of(effect)
    }
    signals = {key: weigh(window, rows[:, c], stride) for key, c in _DRIVERS.items()}
    if knots is not None:
        found |= knots.columns(place, signals)
    torque = weigh(window, rows[:, WinchSignal.TORQUE], stride)[:, None]
    times = weigh(window, rows[:, WinchSignal.TIME], stride)
    missing = weigh(window, missing, stride)[:, None]
    return Equation(place, times, missing, found, torque, signals=signals)
