"""Virtual load cells: tensions from the winches' torques, where no load cell measures them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.regressors import Candidate, shapes_of
from cspm_ident.diagnosis.residuals.winch_torque import may_reverse
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.samples import Samples
from cspm_ident.signals.smoothing import filtered, smooth
from cspm_ident.signals.timeline import Timeline
from cspm_ident.winch.weak_form import HALF_WIDTH_S
from cspm_msgs_py.testbed import Cable
from cspm_sim.effect_entries import Action
from cspm_sim.effects import Channel, Effect
from cspm_sim.effects.signals import WinchSignal

Array = NDArray[np.float64]

# Fixed-point iterations, because friction depends on the tension that is computed.
_FIXED_POINTS = 3


@dataclass(frozen=True, eq=False)
class DrawnTension:
    """Tensions by the winches' torque equation (2-21), and the changes that winch faults make.

    Attributes:
        measurement: recorded signals, with these tensions.
        times: of the tensions, shape (k,) [s].
        angles, speeds, accelerations: of the motors at these times, (k, n) [rad, rad/s, rad/s²].
        torques: that the tensions are computed from, (k, n) [N·m].
        band: to which they are smoothed [Hz].
        taken: subtracted from them beyond the effects of the file, (k, n) [N].
    """

    measurement: Measurement
    times: Array
    angles: Array
    speeds: Array
    accelerations: Array
    torques: Array
    band: float
    taken: Array

    @cached_property
    def lost(self) -> Array:
        """Times at which readings of the torque are missing [s]."""
        assert self.measurement.torque is not None
        times = self.measurement.torque.times
        gaps = np.flatnonzero(self.measurement.torque.gaps)
        return np.asarray(0.5 * (times[gaps] + times[gaps + 1]))

    def less(self, assumed: Mapping[Candidate, Array]) -> DrawnTension:
        """Return the tensions without the part that assumed winch faults add.

        The laws of cables are then linearised about the corrected tensions.

        Args:
            assumed: weights by candidate; only those of winches are used.
        """
        names, taken = self.measurement.machine.cable_names, np.zeros_like(self.taken)
        for candidate, weights in assumed.items():
            if _is_of_shaft(candidate.effect):
                i = names.index(candidate.element)
                taken[:, i] += self._added(candidate.effect, candidate.nonlinear, i) @ weights
        assert self.measurement.tension is not None
        samples = Samples(self.times, self.measurement.tension.values - taken)
        reported = self.measurement.with_samples("tension", samples)
        return replace(self, measurement=reported, taken=self.taken + taken)

    def taken_at(self, times: Array) -> Array:
        """Return the subtracted tensions, smoothed in the same way, (len(times), n) [N]."""
        return self._smooth(self.taken, times)

    def columns(self, effect: Effect, i: int, times: Array) -> Iterator[tuple[Candidate, Array]]:
        """Yield the change of the tension by one unit of an effect on winch i.

        Smoothed in the same way as the tension: a shaft may reverse several times within a
        smoothing step.

        Yields:
            Pairs of candidate and tensions at `times`, shape (len(times), coefficients) [N].
        """
        if not _is_of_shaft(effect):
            return
        name = self.measurement.machine.cable_names[i]
        for shape in shapes_of(effect):
            added = self._added(effect, dict(shape), i)
            yield Candidate(effect, name, shape), self._smooth(added, times)

    def _added(self, effect: Effect, shape: dict[str, float], i: int) -> Array:
        rows = self._rows[i]
        torques = effect.regressors(rows, **shape)[:, 0]
        return np.asarray(torques / rows[:, WinchSignal.RADIUS, None])

    def late(self, i: int, times: Array) -> Array:
        """Return the tension's change per second of torque delay, shape (k,) [N/s].

        The delay of a drive is known to one period only.
        """
        rows = self._rows[i]
        torque = self._smooth(rows[:, [WinchSignal.TORQUE]], times)[:, 0]
        return np.asarray(np.gradient(torque, times) / rows[0, WinchSignal.RADIUS])

    def turning(self, i: int, times: Array, thresholds: Thresholds = DEFAULT_THRESHOLDS) -> Array:
        """Return the tension's change per newton metre of dry friction near reversals, shape (k,).

        The shaft may stick there, and dry friction then holds with any torque.
        """
        rows = self._rows[i]
        speeds = rows[:, WinchSignal.SPEED]
        width = 2 * round(HALF_WIDTH_S / float(np.median(np.diff(self.times)))) + 1
        near = may_reverse(speeds, thresholds.reversal_speed_share, width)
        held = near * np.sign(speeds) / rows[:, WinchSignal.RADIUS]
        return self._smooth(held[:, None], times)[:, 0]

    def unknown_parts(
        self, i: int, times: Array, thresholds: Thresholds = DEFAULT_THRESHOLDS
    ) -> list[Array]:
        """Return the unknown parts of winch i's tension, each of shape (len(times),).

        Dry friction near reversals, and the delay of the torque where the drive's is unknown.
        """
        late = [] if self.measurement.torque_age > 0.0 else [self.late(i, times)]
        return [self.turning(i, times, thresholds), *late]

    @cached_property
    def _rows(self) -> list[Array]:
        """`WinchSignal` columns of each winch, tensions smoothed as they are measured."""
        machine, tension = self.measurement.machine, self.measurement.tension
        assert tension is not None
        tensions, found = smooth(tension, self.band).at(self.times), []
        for i, cable in enumerate(machine.cables):
            moved = (each[:, i] for each in (self.angles, self.speeds, self.accelerations))
            rows = _rows(cable, self.times, *moved)
            rows[:, WinchSignal.TENSION] = tensions[:, i]
            rows[:, WinchSignal.TORQUE] = self.torques[:, i]
            found.append(rows)
        return found

    def _smooth(self, values: Array, times: Array) -> Array:
        """Return values smoothed in the same way as tensions; splines would take too long."""
        assert self.measurement.tension is not None
        slow, _ = filtered(self.measurement.tension.of_others(values), self.band)
        return np.stack([np.interp(times, self.times, column) for column in slow.T], axis=1)


def drawn_tension(measurement: Measurement, known: Sequence[Action]) -> DrawnTension | None:
    """Return the tensions from the winches' torques; None without angles or torques.

    The torque that the test-bed's own effects take is subtracted. Any other loss of torque appears
    as a load cell fault.

    Args:
        measurement: recorded signals, without tensions.
        known: effects in the test-bed file.
    """
    if measurement.angle is None or measurement.torque is None:
        return None
    timeline = Timeline(measurement)
    torques, angles, speeds = timeline.torques, timeline.angles, timeline.speeds
    assert torques is not None
    assert angles is not None
    assert speeds is not None
    accelerations = np.gradient(speeds, timeline.period, axis=0)
    # A central difference is the mean over two steps, in each of which one torque is held.
    torques[1:] = 0.5 * (torques[:-1] + torques[1:])
    drawn = np.zeros_like(torques)
    for i, cable in enumerate(measurement.machine.cables):
        rows = _rows(cable, timeline.times, angles[:, i], speeds[:, i], accelerations[:, i])
        rows[:, WinchSignal.TORQUE] = torques[:, i]
        pulled = torques[:, i] - cable.rotor_inertia * accelerations[:, i]
        own = [action for action in known if action.element == i and _is_of_shaft(action.effect)]
        drawn[:, i] = _drawn(rows, pulled, own)
    whole = np.isfinite(drawn).all(axis=1)
    samples = Samples(timeline.times[whole], drawn[whole])
    return DrawnTension(
        measurement.with_samples("tension", samples),
        samples.times,
        angles[whole],
        speeds[whole],
        accelerations[whole],
        torques[whole],
        timeline.pose_band,
        np.zeros_like(samples.values),
    )


def _drawn(rows: Array, pulled: Array, own: Sequence[Action]) -> Array:
    """Return tensions (k,) [N] from the torques left for the cable, known friction subtracted."""
    radius = rows[:, WinchSignal.RADIUS]
    rows[:, WinchSignal.TENSION] = pulled / radius
    for _ in range(_FIXED_POINTS if own else 0):
        taken = np.zeros(len(rows))
        for action in own:
            shape = {name: action.values[name] for name in action.effect.signature.nonlinear}
            columns = action.effect.regressors(rows, **shape)[:, 0]
            taken += columns @ action.effect.weights(action.values)
        rows[:, WinchSignal.TENSION] = (pulled - taken) / radius
    return np.asarray(rows[:, WinchSignal.TENSION].copy())


def _rows(cable: Cable, times: Array, angles: Array, speeds: Array, accelerations: Array) -> Array:
    rows = np.zeros((len(times), len(WinchSignal)))
    rows[:, WinchSignal.TIME], rows[:, WinchSignal.GEAR] = times, cable.gear_ratio
    rows[:, WinchSignal.ANGLE], rows[:, WinchSignal.SPEED] = angles, speeds
    rows[:, WinchSignal.ACCELERATION] = accelerations
    rows[:, WinchSignal.RADIUS] = cable.wound_radius
    return rows


def _is_of_shaft(effect: Effect) -> bool:
    return effect.physics.sense is None and effect.signature.regression.channel is Channel.SHAFT
