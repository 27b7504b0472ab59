"""What was measured at one winch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.signals.measurement import TENSION, Measurement
from cspm_ident.signals.samples import Samples
from cspm_ident.signals.smoothing import smoothed
from cspm_ident.signals.timeline import joined
from cspm_ident.signals.winch_motion import joined_motion
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed
from cspm_sim.effects import Effect
from cspm_sim.effects.signals import WinchSignal
from cspm_sim.effects.winch_load import load_effects

Array = NDArray[np.float64]

# Standard deviations of a load cell's noise, beyond which it reads a force.
_PULLING_NOISES = 3.0


class Moved(NamedTuple):
    """A shaft's motion at equal steps.

    Attributes:
        times: shape (n,) [s].
        motion: angle [rad], speed [rad/s] and acceleration [rad/s²], shape (n, 3).
    """

    times: Array
    motion: Array


@dataclass(frozen=True, eq=False)
class WinchSignals:
    """Readings of one winch, at the motor shaft.

    Attributes:
        angle: [rad], one column.
        torque: as the drive reports it, positive winds in [N·m], one column.
        tension: that pulls at the drum [N], one column. None where no cable is described, and no
            force was read or a load is known.
        radius: drum radius / gear ratio [m].
        gear: gear ratio.
        torque_age: how long before its stamp the reported torque acted, on average [s]: half a
            period where a drive reports what it applied up to the stamp.
        speed: as the drive reports it [rad/s], one column, where acceleration and direction are
            taken from it instead of the angle; None takes them from the angle.
        load: what is known to act at the shaft, as effects: what hangs there, see `load_effects`,
            and what else the test-bed file has.
    """

    angle: Samples
    torque: Samples
    tension: Samples | None
    radius: float
    gear: float = 1.0
    torque_age: float = 0.0
    speed: Samples | None = None
    load: tuple[tuple[Effect, dict[str, float]], ...] = ()

    def load_torque(self, rows: Array) -> Array:
        """Return the torque of the known load at rest against winding, of signals, (n,) [N·m]."""
        total = np.zeros(len(rows))
        for effect, values in self.load:
            if effect.physics.alter is None:
                shape = {name: values[name] for name in effect.signature.nonlinear}
                total += effect.regressors(rows, **shape)[:, 0] @ np.asarray(effect.weights(values))
        return total

    @property
    def load_inertia(self) -> float:
        """Inertia of the known load at the motor shaft [kg·m²]."""
        return sum(values.get("inertia", 0.0) for _, values in self.load)


def winch_signals(measurement: Measurement, cable: str, torque_age: float = 0.0) -> WinchSignals:
    """Return the readings of one winch of a recording.

    Args:
        measurement: what was recorded.
        cable: name of the winch's cable.
        torque_age: see `WinchSignals`.

    Raises:
        InputError: no such cable, no angle or torque recorded, or no tension of a described cable.
    """
    machine, path = measurement.machine, measurement.path
    if cable not in machine.cable_names:
        raise InputError(f"{path}: no cable {cable}, allowed: {', '.join(machine.cable_names)}")
    index = list(machine.cable_names).index(cable)
    description = machine.cables[index]
    angle, torque = measurement.angle, measurement.torque
    if angle is None or torque is None:
        raise InputError(
            f"{path}: {cable} has no angle or no torque in /winches/state, "
            "allowed: recordings with both"
        )
    return WinchSignals(
        angle.column(index),
        torque.column(index),
        _pulling(measurement, index),
        description.wound_radius,
        description.gear_ratio,
        torque_age,
        load=tuple(load_effects(description, machine.gravity)),
    )


def _pulling(measurement: Measurement, index: int) -> Samples | None:
    """Return the tension that pulls at a winch's drum [N]; see `WinchSignals`.

    A load cell tells it, also where the file describes no cable.

    Raises:
        InputError: the tension of a described cable was not recorded.
    """
    description, tension = measurement.machine.cables[index], measurement.tension
    if tension is None:
        if not description.has_cable:
            return None
        raise InputError(
            f"{measurement.path}: {description.name} pulls a cable whose tension was not recorded, "
            "allowed: recordings with /cables/tension"
        )
    pull = tension.column(index)
    if description.has_cable:
        return pull
    return pull if description.load is None and _pulls(pull, measurement.machine) else None


def _pulls(tension: Samples, machine: Testbed) -> bool:
    """Return whether a load cell reads more than its noise [N]."""
    sensor = machine.sensors.get(TENSION)
    noise = 0.0 if sensor is None else float(np.max(sensor.noise))
    read = tension.values[np.isfinite(tension.values)]
    return bool(len(read)) and float(np.sqrt(np.mean(read**2))) > _PULLING_NOISES * noise


def signal_rows(
    signals: WinchSignals, band: float | None = None, moved: Sequence[Moved] | None = None
) -> list[tuple[Array, Array]]:
    """Return the winch's signals at equal steps, one table for each stretch without a hole.

    Angle, speed and acceleration come from one smooth function, unless `signals` name the drive's
    speed. That, torque and tension are joined by straight lines.

    Args:
        signals: the readings.
        band: kept of the angle [Hz]; by default what exceeds its noise.
        moved: the shaft's motion where it is known, see `moved_along`; the band does not count.

    Returns:
        Pairs of times [s], shape (n,), and signals, shape (n, len(WinchSignal)).
    """
    angle, reported = signals.angle, signals.speed
    tables = []
    for times, motion in moved_along(angle, band) if moved is None else moved:
        # Column by column in memory, as they are read.
        rows = np.zeros((len(times), len(WinchSignal)), order="F")
        rows[:, [WinchSignal.ANGLE, WinchSignal.SPEED, WinchSignal.ACCELERATION]] = motion
        if reported is not None:
            rows[:, WinchSignal.SPEED] = joined(reported, times)[:, 0]
            rows[:, WinchSignal.ACCELERATION] = np.gradient(
                rows[:, WinchSignal.SPEED], angle.interval
            )
        rows[:, WinchSignal.TORQUE] = joined(signals.torque, times + signals.torque_age)[:, 0]
        rows[:, WinchSignal.TORQUE_RATE] = np.gradient(rows[:, WinchSignal.TORQUE], angle.interval)
        if signals.tension is not None:
            rows[:, WinchSignal.TENSION] = joined(signals.tension, times)[:, 0]
        rows[:, WinchSignal.RADIUS] = signals.radius
        rows[:, WinchSignal.GEAR] = signals.gear
        rows[:, WinchSignal.TIME] = times
        tables += _whole(times, rows)
    return tables


def moved_along(
    angle: Samples, band: float | None = None, drive: Samples | None = None
) -> list[Moved]:
    """Return how a shaft moved, for each stretch without a hole.

    Args:
        angle: of the encoder, one column [rad].
        band: kept of it [Hz]; by default what exceeds its noise.
        drive: speed that the drive reports, one column [rad/s]: angle and speed then come from both
            sensors, see `winch_motion`.
    """
    slow, step, found = smoothed(angle, band), angle.interval, []
    for start, end in slow.spans:
        times = start + step * np.arange(int((end - start) / step + 1e-6) + 1)
        times = angle.shared.setdefault((moved_along, start, end), np.minimum(times, end))
        moved = np.empty((len(times), 3), order="F")
        if drive is None:
            moved[:, 0], moved[:, 1] = slow.at(times)[:, 0], slow.at(times, 1)[:, 0]
        else:
            motion = joined_motion(angle, drive, times)
            moved[:, 0], moved[:, 1] = motion.angles[:, 0], motion.speeds[:, 0]
        moved[:, 2] = slow.at(times, 2)[:, 0]
        found.append(Moved(times, moved))
    return found


def _whole(times: Array, rows: Array) -> list[tuple[Array, Array]]:
    """Return the stretches of rows without NaN."""
    finite = np.isfinite(rows).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], finite, [False]]).astype(int)))
    return [(times[a:b], rows[a:b]) for a, b in zip(edges[::2], edges[1::2], strict=True)]
