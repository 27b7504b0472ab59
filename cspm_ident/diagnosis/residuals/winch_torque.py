"""The winches' torque equation (2-21), with measured torque, tension and angle."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from cspm_ident.diagnosis.residuals.free_shapes import Driver, Knots
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place, elements_of, shapes_of
from cspm_ident.diagnosis.residuals.residual_equation import AT_ONCE, Equation
from cspm_ident.diagnosis.residuals.sensor_readings import mean_of_others, reading_rows
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.side_by_side import side_by_side
from cspm_ident.signals.measurement import TENSION, WINCHES, Measurement
from cspm_ident.signals.samples import Samples
from cspm_ident.signals.timeline import joined
from cspm_ident.winch.recording import moved_along, signal_rows, winch_signals
from cspm_ident.winch.weak_form import HALF_WIDTH_S, make_window, weigh
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Cable
from cspm_sim.effect_entries import Action
from cspm_sim.effects import Channel, Effect
from cspm_sim.effects.signals import WinchSignal

Array = NDArray[np.float64]

# Lower limit of the encoder noise.
_STEP_RAD = 1e-6
SPEED, PULL = "speed [rad/s]", "tension [N]"
_DRIVERS = {
    SPEED: WinchSignal.SPEED,
    PULL: WinchSignal.TENSION,
    "angle [rad]": WinchSignal.ANGLE,
    "time [s]": WinchSignal.TIME,
}


def shaft_equations(
    measurement: Measurement,
    effects: Sequence[Effect],
    known: Sequence[Action],
    knots: Knots | None,
    winches: Collection[str],
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> list[Equation]:
    """Return the equations of the given winches whose signals were recorded.

    The residual is torque − J·q̈ − (r/n)·t less the part of the test-bed's own effects. It is
    weighted with windows, so that no noisy signal is differentiated.

    Args:
        measurement: what was recorded, with the machine as it is described.
        effects: the catalogue.
        known: effects in the test-bed file.
        knots: of the free functions; None: without these.
        winches: names of the winches.
        thresholds: `certain_sigma` and `reversal_speed_share`.
    """
    cables = measurement.machine.cables
    own = [i for i, cable in enumerate(cables) if cable.name in winches]

    def of_winch(i: int) -> list[Equation]:
        actions = [action for action in known if action.element == i]
        return [
            table.equation(effects, actions, knots).compact
            for table in _tables(measurement, i, thresholds)
        ]

    return [equation for found in side_by_side(of_winch, own, AT_ONCE) for equation in found]


def _tables(measurement: Measurement, i: int, thresholds: Thresholds) -> Iterator[_Shaft]:
    """Yield the rows of winch i, one table for each stretch in which it turns."""
    cable, ratio = measurement.machine.cables[i], thresholds.certain_sigma
    try:
        signals = winch_signals(measurement, cable.name, measurement.torque_age)
    except InputError:
        return
    drive = None if measurement.speed is None else measurement.speed.column(i)
    moved = signals.angle.kept(
        (moved_along, drive), lambda: moved_along(signals.angle, None, drive)
    )
    for times, rows in signal_rows(signals, moved=moved):
        half = max(2, round(HALF_WIDTH_S / signals.angle.interval))
        angles = rows[:, WinchSignal.ANGLE]
        if len(rows) < 2 * half + 1 or not _turns(angles, signals.angle, ratio):
            continue
        sensors = (WINCHES,) if signals.tension is None else (WINCHES, TENSION)
        lost = _lost(signals.torque, measurement.torque_age, times)
        others = _others(measurement.tension, i, times)
        share = thresholds.reversal_speed_share
        yield _Shaft(rows, cable, half, times, lost, sensors, share, others)


def _others(tension: Samples | None, i: int, times: Array) -> Array:
    """Return the mean tension that the other load cells read, zeros without any, (k,) [N]."""
    if tension is None:
        return np.zeros(len(times))
    mean = mean_of_others(tension.values, i)[:, None]
    return joined(tension.of_others(mean), times)[:, 0]


def may_reverse(speeds: Array, share: float, width: int) -> NDArray[np.bool_]:
    """Return where a shaft may reverse or stick within a window about each instant, shape (n,).

    Its speed is there below a share of its root mean square, or below half of the change from one
    reading to the next: where steps of an encoder or noise make that large, the sign of the speed
    is not known.

    Args:
        speeds: at equal steps, shape (n,) [rad/s].
        share: of the root mean square.
        width: number of instants of a window.
    """
    change = maximum_filter1d(np.abs(np.diff(speeds, append=speeds[-1:])), width)
    slow = np.maximum(share * np.sqrt(np.mean(speeds**2)), 0.5 * change)
    return np.asarray(minimum_filter1d(np.abs(speeds), width) < slow)


def _turns(angles: Array, samples: Samples, ratio: float) -> bool:
    """Return whether a shaft moves by more than its encoder's noise.

    A shaft held by its brake does not: any torque may then act.
    """
    noise = float(np.std(samples.values[:, 0] - np.interp(samples.times, *_halves(samples))))
    return bool(np.std(angles) > ratio * max(noise, _STEP_RAD))


def _halves(samples: Samples) -> tuple[Array, Array]:
    """Return every other sample; linear interpolation between them leaves little but noise."""
    return samples.times[::2], samples.values[::2, 0]


def _lost(torque: Samples, age: float, times: Array) -> NDArray[np.bool_]:
    """Return the times at which a torque reading is missing.

    A torque that changes between readings is unknown there.
    """
    after = np.searchsorted(torque.times - age, times) - 1
    return np.asarray(torque.gaps[np.clip(after, 0, len(torque.gaps) - 1)])


class _Shaft:
    """One winch's rows and the window that weights them."""

    def __init__(
        self,
        rows: Array,
        winch: Cable,
        half: int,
        times: Array,
        lost: NDArray[np.bool_],
        sensors: tuple[str, ...],
        still_share: float,
        others: Array,
    ) -> None:
        self._others = others
        self._sensors, inertia, name = sensors, winch.rotor_inertia, winch.name
        self._rows, self._inertia, self._name = rows, inertia, name
        self._step = float(times[1] - times[0])
        self._window, self._stride = make_window(half, self._step), max(1, half // 2)
        speed = np.abs(rows[:, WinchSignal.SPEED])
        view, width = np.lib.stride_tricks.sliding_window_view, len(self._window.weights)
        windows = view(speed, width)[:: self._stride]
        slow = still_share * np.sqrt(np.mean(speed**2))
        reverses = may_reverse(rows[:, WinchSignal.SPEED], still_share, width)
        whole = ~view(lost, width)[:: self._stride].any(axis=1)
        self._moving = (windows.max(axis=1) >= slow) & whole
        self._turning = view(reverses, width)[:: self._stride, width // 2][self._moving]
        self._times = self._weighed(times)

    def equation(
        self, effects: Sequence[Effect], known: Sequence[Action], knots: Knots | None
    ) -> Equation:
        rows = self._rows
        pulled = rows[:, WinchSignal.RADIUS] * rows[:, WinchSignal.TENSION]
        target = self._weighed(rows[:, WinchSignal.TORQUE]) - self._averaged(pulled)
        target = target - self._inertia * self._accelerated(rows[:, WinchSignal.ANGLE])
        gain = 1.0
        for action in known:
            effect = action.effect
            if (
                effect.physics.alter is None
                and effect.signature.regression.channel is Channel.SHAFT
            ):
                shape = {name: action.values[name] for name in effect.signature.nonlinear}
                target = target - self._regressed(effect, shape) @ effect.weights(action.values)
                gain *= 1.0 + effect.weights(action.values)[0] if effect.signature.rescales else 1.0
        columns: dict[Candidate | Driver, Array] = {
            candidate: found[:, None, :]
            for effect in effects
            for candidate, found in self._columns(effect)
        }
        place = Place(Channel.SHAFT, self._name)
        drivers = {name: self._weighed(rows[:, column]) for name, column in _DRIVERS.items()}
        if knots is not None:
            columns |= knots.columns(place, drivers)
        torque = self._weighed(rows[:, WinchSignal.TORQUE])[:, None]
        return Equation(
            place,
            self._times,
            target[:, None] / gain,
            _as_reported(columns, target[:, None] / gain, torque, gain),
            torque,
            turning=self._turning,
            signals=drivers,
        )

    def _columns(self, effect: Effect) -> Iterator[tuple[Candidate, Array]]:
        for name in elements_of(effect, (self._name,), ()):
            if effect.signature.regression.channel is Channel.SHAFT:
                for shape in shapes_of(effect):
                    yield Candidate(effect, name, shape), self._regressed(effect, dict(shape))
            elif (sense := effect.physics.sense) and sense.topics[0] in self._sensors:
                yield Candidate(effect, name), self._read(effect)

    def _regressed(self, effect: Effect, shape: dict[str, float]) -> Array:
        return self._averaged(effect.regressors(self._rows, **shape)[:, 0])

    def _read(self, effect: Effect) -> Array:
        """Return a sensor fault's change of the residual, by the reading's part in it."""
        tension = effect.physics.sense is not None and effect.physics.sense.topics[0] == TENSION
        source = WinchSignal.TENSION if tension else WinchSignal.ANGLE
        others = self._others if tension else 0.0
        times = self._rows[:, WinchSignal.TIME]
        reading = reading_rows(times, self._rows[:, source], others)
        change = effect.regressors(reading)[:, 0]
        if tension:
            return self._averaged(-self._rows[:, WinchSignal.RADIUS, None] * change)
        return -self._inertia * self._accelerated(change)

    def _weighed(self, values: Array) -> Array:
        return np.asarray(weigh(self._window.weights, values, self._stride)[self._moving])

    def _averaged(self, values: Array) -> Array:
        weights = self._window.averaged(self._step)
        return np.asarray(weigh(weights, values, self._stride)[self._moving])

    def _accelerated(self, values: Array) -> Array:
        return np.asarray(weigh(self._window.second, values, self._stride)[self._moving])


def _as_reported(
    columns: Mapping[Candidate | Driver, Array], target: Array, torque: Array, gain: float
) -> dict[Candidate | Driver, Array]:
    """Return columns of the torque as the drive reports it, where the shaft gets `gain` times that.

    A further gain multiplies the torque that the model needs, which is what the drive reports less
    the residual. By the reported torque itself, a gain of zero would leave no residual.

    Args:
        columns: of the torque at the shaft, each of shape (k, 1, weights).
        target: residual of the reported torque, shape (k, 1).
        torque: as reported, shape (k, 1).
        gain: known.
    """
    needed = (target - torque)[:, :, None]
    return {
        term: (needed if _is_scale(term) else column) / gain for term, column in columns.items()
    }


def _is_scale(term: Candidate | Driver) -> bool:
    """Return whether a term multiplies the reported torque."""
    if not isinstance(term, Candidate):
        return False
    signature = term.effect.signature
    return signature.rescales and signature.regression.channel is Channel.SHAFT
