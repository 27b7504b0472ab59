"""Residual equations of the cables' law and the bar's motion, with measured signals as input."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.residuals.cable_and_bar import Suspension
from cspm_ident.diagnosis.residuals.free_shapes import Driver, Knots, around
from cspm_ident.diagnosis.residuals.machine_signals import (
    BodyMotion,
    MachineSignals,
    machine_signals,
)
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place, elements_of, shapes_of
from cspm_ident.diagnosis.residuals.residual_equation import AT_ONCE, Equation
from cspm_ident.diagnosis.residuals.residual_window import quiet_window
from cspm_ident.diagnosis.residuals.sensor_readings import (
    mean_of_others,
    moving,
    pose_rows,
    reading_rows,
    small_step,
)
from cspm_ident.diagnosis.residuals.virtual_load_cell import DrawnTension
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds
from cspm_ident.side_by_side import side_by_side
from cspm_ident.signals.measurement import TENSION, WINCHES, Measurement
from cspm_ident.signals.timeline import Timeline
from cspm_ident.winch.weak_form import weigh
from cspm_model.kernels.machine import PlantParameters
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.testbed import Testbed
from cspm_sim.effect_entries import Action
from cspm_sim.effects import Channel, Effect, Elements
from cspm_sim.effects.signals import CableSignal

Array = NDArray[np.float64]

# Distance over which smoothing spreads a missing torque reading.
_SPREAD_S = 0.1
_TENSION = "tension [N]"
_DRIVERS = {
    _TENSION: CableSignal.TENSION,
    "rate of elongation [m/s]": CableSignal.RATE,
    "motor angle [rad]": CableSignal.ANGLE,
    "time [s]": CableSignal.TIME,
}
BAR, FRAME = Elements.BAR.value, Elements.FRAME.value


def suspension_equations(
    timeline: Timeline,
    effects: Sequence[Effect],
    known: Sequence[Action],
    knots: Knots | None = None,
    *,
    drawn: DrawnTension | None = None,
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> list[Equation]:
    """Return the equations of all cables and of the bar, one set for each stretch without gaps.

    Empty where poses of the bar, angles or tensions were not recorded.

    Args:
        timeline: of the recording.
        effects: the catalogue.
        known: effects in the test-bed file.
        knots: of the free functions; None: without these.
        drawn: tensions from the virtual load cells, where there are no load cells.
        thresholds: those of residuals.
    """
    measured = timeline.measurement
    dofs = moving(measured.bar_pose, thresholds.certain_sigma)
    return [
        equation.compact
        for stretch in machine_signals(timeline)
        for equation in _Stretch(
            stretch, measured.machine, timeline.pose_band, dofs, thresholds, drawn=drawn
        ).equations(effects, known, knots)
    ]


def fine_equations(
    stretches: Sequence[MachineSignals],
    measurement: Measurement,
    known: Sequence[Action],
    thresholds: Thresholds,
) -> list[Equation]:
    """Return the equations with the shortest windows, whatever the noise, without regressors.

    Args:
        stretches: signals without gaps.
        measurement: that they belong to.
        known: effects in the test-bed file.
        thresholds: those of residuals.
    """
    return [
        equation
        for stretch in stretches
        for equation in _Stretch(stretch, measurement.machine, None, (), thresholds).equations(
            (), known, None
        )
    ]


class _Stretch:
    """One stretch of signals and the windows that weight it."""

    def __init__(
        self,
        signals: MachineSignals,
        machine: Testbed,
        band: float | None,
        dofs: Sequence[str],
        thresholds: Thresholds,
        *,
        drawn: DrawnTension | None = None,
    ) -> None:
        """Take the band of the smoothed poses [Hz] and the bar's coordinates that move.

        Without a band, windows are the shortest. Tensions may come from virtual load cells.
        """
        self._drawn, self._thresholds = drawn, thresholds
        self._signals, self._machine, self._dofs = signals, machine, dofs
        self._parameters: PlantParameters = nominal_parameters(machine)
        self._here = Suspension(signals, machine, self._parameters)
        missing = {
            Channel.TENSION: self._here.tension_residuals,
            Channel.WRENCH: self._here.wrench_residuals,
        }
        self._windows = {
            channel: quiet_window(values, band, signals.step) for channel, values in missing.items()
        }

    def equations(
        self, effects: Sequence[Effect], known: Sequence[Action], knots: Knots | None
    ) -> list[Equation]:
        tensions, wrench = self._targets(known)
        columns: dict[Place, dict[Candidate | Driver, Array]] = {}
        for candidate, place, found in chain(*side_by_side(self._columns, effects, AT_ONCE)):
            beside = columns.setdefault(place, {})
            # A winch fault may change the cable as well as the virtual load cell's tension.
            beside[candidate] = beside[candidate] + found if candidate in beside else found
        out = [
            self._cable_equation(
                i, tensions[:, i], columns.get(Place(Channel.TENSION, name), {}), knots
            )
            for i, name in enumerate(self._machine.cable_names if self._signals.wound else ())
        ]
        out.append(self._bar_equation(wrench, columns.get(Place(Channel.WRENCH, BAR), {}), knots))
        return out if self._drawn is None else [self._known(each, self._drawn) for each in out]

    def _known(self, equation: Equation, drawn: DrawnTension) -> Equation:
        """Return the rows that no missing torque reading reaches."""
        half_s = 0.5 * len(self._windows[equation.place.channel][0]) * self._signals.step
        return equation.apart_from(drawn.lost, half_s + _SPREAD_S)

    def _cable_equation(
        self,
        i: int,
        missing: Array,
        columns: dict[Candidate | Driver, Array],
        knots: Knots | None,
    ) -> Equation:
        weighed = partial(self._weighed, channel=Channel.TENSION)
        place = Place(Channel.TENSION, self._machine.cable_names[i])
        rows = self._here.cable_rows(i)
        drivers = {key: weighed(rows[:, column]) for key, column in _DRIVERS.items()}
        # The residual contains the tension's noise, and would appear as a function of the tension.
        drivers[_TENSION] = around(drivers[_TENSION], self._apart(Channel.TENSION))
        if knots is not None:
            columns = columns | knots.columns(place, drivers)
        target, start = weighed(missing), weighed(self._here.start_column(i))
        drawn, at = self._drawn, self._signals.times
        unknown = (
            []
            if drawn is None
            else [weighed(e) for e in drawn.unknown_parts(i, at, self._thresholds)]
        )
        # Without the start's part, the target is as small as its noise even in a hold-out fold with
        # the whole stretch.
        target = target - start * (start @ target) / (start @ start)
        free = np.stack([*unknown, start], axis=1)[:, None]
        times, measured = weighed(self._signals.times), weighed(self._signals.tensions[:, i])
        whole = Equation(place, times, target[:, None], columns, measured[:, None], free)
        whole = replace(whole, signals=drivers, shared=len(unknown))
        curved = weighed(self._here.curvature[:, i])
        return whole.without_snaps(curved, self._thresholds.minor_share)

    def _bar_equation(
        self, missing: Array, columns: dict[Candidate | Driver, Array], knots: Knots | None
    ) -> Equation:
        weighed = partial(self._weighed, channel=Channel.WRENCH)
        place = Place(Channel.WRENCH, BAR)
        moved = self._bar_signals()
        if knots is not None:
            for i, drivers in enumerate(moved):
                columns = columns | knots.columns(place, drivers, i, len(DOFS))
        signals = {name: values for drivers in moved for name, values in drivers.items()}
        times, measured = weighed(self._signals.times), weighed(self._here.cable_wrench)
        equation = Equation(place, times, weighed(missing), columns, measured, signals=signals)
        if self._drawn is None:
            return equation
        drawn, here, at = self._drawn, self._here, self._signals.times
        limits = self._thresholds
        every = range(len(self._machine.cables))
        late = np.asarray(sum(here.pulled(i, drawn.late(i, at)) for i in every))
        free = [late, *(here.pulled(i, drawn.turning(i, at, limits)) for i in every)]
        nuisance = np.stack([weighed(each) for each in free], axis=2)
        return replace(equation, nuisance=nuisance, shared=len(free))

    def _bar_signals(self) -> list[dict[str, Array]]:
        """Return signals that each of the bar's six components may depend on, by name and unit."""
        state, poses = self._here.bar, self._signals.bar.poses
        speeds = np.hstack([state.velocity, state.omega])
        found = []
        for i, dof in enumerate(DOFS):
            unit = "m" if i < 3 else "rad"
            drivers = {f"time, in {dof} [s]": self._signals.times}
            if dof in self._dofs:
                drivers[f"{dof} [{unit}]"] = poses[:, i]
                drivers[f"{dof} speed [{unit}/s]"] = speeds[:, i]
            weighed = {
                name: self._weighed(values, Channel.WRENCH) for name, values in drivers.items()
            }
            found.append(weighed)
        return found

    def _targets(self, known: Sequence[Action]) -> tuple[Array, Array]:
        tensions, wrench = self._here.tension_residuals.copy(), self._here.wrench_residuals.copy()
        if self._drawn is not None:
            taken = self._drawn.taken_at(self._signals.times)
            tensions += taken
            wrench -= sum(self._here.pulled(i, each) for i, each in enumerate(taken.T))
        for action in known:
            effect = action.effect
            if effect.is_correction:
                continue
            shape = {name: action.values[name] for name in effect.signature.nonlinear}
            weights = effect.weights(action.values)
            for _, place, found in self._regressed(effect, action.element, [shape]):
                if place.channel is Channel.TENSION:
                    i = self._machine.cable_names.index(place.element)
                    tensions[:, i] -= found[:, 0] @ weights
                else:
                    wrench -= found @ weights
        return tensions, wrench

    def _columns(self, effect: Effect) -> list[tuple[Candidate, Place, Array]]:
        """Return the change of each weighted residual per unit of an effect's weights.

        In single precision, since in a long recording they take most of the memory.
        """
        return [(own, at, found.astype("f4")) for own, at, found in self._changes(effect)]

    def _changes(self, effect: Effect) -> Iterator[tuple[Candidate, Place, Array]]:
        bodies = (BAR, FRAME) if self._machine.winch_frame else (BAR,)
        for i, name in enumerate(elements_of(effect, self._machine.cable_names, bodies)):
            if effect.signature.regression.channel is Channel.READING:
                for place, found in self._read(effect, i, name):
                    yield Candidate(effect, name), place, found
                continue
            if self._drawn is not None:
                yield from self._misread(effect, i, self._drawn)
            shapes = [dict(shape) for shape in shapes_of(effect)]
            for shape, place, found in self._regressed(effect, i, shapes):
                candidate = Candidate(effect, name, tuple(shape.items()))
                yield candidate, place, self._weighed(found, place.channel)

    def _regressed(
        self, effect: Effect, i: int, shapes: Sequence[dict[str, float]]
    ) -> Iterator[tuple[dict[str, float], Place, Array]]:
        shares_noise = effect.signature.shares_noise
        for regression in (effect.signature.regression, *effect.signature.partners):
            for place, rows in self._rows_of(effect, regression.channel, i):
                for shape in shapes:
                    columns = partial(regression.columns, **shape)
                    on_bar = rows is self._here.bar_rows
                    found = self._quieter(columns) if on_bar else columns(rows)
                    yield shape, place, self._moved(found) if shares_noise else found

    def _rows_of(self, effect: Effect, channel: Channel, i: int) -> Iterator[tuple[Place, Array]]:
        """Yield the residuals that an effect on element i changes, with its input signals."""
        names, here = self._machine.cable_names, self._here
        if channel is Channel.WRENCH:
            of_cable = effect.acts_on is Elements.CABLES
            yield Place(channel, BAR), here.end_rows(i) if of_cable else here.bar_rows
        elif channel is Channel.TENSION and effect.acts_on is Elements.FRAME:
            for k, name in enumerate(names):
                yield Place(channel, name), here.frame_rows(k)
        elif channel is Channel.TENSION:
            yield Place(channel, names[i]), here.cable_rows(i)

    def _quieter(self, columns: Callable[[Array], Array]) -> Array:
        """Return the bar's regressors, each with accelerations from the less noisy sensor.

        The noise of both is in the residual as well, so a noisy regressor would appear significant.
        What both sensors have in common is not noise. Regressors with too small a common part are
        set to zero.
        """
        ways = columns(self._here.bar_rows), columns(self._here.posed_bar_rows)
        by_tension, by_pose = (self._weighed(way, Channel.WRENCH) for way in ways)
        common = np.einsum("kij,kij->j", by_tension, by_pose)
        reported, posed = (np.sum(way**2, axis=(0, 1)) for way in (by_tension, by_pose))
        quieter = np.where(reported <= posed, *ways)
        least = self._thresholds.common_acceleration_share * np.minimum(reported, posed)
        quieter[:, :, common < least] = 0.0
        return quieter

    def _moved(self, columns: Array) -> Array:
        """Return regressors (k, 6, m) without the coordinates whose readings are noise alone."""
        moves = np.array([dof in self._dofs for dof in DOFS])
        return np.asarray(columns * moves[None, :, None])

    def _read(self, effect: Effect, i: int, name: str) -> Iterator[tuple[Place, Array]]:
        """Yield a sensor fault's change of the weighted residuals, by finite differences."""
        assert effect.physics.sense is not None
        topic = effect.physics.sense.topics[0]
        if topic == TENSION and self._drawn is not None:
            return
        if topic in (TENSION, WINCHES):
            yield from self._read_joint(effect, i, topic)
            return
        changes = [self._changed(*faulty) for faulty in self._misplaced(effect, name)]
        tensions = np.stack([c[0] for c in changes], axis=2)
        for k, cable in enumerate(self._machine.cable_names):
            if np.any(tensions[:, k]):
                yield Place(Channel.TENSION, cable), tensions[:, k, None, :]
        yield Place(Channel.WRENCH, BAR), np.stack([c[1] for c in changes], axis=2)

    def _changed(self, moved: MachineSignals, step: float) -> tuple[Array, Array]:
        """Return the change of the weighted residuals, cable by cable to save memory."""
        there, here = self._here.with_poses(moved), self._here
        wrench, tensions = there.needed - here.wrench_residuals, []
        for i in range(len(self._machine.cable_names)):
            cable = there.of_cable(i)
            change = (cable.tension_residuals[:, 0] - here.tension_residuals[:, i]) / step
            tensions.append(self._weighed(change, Channel.TENSION))
            wrench = wrench - cable.cable_wrench
        return np.stack(tensions, axis=1), self._weighed(wrench / step, Channel.WRENCH)

    def _misplaced(self, effect: Effect, name: str) -> Iterator[tuple[MachineSignals, float]]:
        """Yield the signals with a small part of each fault of a pose, and its size."""
        body = "bar" if name == BAR else "frame"
        motion: BodyMotion = getattr(self._signals, body)
        rows = pose_rows(self._signals.times, motion.poses, motion.rates)
        for change in np.moveaxis(effect.regressors(rows), 2, 0):
            step = small_step(change)
            yield self._signals.with_pose_change(body, change, step), step

    def _read_joint(self, effect: Effect, i: int, topic: str) -> Iterator[tuple[Place, Array]]:
        """Yield the change of cable and bar residuals by a fault of a tension or an angle."""
        signals = self._signals
        readings = signals.tensions if topic == TENSION else signals.angles
        rescaled = effect.signature.rescales * self._here.tension_residuals[:, i]
        own, others = readings[:, i] - rescaled, mean_of_others(readings, i)
        change = effect.regressors(reading_rows(signals.times, own, others))[:, 0, 0]
        step = small_step(change)
        changed = readings.copy()
        changed[:, i] += step * change
        if topic == TENSION:
            moved = replace(signals, tensions=changed)
        else:
            speeds = signals.speeds.copy()
            speeds[:, i] += step * np.gradient(change, signals.step)
            moved = replace(signals, angles=changed, speeds=speeds)
        there = self._here.with_joints(moved).of_cable(i).tension_residuals[:, 0]
        residual = self._weighed(
            (there - self._here.tension_residuals[:, i]) / step, Channel.TENSION
        )
        yield Place(Channel.TENSION, self._machine.cable_names[i]), residual[:, None, None]
        if topic == TENSION:
            wrench = self._weighed(-self._here.pulled(i, change), Channel.WRENCH)
            yield Place(Channel.WRENCH, BAR), wrench[:, :, None]

    def _misread(
        self, effect: Effect, i: int, drawn: DrawnTension
    ) -> Iterator[tuple[Candidate, Place, Array]]:
        """Yield a winch fault's change of the virtual load cell's tension, weighted."""
        if effect.acts_on is not Elements.CABLES:
            return
        for candidate, taken in drawn.columns(effect, i, self._signals.times):
            pulled = [-self._here.pulled(i, each) for each in taken.T]
            for channel, element, found in (
                (Channel.TENSION, candidate.element, taken[:, None, :]),
                (Channel.WRENCH, BAR, np.stack(pulled, axis=2)),
            ):
                yield candidate, Place(channel, element), self._weighed(found, channel)

    def _weighed(self, values: Array, channel: Channel) -> Array:
        window, stride = self._windows[channel]
        return weigh(window, values, stride)

    def _apart(self, channel: Channel) -> int:
        """Return the number of rows between two windows that share no sample."""
        window, stride = self._windows[channel]
        return -(-len(window) // stride)
