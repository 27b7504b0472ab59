"""The winches as load cells: what their torques say of tensions that nothing measures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.columns import Candidate, shapes_of
from cspm_ident.diagnosis.machine_signals import MachineSignals
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.samples import Samples
from cspm_ident.signals.timeline import Timeline
from cspm_msgs_py.testbed import Cable
from cspm_sim.effect_entries import Action
from cspm_sim.effects import Channel, Effect
from cspm_sim.effects.signals import WinchSignal

Array = NDArray[np.float64]

# Friction that depends on the tension that it hides.
_FIXED_POINTS = 3


def with_drawn_tension(measurement: Measurement, known: Sequence[Action]) -> Measurement | None:
    """Return the measurement with tensions by the winches' torque equation (2-21), if they tell.

    What the test-bed's own effects take of the torque is allowed for; what else takes some looks
    like a fault of a load cell, see `drawn_columns`.

    Args:
        measurement: what was recorded, without tensions.
        known: effects that the test-bed file has.
    """
    if measurement.angle is None or measurement.torque is None:
        return None
    timeline = Timeline(measurement)
    torques, angles, speeds = timeline.torques, timeline.angles, timeline.speeds
    assert torques is not None
    assert angles is not None
    assert speeds is not None
    accelerated = np.gradient(speeds, timeline.period, axis=0)
    drawn = np.zeros_like(torques)
    for i, cable in enumerate(measurement.machine.cables):
        rows = _rows(cable, timeline.times, angles[:, i], speeds[:, i])
        rows[:, WinchSignal.ACCELERATION] = accelerated[:, i]
        rows[:, WinchSignal.TORQUE] = torques[:, i]
        pulled = torques[:, i] - cable.rotor_inertia * accelerated[:, i]
        own = [action for action in known if action.element == i and _is_of_shaft(action.effect)]
        drawn[:, i] = _drawn(rows, pulled, own)
    whole = np.isfinite(drawn).all(axis=1)
    return measurement.with_samples("tension", Samples(timeline.times[whole], drawn[whole]))


def lost_torques(measurement: Measurement) -> Array:
    """Return when readings of the torque are missing [s], so that none is known there."""
    assert measurement.torque is not None
    times = measurement.torque.times
    gaps = np.flatnonzero(measurement.torque.gaps)
    return np.asarray(0.5 * (times[gaps] + times[gaps + 1]))


def drawn_columns(
    effect: Effect, cable: Cable, signals: MachineSignals, i: int
) -> Iterator[tuple[Candidate, Array]]:
    """Yield what one unit of an effect on winch i adds to the tension drawn from its torque.

    Yields:
        Pairs of candidate and tensions, shape (k, coefficients) [N].
    """
    if not _is_of_shaft(effect):
        return
    rows = _rows(cable, signals.times, signals.angles[:, i], signals.speeds[:, i])
    rows[:, WinchSignal.TENSION] = signals.tensions[:, i]
    radius = rows[:, WinchSignal.RADIUS]
    rows[:, WinchSignal.ACCELERATION] = np.gradient(signals.speeds[:, i], signals.step)
    rows[:, WinchSignal.TORQUE] = _drawing_torque(cable, signals, i)
    for shape in shapes_of(effect):
        taken = effect.regressors(rows, **dict(shape))[:, 0]
        yield Candidate(effect, cable.name, shape), taken / radius[:, None]


def late_tension(cable: Cable, signals: MachineSignals, i: int) -> Array:
    """Return what a torque adds to the tension drawn from it by the second that it is late, (k,).

    Drives say how late they are to a period only.
    """
    rate = np.gradient(_drawing_torque(cable, signals, i), signals.step)
    return np.asarray(rate * cable.gear_ratio / cable.drum_radius)


def _drawing_torque(cable: Cable, signals: MachineSignals, i: int) -> Array:
    radius = cable.drum_radius / cable.gear_ratio
    accelerated = np.gradient(signals.speeds[:, i], signals.step)
    return np.asarray(radius * signals.tensions[:, i] + cable.rotor_inertia * accelerated)


def _drawn(rows: Array, pulled: Array, own: Sequence[Action]) -> Array:
    """Return tensions (k,) [N] of what is left of torques for the cable, friction allowed for."""
    radius = rows[:, WinchSignal.RADIUS]
    rows[:, WinchSignal.TENSION] = pulled / radius
    for _ in range(_FIXED_POINTS if own else 0):
        taken = np.zeros(len(rows))
        for action in own:
            shape = {name: action.values[name] for name in action.effect.nonlinear}
            columns = action.effect.regressors(rows, **shape)[:, 0]
            taken += columns @ action.effect.weights(action.values)
        rows[:, WinchSignal.TENSION] = (pulled - taken) / radius
    return np.asarray(rows[:, WinchSignal.TENSION].copy())


def _rows(cable: Cable, times: Array, angles: Array, speeds: Array) -> Array:
    rows = np.zeros((len(times), len(WinchSignal)))
    rows[:, WinchSignal.TIME], rows[:, WinchSignal.GEAR] = times, cable.gear_ratio
    rows[:, WinchSignal.ANGLE], rows[:, WinchSignal.SPEED] = angles, speeds
    rows[:, WinchSignal.RADIUS] = cable.drum_radius / cable.gear_ratio
    return rows


def _is_of_shaft(effect: Effect) -> bool:
    return effect.sense is None and effect.regression.channel is Channel.SHAFT
